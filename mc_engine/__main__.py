"""The process of the command line: `mc-engine`, or `python -m mc_engine`."""

import sys
from pathlib import Path

from mc_engine.interruption import listen
from mc_engine.user_streams import user_streams


def main() -> None:
    """Run the command line of this process; does not return."""
    listen()  # to Ctrl-C also while the rest is loaded
    with user_streams():
        from mc_engine.cli import app

        app(prog_name="mc-engine")


def _forget_working_folder() -> None:
    """Take the folder that `python -m` puts first off the path: what lies there by chance is not to be imported in
    place of what is meant.  It stays where it is the one that the engine itself comes from."""
    first = Path(sys.path[0] or ".").resolve()
    if not sys.flags.safe_path and first == Path.cwd() != Path(__file__).resolve().parents[1]:
        del sys.path[0]


if __name__ == "__main__":
    _forget_working_folder()
    main()
