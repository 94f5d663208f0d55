"""Physics of a shipped campaign that computes says the unit of what it gives, or the source of the equation."""

import ast
import re

from mc_engine.campaign.search import SHIPPED

UNIT = re.compile(r"\[[^\]]+\]|\bSI\b|\bunits?\b|(in|and) shares|fraction")
# an equation, table, section, page or algorithm by its number, or the year of a work
SOURCE = re.compile(r"\(\d+(\.\d+)?[a-z]?\)|\b(eqs?\.|algorithm|[Tt]able|[Ss]ection|pp?\.) ?\(?[\dIVX]|\b(19|20)\d\d\b")
KEEPS_BOOKS = ("The memory", "The row")  # begins the docstring of one that computes no more than what is due next


def unsaid(source):
    """Names of the functions of physics in a source that compute and say neither unit nor source."""
    functions = [node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    return [
        function.name
        for function in functions
        if not function.name.startswith("_") and _is_physics(function) and _computes(function)
        if not _says(ast.get_docstring(function) or "")
    ]


def _says(docstring):
    return docstring.startswith(KEEPS_BOOKS) or UNIT.search(docstring) or SOURCE.search(docstring)


def _is_physics(function):
    return any(isinstance(mark, ast.Name) and mark.id == "physics" for mark in function.decorator_list)


def _computes(function):
    operators = (node.op for node in ast.walk(function) if isinstance(node, ast.BinOp))
    return any(isinstance(operator, ast.Mult | ast.Div | ast.Pow) for operator in operators)


def test_a_function_without_unit_and_source_is_noticed():
    body = "    return 0.5 * density * speed * speed\n"
    assert unsaid(f"@physics\ndef pressure(density, speed):\n{body}") == ["pressure"]
    assert unsaid(f'@physics\ndef pressure(density, speed):\n    """Dynamic pressure."""\n{body}') == ["pressure"]
    assert unsaid(f'@physics\ndef pressure(density, speed):\n    """Dynamic pressure [Pa]."""\n{body}') == []


def test_every_equation_of_a_campaign_has_its_unit_or_its_source():
    files = [file for file in SHIPPED.rglob("*.py") if file.parent.name != "minimal"]  # a start for one's own
    assert {str(file.relative_to(SHIPPED)): names for file in files if (names := unsaid(file.read_text()))} == {}
