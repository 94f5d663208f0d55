"""What is wrong with a model that cannot be compiled or flown, in a sentence with its place."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from traceback import extract_tb

from mc_engine.errors import EngineError, ModelError


@contextmanager
def naming_faults(reference: str, what: str) -> Iterator[None]:
    """Turn any error of the model's own code into a ModelError that names the model and what was being done."""
    try:
        yield
    except EngineError:
        raise
    except Exception as error:
        raise ModelError(f"{reference}: {what} cannot be flown: {_sentence(error)}") from error


def place_in_model(error: BaseException) -> str:
    """Such as "model.py, line 12": the last place outside the engine and the libraries that the error came through."""
    engine = Path(__file__).parent
    for frame in reversed(extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if engine not in path.parents and "site-packages" not in path.parts and path.suffix == ".py":
            return "" if "importlib" in path.parts else f"{path.name}, line {frame.lineno}"
    return ""


def _sentence(error: Exception) -> str:
    """The error in one line; of the compiler's pages only the cause, the place and what to use instead."""
    if not type(error).__module__.startswith("numba"):
        spot = place_in_model(error)
        return f"{spot}: {type(error).__name__}: {error}" if spot else f"{type(error).__name__}: {error}"
    lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines()]  # without colours
    cause = next((line for line in lines if line and not line.startswith("Failed in")), type(error).__name__)
    place = next((match for line in lines if (match := re.match(r'File "([^"]+)", line (\d+)', line))), None)
    where = f"{place[1].replace(chr(92), '/').split('/')[-1]}, line {place[2]}: " if place else ""
    unknown = re.search(r"function Function\(<(?:built-in function|ufunc) '?(\w+)'?>\)", cause)
    if unknown:
        cause = f"`{unknown[1]}` takes no lanes; physics uses the functions of mc_engine.lanes"
    return f"{where}{cause}"
