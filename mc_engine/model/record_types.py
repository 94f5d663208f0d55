"""Type checks of a model's records, such as a Field, a figure or the clock, against their declarations."""

from collections.abc import Callable
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from mc_engine.errors import ModelError

_WORDS = {str: "a text", bool: "True or False", float: "a number", int: "a number", NoneType: "None"}


def refuse_other_types(record: Any, what: str) -> None:
    """ModelError if a field of `record`, a dataclass, is of another type than its class declares.

    what : the beginning of the sentence, such as 'event "apogee"'.
    """
    for name, kind in get_type_hints(type(record)).items():
        value = getattr(record, name)
        if not _is_of(value, kind):
            raise ModelError(f"{what} has {value!r} as its `{name}`; it must be {_words(kind)}")


def _is_of(value: Any, kind: Any) -> bool:
    """Whether a value is of a declared type; numbers are neither truth values nor NaN."""
    parts = get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        return any(_is_of(value, part) for part in parts)
    if get_origin(kind) is tuple:
        parts = parts[:1] * len(value) if isinstance(value, tuple) and parts[-1] is Ellipsis else parts
        return isinstance(value, tuple) and len(value) == len(parts) and all(map(_is_of, value, parts))
    if get_origin(kind) is Callable:
        return callable(value)
    if kind in (float, int):
        return isinstance(value, int | float | np.number) and not isinstance(value, bool) and bool(value == value)
    return kind is Any or isinstance(value, get_origin(kind) or kind)


def _words(kind: Any) -> str:
    parts = get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(dict.fromkeys(map(_words, parts)))
    if get_origin(kind) is tuple and parts[-1] is Ellipsis:
        return f"a tuple, each item {_words(parts[0])}; one alone needs its comma, (...,)"
    if get_origin(kind) is tuple:
        return f"a tuple of {' and '.join(map(_words, parts))}"
    return _WORDS.get(kind, str(getattr(kind, "__name__", "a function")))
