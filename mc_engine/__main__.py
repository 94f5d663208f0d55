"""The process of the command line: `mc-engine`, or `python -m mc_engine`."""

import os
import sys
from importlib import import_module


def _refuse_lost_folder() -> None:
    """End the process where the working folder was removed: what is imported or started then fails in its own way."""
    try:
        os.getcwd()
    except OSError as error:
        print(f"the working folder: {error.strerror}; change to another folder first", file=sys.stderr)
        sys.exit(2)  # wrong usage


def _refuse_build_time() -> None:
    """End the process where NumPy cannot read the build time, which the import of SciPy makes it do."""
    build_time = os.environ.get("SOURCE_DATE_EPOCH", "0")
    try:
        int(build_time)
    except ValueError:
        print(f"SOURCE_DATE_EPOCH: {build_time!a} is no whole number of seconds; correct or unset it", file=sys.stderr)
        sys.exit(2)  # wrong usage


def _forget_working_folder() -> None:
    """Remove the working folder, which `python -m` puts first, from the import path, unless the engine is in it.

    A file there could otherwise replace a module of the standard library.
    """
    first, own = os.path.realpath(sys.path[0] or "."), os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
    if not sys.flags.safe_path and first == os.path.realpath(".") != own:
        del sys.path[0]


def main() -> None:
    """Run the command line in this process; does not return."""
    from mc_engine.garbage_collection import collect_rarely
    from mc_engine.interruption import install_handlers
    from mc_engine.text import clean_streams
    from mc_engine.unforeseen import UNFORESEEN, catch_all, refuse_small_memory, unforeseen
    from mc_engine.unused_imports import leave_out_unused

    _refuse_lost_folder()
    _refuse_build_time()
    install_handlers()  # before the rest is loaded, which takes longest
    collect_rarely()
    leave_out_unused()
    for library in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(library, "1")  # for small matrices its threads cost more than they gain
    # or pydantic reads the metadata of all installed packages; also in processes that the engine starts
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    catch_all()
    refuse_small_memory()
    with clean_streams():
        try:
            # by name: this file is in the lowest package, which must not import from the highest
            import_module("mc_engine.command_line.commands").app(prog_name="mc-engine")
        except (SystemExit, KeyboardInterrupt):
            raise
        except BaseException as error:  # outside of a command, for example while modules are loaded
            print(unforeseen(error), file=sys.stderr)
            sys.exit(UNFORESEEN)


if __name__ == "__main__":
    _refuse_lost_folder()
    _forget_working_folder()  # before anything else is imported
    main()
