"""Templates made to take all memory, all time or all depth: one sentence with the file, and the report goes on."""

import time

import pytest
from mutated_templates import BOMBS
from synthetic_run import synthetic_run

from mc_engine.errors import EngineError
from reports import build
from reports.run.flown import Flown
from reports.user_sections import sections as user_sections
from reports.user_sections.sections import run_facts, with_own_sections


@pytest.fixture(scope="module")
def run():
    return synthetic_run(200)


# further examples of depth and of memory
FURTHER = ("500 parentheses", "a wide format of another kind", "a centred word")


@pytest.mark.parametrize(
    "bomb", [pytest.param(bomb, marks=pytest.mark.slow if bomb in FURTHER else ()) for bomb in BOMBS]
)
def test_a_template_without_measure_gets_a_sentence(tmp_path, monkeypatch, run, bomb):
    monkeypatch.setattr(user_sections, "LONGEST_S", 3.0)
    text, words = BOMBS[bomb]
    (tmp_path / "own.md").write_text(text)
    facts = run_facts(Flown(run, "run"), "a title")
    begin = time.monotonic()
    with pytest.raises(EngineError, match=words) as found:
        with_own_sections(build(run, "run"), tmp_path / "own.md", facts, [facts])
    assert "\n" not in str(found.value)
    assert "own.md" in str(found.value)
    assert time.monotonic() - begin < 60.0


def test_a_template_imports_nothing_from_the_working_folder(tmp_path, monkeypatch, run):
    for name in ("jinja2", "json", "numbers", "markupsafe", "sitecustomize"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.md").write_text("# A\n\n{{ run.n_tried }}")
    facts = run_facts(Flown(run, "run"), "a title")
    made = with_own_sections(build(run, "run"), tmp_path / "own.md", facts, [facts])
    assert made.sections[0].title == "A"
    assert not (tmp_path / "ran").exists()
