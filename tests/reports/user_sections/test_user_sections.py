"""Sections of the user's own: what a template may say, and the sentence for each way it can be wrong."""

import re

import pytest
from payloads import ONE_BY_ONE
from synthetic_run import synthetic_run

from mc_engine.errors import EngineError
from reports import build, render_html, render_pdf
from reports.document.blocks import FigureBlock, Table, Text, blocks_of
from reports.formats.markdown import render_markdown
from reports.run.flown import Flown
from reports.text.numbers import number
from reports.user_sections import sections
from reports.user_sections.sections import run_facts, with_own_sections

EXAMPLE = re.search(r"(?ms)^    # Propellant.*?^    \{\{ figure\(.*?$", sections.__doc__)[0].replace("\n    ", "\n")


@pytest.fixture(scope="module")
def run():
    return synthetic_run(3000)


@pytest.fixture(scope="module")
def document(run):
    return build(run, "run")


@pytest.fixture
def filled(tmp_path, document, run):
    """The document with the sections of a template text."""

    def fill(text, of=document, facts=None, beside=()):
        file = tmp_path / "own.md"
        file.write_text(text, encoding="utf-8")
        facts = facts or run_facts(Flown(run, "run"), "a title")
        return with_own_sections(of, file, facts, [*beside, facts])

    return fill


def own(document):
    return [block for section in document.sections if section.anchor.startswith("own-") for block in section.blocks]


def test_the_example_of_the_documentation_works_in_all_formats(filled, document):
    made = filled(EXAMPLE.strip())
    assert made.sections[0].title == "Propellant budget"
    text, table, figure = own(made)
    assert text.paragraphs[0].startswith(
        "Of 3\u202f000 cases, 2\u202f988 stay inside the tank; 99.865 % of them need 2."
    )
    assert table.caption == "Verification matrix"
    assert isinstance(figure, FigureBlock)
    for kind in (Table, FigureBlock):
        numbers = [block.number for block in blocks_of(made, kind)]
        assert numbers == list(range(1, len(numbers) + 1))
    assert made.sections[1:][0].title == document.sections[0].title
    assert "Propellant budget" in render_html(made).decode()
    assert "## 1 Propellant budget" in render_markdown(made).decode()
    assert render_pdf(made).startswith(b"%PDF")


def test_headings_lists_tables_and_code_become_blocks(filled, run):
    text = """# One

## Inside

- first *point*
- second, see [there](https://example.invalid)

Table: Loops
| Run | Largest |
|---|---:|
{% for one in runs %}| {{ one.name }} | {{ one.metrics.peak_force_n.quantile(0.5).value }} |
{% endfor %}

```
mc-engine run
```

# Two

<b>not bold</b>
"""
    other = run_facts(Flown(synthetic_run(100, seed=2), "other"), "another title")
    made = filled(text.replace("Table: Loops\n", "Table: Loops\n\n"), beside=[other])
    assert [section.title for section in made.sections[:2]] == ["One", "Two"]
    heading, points, table, code, plain = own(made)
    assert (heading.kind, heading.paragraphs) == ("heading", ("Inside",))
    assert points.paragraphs == ("first point", "second, see there (https://example.invalid)")
    assert (table.caption, [column.kind for column in table.columns]) == ("Loops", ["text", "number"])
    assert [row[0].text for row in table.rows] == ["other", "run"]  # each run of the command once, in its order
    medians = [one.summary("peak_force_n", 0.5).at(0.5).value for one in (other, run_facts(Flown(run, "run"), ""))]
    assert [row[1].text for row in table.rows] == [number(median) for median in medians]
    assert (code.kind, code.paragraphs) == ("code", ("mc-engine run",))
    assert plain.paragraphs == ("<b>not bold</b>",)


@pytest.mark.parametrize("payload", ONE_BY_ONE)
def test_values_of_a_run_are_neither_markdown_nor_templates(filled, run, payload):
    facts = run_facts(Flown(run, "run"), payload)
    (text,) = own(filled("# T\n\nA {{ run.title }} B", facts=facts))
    assert isinstance(text, Text)
    assert re.sub(r"\s", "", text.paragraphs[0]) == re.sub(r"\s", "", f"A{payload}B")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("# A\n\n{{ run.metrics.fuel_kg.mean }}", r"own\.md, line 3: .*no attribute 'fuel_kg'"),
        ("# A\n\n{{ table('requirments') }}", r"own\.md, line 3: there is no table “requirments”; this report has req"),
        ("# A\n\n{{ figure('nothing') }}", r"own\.md, line 3: there is no figure “nothing”; this report has req"),
        ("# A\n{% if %}", r"own\.md, line 2: Expected an expression"),
        ("# A\n\n{{ run.metrics.propellant_kg.quantile(99.865) }}", r"line 3: quantile\(99\.865\): a probability lies"),
        ("# A\n{{ run.__class__.__mro__ }}", r"own\.md, line 2: access to attribute '__class__' .* is unsafe"),
        ("# A\n{{ run.metrics.propellant_kg._values }}", r"line 2: .* has no attribute '_values'"),
        ("# A\n{% include '/etc/passwd' %}", r"own\.md, line 2: "),
        ("# A\n{{ 1 / 0 }}", r"own\.md, line 2: division by zero"),
        ("text\n\n# A", r"own\.md: line 1: text stands before the first heading"),
    ],
)  # fmt: skip
def test_a_wrong_template_gets_one_sentence_with_its_line(filled, text, said):
    with pytest.raises(EngineError, match=said) as found:
        filled(text)
    assert "\n" not in str(found.value)


def test_a_template_that_is_not_text_gets_a_sentence(tmp_path, document, run):
    (tmp_path / "own.md").write_bytes(b"\xff\xfe\x00")
    facts = run_facts(Flown(run, "run"), "t")
    with pytest.raises(EngineError, match="is not UTF-8 text"):
        with_own_sections(document, tmp_path / "own.md", facts, [facts])


@pytest.mark.parametrize("n", [0, 1, 2])
def test_hardly_any_cases_leave_dashes(filled, n):
    few = synthetic_run(n, failed=0)
    made = filled(
        "# T\n\n{{ run.metrics.propellant_kg.quantile(0.5).upper }}",
        build(few, "run"),
        run_facts(Flown(few, "run"), "t"),
    )
    assert own(made)[0].paragraphs == ("–",)
