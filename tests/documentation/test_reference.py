"""The reference pages say all that the program can be told and can tell."""

import ast
import re

import pytest

import mc_engine
from mc_engine.campaign.search import list_campaigns
from mc_engine.campaign.sections import schema
from mc_engine.documentation import commands_page, function_pages, schema_page
from mc_engine.documentation.campaign_pages import model_reference
from mc_engine.documentation.markdown_text import escaped, prose
from mc_engine.documentation.website import reference_pages
from mc_engine.model import load_model


@pytest.fixture(scope="module")
def pages():
    return dict(reference_pages())


def test_every_key_of_a_campaign_file_is_explained():
    text = schema_page.page()
    keys = {key for part in [schema(), *schema()["$defs"].values()] for key in part.get("properties", {})}
    assert [key for key in keys if f"| `{key}` |" not in text] == []


def test_every_verb_and_option_is_explained():
    text = commands_page.page()
    for name, command in commands_page.commands().items():
        section = text.split(f"\n## {name}\n")[1].split("\n## ")[0]
        assert [
            one.opts[0] for one in command.params if one.param_type_name == "option" and one.opts[0] not in section
        ] == []
        assert all(one.help for one in command.params), name


def test_every_number_of_a_shipped_campaign_has_a_row_with_its_unit(pages):
    for campaign in list_campaigns():
        model = load_model(model_reference(campaign.path), campaign.path.parent)
        text = pages[f"campaigns/{campaign.path.parent.name}.md"]
        for one in (*model.parameters, *model.settings, *model.metrics, *model.quantities):
            assert f"| `{one.name}` | {escaped(one.unit) or '–'} |" in text


def test_every_public_name_is_on_a_page(pages):
    text = "".join(pages[f"functions/{key}.md"] for key in function_pages.SECTIONS)
    assert [name for name in mc_engine.__all__ if not re.search(rf"{{py:\w+}} {name}\b", text)] == []


def test_every_public_function_of_the_reference_has_a_docstring():
    for _, modules in function_pages.SECTIONS.values():
        for path in [path for name in modules.split() for path in function_pages.files(name)]:
            bare = [one.name for one in function_pages.definitions(path) if not ast.get_docstring(one)]
            assert bare == [], path.name


def test_prose_is_never_read_as_markup_and_columns_and_arguments_stay():
    assert escaped("x*x and `y*y`, a_b [m] <n>") == r"x\*x and `y*y`, a\_b \[m\] \<n\>"
    assert escaped("- dash") == r"\- dash"
    assert prose("One line.\n\nn : number of cases\nx : values,\n    finite") == (
        "One line.\n\n- n : number of cases\n- x : values, finite"
    )
    assert prose("Force [N].  m : [kg]\na, b : [m]") == "Force \\[N\\].  m : \\[kg\\]\n\n- a, b : \\[m\\]"
    assert "```text\nshift    of the mean\n" in prose("shift    of the mean\nspread   of the rest")


def test_the_reference_explains_every_field_of_the_records_of_shared_physics():
    """Named tuples have no docstring of their own; the meaning, units and signs are in that of the module."""
    for path in function_pages.files("physics"):
        text = path.read_text(encoding="utf-8")
        head = ast.get_docstring(ast.parse(text)) or ""
        for name, fields in re.findall(r'^([A-Z]\w+) = namedtuple\("\w+", "(.*?)"\)', text, re.MULTILINE):
            assert [word for word in (name, *fields.split()) if not re.search(rf"\b{word}\b", head)] == [], name
