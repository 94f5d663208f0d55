"""Which commands run code of a campaign or run, and which never do; and where a campaign file may lead."""

import json
import re
import subprocess
import sys

import pytest
from cart import call

from mc_engine.command_line import commands as cli
from mc_engine.documentation.commands_page import commands
from mc_engine.documentation.website import HOME
from tests.mc_engine.store.small_run import ENVIRONMENT, created, filled

MARK = "import pathlib; pathlib.Path({!r}).touch()\n"
NEVER = {
    "init": ["new"],
    "list": [],
    "schema": [],
    "units": [],
    "report": ["RUN", "--format", "html"],
    "status": ["RUN"],
    "summary": ["RUN"],
    "verify": ["RUN"],
    "compare": ["RUN", "RUN"],
    "export": ["RUN"],
    "publish": ["RUN", "URL"],
    "fetch": ["URL", "back"],
}
IN_ONE_PROCESS = """
import json, os, sys
from pathlib import Path
from typer.testing import CliRunner
from mc_engine.command_line.commands import app
answers = {}
for words in json.loads(sys.argv[1]):
    done = CliRunner().invoke(app, words)
    answers[words[0]] = [done.exit_code, done.output]
here = os.getcwd()
inside = [name for name, one in sys.modules.items() if (getattr(one, "__file__", None) or "").startswith(here)]
print(json.dumps([answers, inside]))
"""


def test_every_command_says_in_its_help_whether_it_runs_code():
    assert not cli.RUNS_CODE & cli.RUNS_NO_CODE
    assert set(commands()) == cli.RUNS_CODE | cli.RUNS_NO_CODE
    for name in commands():
        text = " ".join(call(name, "--help").stdout.split())
        assert ("Runs code: the model of the campaign or run" in text) == (name in cli.RUNS_CODE), name
        assert ("Runs no code of a campaign or run" in text) == (name in cli.RUNS_NO_CODE), name


def test_the_page_on_trust_has_every_command_in_the_same_class():
    text = (HOME / "explanation" / "trust.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| (run [\w ]+) \| (.*) \|$", text, re.MULTILINE))
    listed = {what: set(re.findall(r"`(\w+)`", names)) for what, names in rows.items()}
    assert listed == {
        "run the model of a campaign or run": cli.RUNS_CODE,
        "run no code of a campaign or run": cli.RUNS_NO_CODE,
    }


@pytest.fixture
def theirs(tmp_path):
    """A run of somebody else, all of whose files leave a mark when they run."""
    store = filled(created(tmp_path / "run"))
    store.note("finished", fly_s=1.0)
    for name in (
        "μ",
        "model",
        "json",
        "psutil",
        "numpy",
        "sitecustomize",
        "reports",
        "conftest",
        "typing",
        "unicodedata",
    ):
        (store.path / f"{name}.py").write_text(MARK.format(str(tmp_path / "marked")))
    return store.path


def test_commands_that_run_no_code_import_nothing_of_a_run_even_from_within_it(theirs, tmp_path):
    assert set(NEVER) == cli.RUNS_NO_CODE
    pytest.importorskip("fsspec")
    url = f"file://{tmp_path / 'away'}"
    lines = [[name, *(word.replace("RUN", ".").replace("URL", url) for word in words)] for name, words in NEVER.items()]
    script = tmp_path / "script.py"
    script.write_text(IN_ONE_PROCESS)
    done = subprocess.run(
        [sys.executable, str(script), json.dumps(lines)], cwd=theirs, capture_output=True, text=True, env=ENVIRONMENT
    )
    assert done.returncode == 0, done.stderr
    answers, inside = json.loads(done.stdout)
    wrong = {name: output for name, (status, output) in answers.items() if status and name not in ("verify", "fetch")}
    assert (wrong, inside) == ({}, [])
    assert not (tmp_path / "marked").exists()
