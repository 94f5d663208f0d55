"""Build the site: `python -m mc_engine.documentation FOLDER`; exit status 1 if a page has an error."""

import argparse
from pathlib import Path

from mc_engine.documentation.website import build
from mc_engine.errors import EngineError


def main() -> None:
    """Build the site into the folder that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m mc_engine.documentation", description="Build the documentation.")
    parser.add_argument("folder", type=Path, help="where the pages are to be")
    folder = parser.parse_args().folder
    try:
        in_order = build(folder)
    except EngineError as error:
        raise SystemExit(str(error)) from None
    if not in_order:
        raise SystemExit(1)
    print(folder / "index.html")


if __name__ == "__main__":
    main()
