"""A function of a shipped campaign that computes says the unit of what it gives, or the source of the equation."""

import ast
import re

from mc_engine.campaign.search import SHIPPED
from mc_engine.units import UNITS

BRACKETS = re.compile(r"\[([^\]]+)\]")
WORD = re.compile(r"[^\W\d]+|%")
SYMBOLS = {symbol for unit in UNITS for symbol in WORD.findall(unit)}
UNIT = re.compile(r"\bSI\b|\bunits?\b(?! (matrix|variance))|(in|and) shares|fraction")
# an equation, table, section, page or algorithm by its number, or the year of a work
SOURCE = re.compile(r"\(\d+(\.\d+)?[a-z]?\)|\b(eqs?\.|algorithm|[Tt]able|[Ss]ection|pp?\.) ?\(?[\dIVX]|\b(19|20)\d\d\b")
KEEPS_BOOKS = ("The memory", "The row")  # begins the docstring of one that computes no more than what is due next


def unsaid(source):
    """Names of the functions in a source that compute and say neither unit nor source, those in functions, too."""
    functions = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef)]
    return [f.name for f in functions if _computes(f) and not _says(ast.get_docstring(f) or "")]


def _says(docstring):
    units = any(_is_unit(text) for text in BRACKETS.findall(docstring))
    return docstring.startswith(KEEPS_BOOKS) or units or UNIT.search(docstring) or SOURCE.search(docstring)


def _is_unit(text):
    """Whether a text in brackets is made of symbols of units, such as "m, m/s"; a shape, such as "n, 12", is not."""
    symbols = WORD.findall(text)
    return bool(symbols) and SYMBOLS.issuperset(symbols)


def _computes(function):
    return any(
        isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div | ast.Pow) and not _is_path(node)
        for node in ast.walk(function)
    )


def _is_path(node):
    """A folder and a name in it, joined by a stroke."""
    return isinstance(node.right, ast.JoinedStr) or isinstance(getattr(node.right, "value", None), str)


def test_a_function_without_unit_and_source_is_noticed():
    body = "    return 0.5 * density * speed * speed\n"
    assert unsaid(f"@physics\ndef pressure(density, speed):\n{body}") == ["pressure"]
    assert unsaid(f'@physics\ndef pressure(density, speed):\n    """Dynamic pressure."""\n{body}') == ["pressure"]
    assert unsaid(f'@physics\ndef pressure(density, speed):\n    """Dynamic pressure [Pa]."""\n{body}') == []
    assert unsaid(f'@physics\ndef pressure(density, speed):\n    """Pressures [n, 3]."""\n{body}') == ["pressure"]
    assert unsaid(f'@physics\ndef part(density, speed):\n    """A unit matrix [6]."""\n{body}') == ["part"]
    assert (
        unsaid(f"def flow():\n    def _pressure(density, speed):\n    {body}    return _pressure\n")[-1] == "_pressure"
    )
    assert unsaid("def place(folder, name):\n    return folder / f'{name}.toml'\n") == []


def test_every_equation_of_a_campaign_has_its_unit_or_its_source():
    files = [file for file in SHIPPED.rglob("*.py") if file.parent.name != "minimal"]  # a start for one's own
    assert {str(file.relative_to(SHIPPED)): names for file in files if (names := unsaid(file.read_text()))} == {}
