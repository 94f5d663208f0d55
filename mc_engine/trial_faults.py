"""What an error of interpreted physics means, in a sentence with its place and the fix.

The numbers of a trial are arrays of cases, so that Python and NumPy complain in words of arrays, of which the user has
written none.  The sentence is found from what stands at the very place of the error, and from the words where that is
not enough.
"""

import ast
import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from types import CodeType, TracebackType
from typing import Any

import numpy as np

from mc_engine import lanes
from mc_engine.compiler_faults import LANES, LOOKED_UP, ONE_BY_ONE
from mc_engine.errors import ModelError
from mc_engine.lanes.number import Place
from mc_engine.model_faults import place_in_model, spot_in_model
from mc_engine.physics_scope import shortened
from mc_engine.syntax_tree import tree_of_file

_ENGINE = Path(__file__).resolve().parent
_DIFFERS = "a number that differs from case to case"
_BRANCH = f"`if`, `and`, `or` or `not` on {_DIFFERS}; use where(condition, a, b)"
_LOOP = f"a loop over {_DIFFERS}; loop over a fixed number, with where() inside"
_ONE_NUMBER = f"a function of `math`, or int() or float(), on {_DIFFERS}; take it from mc_engine.lanes"
# Python's own functions that take one number, and those of physics in their place.
_OWN = {"max": "maximum", "min": "minimum", "round": "rint"}

_ARRAY = r"'numpy\.ndarray'( object)?"

Chain = list[ast.AST]  # what stands at the place of an error, and what it stands in, from the inside out


def fault_sentence(name: str, error: Exception) -> str:
    """The error of the model's own code, at the line of the model that it comes from.  name : of the function tried."""
    return f"{place_in_model(error) or 'the model'}: `{name}`: {' '.join(_cause(error).split())}"


def shape_of(result: Any) -> str:
    """A record as "State(x, y)", anything else by its type."""
    fields = getattr(result, "_fields", None)
    return type(result).__name__ if fields is None else f"{type(result).__name__}({', '.join(fields)})"


def _cause(error: Exception) -> str:
    spot, text = spot_in_model(error), str(error)
    chain = chain_at(spot) if spot is not None else []
    node = chain[0] if chain else None
    if isinstance(error, ModelError):
        return _with_its_argument(text, node)
    if "truth value of an array" in text:
        return _on_many(chain)
    if isinstance(node, ast.Subscript) and isinstance(error, IndexError | TypeError) and "out of " not in text:
        return f"`{_text(node)}` has its place from {_DIFFERS}; {LOOKED_UP}"
    if "only integer scalar arrays" in text or "cannot be interpreted as an integer" in text:
        return _LOOP
    if "__round__" in text:
        return _instead("round", chain)
    if "only length-1 arrays" in text or "only 0-dimensional arrays" in text or "must be real number, not" in text:
        return _ONE_NUMBER
    return _of_names(error, text) or _of_operands(error, node) or _of_the_engine(spot, node) or _in_words(error, text)


def _on_many(chain: Chain) -> str:
    """On a truth value that was asked of many cases at once."""
    for node in chain:
        if isinstance(node, ast.Call) and _text(node.func) in _OWN:
            return _instead(_text(node.func), chain)
        if isinstance(node, ast.Assert):
            return (f"`{_text(node)}` on {_DIFFERS}; a case that is not to be flown is refused in `prepare`, with "
                    "refusals.add(condition, why)")  # fmt: skip
        if isinstance(node, ast.Compare) and any(isinstance(one, ast.In | ast.NotIn) for one in node.ops):
            return f"`{_text(node)}` on {_DIFFERS}; write (x == a) | (x == b)"
        if isinstance(node, ast.stmt):
            break
    return _BRANCH


def _instead(name: str, chain: Chain) -> str:
    call = next((_text(node) for node in chain if isinstance(node, ast.Call)), f"{name}()")
    arguments = "x" if name == "round" else "a, b"
    return f"`{call}`: `{name}` on {_DIFFERS}; use {_OWN[name]}({arguments}) of mc_engine.lanes"


