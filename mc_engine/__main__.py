"""The process of the command line: `mc-engine`, or `python -m mc_engine`."""

import os
import sys
from importlib import import_module


def _forget_working_folder() -> None:
    """Take the folder that `python -m` puts first off the path: what lies there by chance is not to be imported in
    place of what is meant.  It stays where it is the one that the engine itself comes from."""
    first, own = os.path.realpath(sys.path[0] or "."), os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
    if not sys.flags.safe_path and first == os.path.realpath(".") != own:
        del sys.path[0]


def main() -> None:
    """Run the command line of this process; does not return."""
    from mc_engine.interruption import install_handlers
    from mc_engine.text import clean_streams
    from mc_engine.unforeseen import UNFORESEEN, catch_all, refuse_small_memory, unforeseen

    install_handlers()  # to Ctrl-C also while the rest is loaded
    for library in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(library, "1")  # its threads wait for each other longer than the small matrices here take
    catch_all()
    refuse_small_memory()
    with clean_streams():
        try:
            # by name, since this file lies below all packages and its process stands above them
            import_module("mc_engine.command_line.commands").app(prog_name="mc-engine")
        except (SystemExit, KeyboardInterrupt):
            raise
        except BaseException as error:  # while no command is at work, such as in loading itself
            print(unforeseen(error), file=sys.stderr)
            sys.exit(UNFORESEEN)


if __name__ == "__main__":
    _forget_working_folder()  # before anything else is imported
    main()
