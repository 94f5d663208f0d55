"""What the compiler's pages on a model mean: the place in the model, and a sentence with the fix.

The compiler speaks of types and of its own files.  Known causes have a sentence; everything else has one as well, on
the line of the model that could not be compiled.
"""

import inspect
import linecache
import re
import sysconfig
from pathlib import Path

from mc_engine import lanes
from mc_engine.lanes import philox
from mc_engine.physics_scope import shortened

_ENGINE = Path(__file__).resolve().parent
_PYTHON = Path(sysconfig.get_path("stdlib")).resolve()
LANES = "physics uses the functions of mc_engine.lanes"
_WHERE = "write where(condition, 1.0, 0.0)"
ONE_BY_ONE = "take its fields, and compute with one number at a time"
LOOKED_UP = "numbers to look up go into `tables`, and are read with look_up(o.tables, place)"
# Words in which the compiler names a cause, and what to do about it.
_CAUSES = (
    (r"function Function\(<class '(?:bool|range)'>\)", "`if`, `and`, `or`, `not` or a loop's length on a number that "
     "differs from case to case; use where(condition, a, b)"),
    (r"function Function\(<built-in function i?pow>\)", "`**` takes a whole number that is written out; other powers "
     "are pow(x, y) of mc_engine.lanes"),
    (r"function Function\(<built-in function i?mod>\)", "`%` takes no lanes; write x - y * floor(x / y)"),
    (r"function Function\(<built-in function i?floordiv>\)", "`//` takes no lanes; write floor(x / y)"),
    (r"function Function\(<built-in function invert>\)", "`~` takes no lanes; write `not mask`"),
    (r"Untyped global name '(\w+)'.*<class 'function'>", "`{0}` is not marked; write @physics on the line above it"),
    (r"Untyped global name '(\w+)'|assigned to variable '(\w+)' in globals", "`{0}` is nothing that physics can read; "
     "it reads numbers, tuples and marked functions: put its numbers in a namedtuple, or in a class, `{0}.x`"),
    (r"Invalid use of Module\(.*?(\w+)'", "`{0}` is a class, and physics makes no objects but named tuples; make it a "
     "namedtuple"),
    (r"Unknown attribute '(\w+)' of type Module", f"`{{0}}` is nothing that physics can use there; {LANES}, and your "
     "own numbers and marked functions"),
    (r"Unknown attribute '(\w+)' of type lanes_f", f"a number has no `{{0}}`; {LANES}"),
    (r"Unknown attribute '(\w+)' of type lanes_m", f"a condition has no `{{0}}`; {LANES}"),
    (r"Unknown attribute '(\w+)' of type class\(.*?(\w+)'", "`{1}.{0}` is nothing that physics can use; write the "
     "function at the top of the file, not in the named tuple"),
    (r"Unknown attribute '(\w+)' of type (\w+)\(", "there is no `{0}` in {1} that physics can use; name its fields"),
    (r"opcode \((?:STORE|DELETE)_GLOBAL\)", "`global` in physics; what changes is kept in the state or in the memory"),
    (r"Cannot cast OptionalType|Can't unify return type", "a function of the physics gives one thing in one branch, "
     "and another or nothing in the other; let it give the same named tuple in all"),
    (r"Cannot unify .* for '([A-Za-z_]\w*)(?:\.\d+)?'", "`{0}` is one kind of thing in one branch, and another in the "
     "other; let it be a number in both"),
)  # fmt: skip
_MADE = ("an array, a list or a text is made in physics; make arrays outside of it, and keep numbers in named tuples "
         "instead")  # fmt: skip
_SIGNS = {
    "add": "+", "sub": "-", "mul": "*", "truediv": "/", "matmul": "@", "and_": "&", "or_": "|", "xor": "^", "and": "&",
    "or": "|", "lshift": "<<", "rshift": ">>", "eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">=",
    "neg": "-", "pos": "+", "getitem": "[ ]", "contains": "in", "is_": "is", "is_not": "is not", "not_": "not",
}  # fmt: skip
# What a type of the compiler is to the user, by how its name begins.
_KINDS = (
    (r"lanes_m|bool|Literal\[bool\]", "a condition"),
    (r"lanes_f|float|u?int|Literal\[int\]", "a number"),
    (r"(?:Int)?Enum", "a member of an enumeration"),
    (r"complex", "a complex number"),
    (r"unicode|Literal\[str\]", "a text"),
    (r"(?:readonly )?array|list|reflected", "an array"),
    (r"none|omitted", "nothing"),
    (r"(?:Uni)?Tuple\(", "a tuple"),
    (r"\w+\(", "a record"),
)