def _with_its_argument(text: str, node: ast.AST | None) -> str:
    """The engine's own sentence on a call; what the user has written there stands in its example."""
    if isinstance(node, ast.Call) and node.args and _text(node.func).split(".")[-1] in ("where", "any_lane"):
        first = _text(node.args[0])
        return text.replace("x > 0.5", f"{first} > 0.5") if re.fullmatch(r"[\w.]+", first) else text
    return text


def _of_names(error: Exception, text: str) -> str:
    """On a name, a field or an attribute that is not there, or that cannot be read; "" for other errors."""
    if isinstance(error, UnboundLocalError):
        name = text.split("'")[1] if text.count("'") == 2 else "a name"
        return f'"{name}" is set in one branch only; set it always, with where(condition, a, b)'
    if isinstance(error, NameError):
        ours = error.name in lanes.__all__
        return f'"{error.name}" is not defined; {"import it from mc_engine.lanes" if ours else "define or import it"}'
    if isinstance(error, AttributeError) and error.obj is not None and hasattr(error.obj, "_fields"):
        return f'there is no "{error.name}" in {shape_of(error.obj)}'
    made = re.match(r"(?:\w+\.)*(\w+)\.__new__\(\) missing \d+ required positional arguments?: (.*)", text)
    return f"{made[1]} is made without {made[2]}; give every field" if made else ""


def _of_operands(error: Exception, node: ast.AST | None) -> str:
    """On an operator between things that it does not take; "" for other errors."""
    if not isinstance(node, ast.BinOp | ast.AugAssign | ast.UnaryOp) or not isinstance(error, TypeError | ValueError):
        return ""
    if isinstance(node.op, ast.BitAnd | ast.BitOr | ast.BitXor):
        fix = "both sides are conditions, such as (x > 0.0) & (y > 0.0)"
    elif isinstance(node.op, ast.MatMult):
        fix = "write the products and their sum out"
    elif isinstance(node.op, ast.Invert):
        fix = "it takes a condition"
    else:
        fix = f"physics computes with numbers; of a tuple, {ONE_BY_ONE}"
    return f"`{_text(node)}` cannot be computed; {fix}"


def _of_the_engine(spot: TracebackType | None, node: ast.AST | None) -> str:
    """On an error inside a function of mc_engine.lanes, which was given other things than it takes; "" for others."""
    inner = spot.tb_next if spot is not None else None
    if inner is None or not isinstance(node, ast.Call):
        return ""
    codes = list(_codes(inner))
    called = next((code for code in codes if code.co_name == _text(node.func).split(".")[-1]), None)
    if called is None or _ENGINE not in Path(codes[-1].co_filename).resolve().parents:
        return ""
    wanted = list(islice(called.co_varnames, called.co_argcount))
    takes = f"`{_text(node)}`: `{called.co_name}` takes ({', '.join(wanted)})"
    if "draws" in wanted:
        return f"{takes}; `draws` is an argument of `control`, and noise is drawn there alone"
    return f"{takes}, each one number or condition"


def _codes(spot: TracebackType | None) -> Iterator[CodeType]:
    while spot is not None:
        yield spot.tb_frame.f_code
        spot = spot.tb_next


def _in_words(error: Exception, text: str) -> str:
    """Python's own words, of a number where Python has its array."""
    if isinstance(error, AttributeError) and isinstance(error.obj, np.ndarray | np.generic | float):
        return f"a number has no `{error.name}`; {LANES}"
    return f"{type(error).__name__}: {re.sub(_ARRAY, 'a number', text)}"


def _text(node: ast.AST) -> str:
    return shortened(ast.unparse(node))


def chain_at(spot: TracebackType | Place) -> Chain:
    """The smallest piece of source at the place of an error, and all that it stands in; nothing without the source."""
    code = spot.tb_frame.f_code
    place = next(islice(code.co_positions(), spot.tb_lasti // 2, None), None)
    if place is None or None in place:
        return []
    first, last, left, right = place
    try:
        tree = tree_of_file(code.co_filename)
    except (SyntaxError, ValueError):
        return []
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.expr | ast.stmt))
    around: Chain = [
        node
        for node in nodes
        if (node.lineno, node.col_offset) <= (first, left) and (node.end_lineno, node.end_col_offset) >= (last, right)
    ]
    return around[::-1]  # `walk` goes from the outside in
