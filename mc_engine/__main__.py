"""`python -m mc_engine` is `mc-engine`."""

from mc_engine.cli import main

if __name__ == "__main__":
    main()