def is_the_users(path: Path) -> bool:
    """Whether a source is neither the engine's nor a library's."""
    path = path.resolve()
    libraries = {_ENGINE, _PYTHON} & set(path.parents) or "site-packages" in path.parts
    return not libraries and not path.name.startswith("kernel_w")


def compiler_fault(text: str) -> tuple[str, str]:
    """(place, such as "model.py, line 12", or nothing; the cause and the fix).  text : the compiler's pages."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", text)  # without colours
    places = re.finditer(r'File "([^"]+)", line (\d+)|(?:at|from) (\S[^\n]*?\.py) \((\d+)\)', text)
    known = ((match[1] or match[3], int(match[2] or match[4])) for match in places)
    file, line = next((one for one in known if is_the_users(Path(one[0].replace("\\", "/")))), ("", 0))
    spot = f"{Path(file.replace(chr(92), '/')).name}, line {line}" if file else ""
    return spot, _meaning(text, shortened(linecache.getline(file, line)) if file else "")


def _meaning(text: str, source: str) -> str:
    """source : the line of the model that could not be compiled, "" where that is not known."""
    lines = [line.strip() for line in text.splitlines()]
    cause = next((line for line in lines if line and not line.startswith(("Failed in", "- Resolution failure"))), "")
    for pattern, meaning in _CAUSES:
        if match := re.search(pattern, cause):
            return meaning.format(*[group for group in match.groups() if group] or [""])
    asked = next((match for line in lines if (match := re.match(r">>> (\w+)\((.*)\)$", line))), None)
    sign = asked and (_SIGNS.get(asked[1]) or _SIGNS.get(asked[1].removeprefix("i")))  # x += y is iadd
    if asked and sign and "built-in function" in cause:
        return _wrong_operands(sign, _types(asked[2]))
    if "NRT required" in text:
        return _MADE
    if asked and (known := getattr(lanes, asked[1], getattr(philox, asked[1], None))):
        wanted = ", ".join(inspect.signature(known).parameters)
        return f"`{asked[1]}` takes ({wanted}), by their places; here it is given {_listed(_types(asked[2]))}"
    if match := re.search(r"function Function\(<(?:built-in function|ufunc|class) '?(\w+)'?>\)", cause):
        return f"`{match[1]}` takes no lanes; {LANES}"
    what = f"`{source}`" if source else "something in the physics"
    return (f"{what} is more than kernels can run; write it with numbers, named tuples, where(), `for` over a fixed "
            "number and the functions of mc_engine.lanes")  # fmt: skip


def _wrong_operands(sign: str, kinds: list[str]) -> str:
    given = set(kinds)
    if "a complex number" in given:
        fix = "physics has no complex numbers: keep the two parts as two numbers"
    elif "a member of an enumeration" in given:
        fix = "take its number, as in Mode.FAST.value"
    elif given & {"a tuple", "a record"}:
        fix = "a place in it is a whole number that is the same in every case" if sign == "[ ]" else ONE_BY_ONE
    elif "an array" in given or sign == "[ ]":
        fix = LOOKED_UP
    elif sign == "in":
        fix = "write (x == a) | (x == b)"
    elif sign in ("&", "|", "^"):
        fix = "both sides are conditions, such as (x > 0.0) & (y > 0.0)"
    elif sign in ("==", "!="):
        fix = "a condition stands alone, or behind `not`" if given == {"a condition"} else _WHERE
    else:
        fix = _WHERE if "a condition" in given else LANES
    return f"`{sign}` is given {_listed(kinds)}; {fix}"


def _listed(kinds: list[str]) -> str:
    return " and ".join([", ".join(kinds[:-1]), kinds[-1]] if len(kinds) > 1 else kinds) or "nothing"


def _types(text: str) -> list[str]:
    """What each of some types is to the user.  text : the compiler's list of them."""
    types, depth = [""], 0
    for letter in text:
        depth += (letter in "([{<") - (letter in ")]}>")
        if letter == "," and depth == 0:
            types.append("")
        else:
            types[-1] += letter
    kinds = []
    for one in types:
        name, equals, kind = one.strip().rpartition("=")
        known = next((word for start, word in _KINDS if re.match(start, kind)), "something else")
        if kind:
            kinds.append(f"{known} by the name `{name}`" if equals else known)
    return kinds
