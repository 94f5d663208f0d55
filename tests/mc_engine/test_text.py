"""Text of others on its way to a terminal: nothing in it steers, reorders or hides, whichever command shows it."""

import json
import os
import pty
import re
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from told import LONE, PAYLOAD, assert_harmless, told

from mc_engine import load_campaign, open_run
from mc_engine.errors import CampaignError, EngineError, Problem
from mc_engine.store.opening import open_store
from mc_engine.store.store import create_store
from mc_engine.studies.replay_files import history_figure
from mc_engine.text import clean
from tests.mc_engine.store.small_run import COLUMNS, ENVIRONMENT, MANIFEST, block

posix = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals, and names are not bytes")
REQUIREMENT = {"metric": "propellant_kg", "at_least": None, "share": 0.5, "confidence": 0.9, "at_most": 100.0}


def hostile_store(path):
    """A run of forty cases with the payload wherever a manifest and a table have text of their own."""
    campaign = {"name": PAYLOAD, "title": PAYLOAD, "model": PAYLOAD, "design": "mc", "cases": 40, "source": PAYLOAD}
    inputs = [{"name": "ve_pct", "unit": PAYLOAD, "description": PAYLOAD, "nominal": 0.0, "distribution": PAYLOAD,
               "source": PAYLOAD, "note": PAYLOAD}]  # fmt: skip
    manifest = {
        **MANIFEST,
        "campaign": campaign,
        "model": {"name": PAYLOAD, "title": PAYLOAD, "source": PAYLOAD},
        "inputs": inputs,
        "requirements": [{**REQUIREMENT, "name": PAYLOAD, "source": PAYLOAD}],
        "quantities": [{"name": "force_n", "unit": PAYLOAD, "description": PAYLOAD}],
    }
    columns = [type(one)(one.name, PAYLOAD if one.unit else "", one.role, PAYLOAD, one.kind) for one in COLUMNS]
    store = create_store(path, manifest, "", columns)
    for first in range(0, 40, 10):
        store.append(first, 10, {**block(first, 10), "reason": [PAYLOAD] * 10})
    store.note("finished", fly_s=1.0)
    return store


@pytest.fixture
def hostile(tmp_path):
    return hostile_store(tmp_path / "run").path


COMMANDS = (["status"], ["summary"], ["verify"], ["compare", "RUN"], ["export"], ["replay", "3"], ["resume"], ["rerun"],
            ["extend", "--cases", "50"], ["report", "--format", "md"], ["summary", "--metric", PAYLOAD],
            ["export", "--columns", PAYLOAD], ["check"], ["rare"], ["publish", PAYLOAD])  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS, ids=lambda words: words[0])
def test_no_command_lets_text_of_a_manifest_or_an_argument_steer_the_terminal(hostile, command):
    name, *more = (str(hostile) if word == "RUN" else word for word in command)
    _, said, complained = told(name, hostile, *more)
    assert said or complained
    assert_harmless(said + complained)


@posix
def test_folders_and_files_with_such_names_are_told_without_steering_or_a_traceback(tmp_path):
    for name in (PAYLOAD, os.fsdecode(b"run\xff\xfe")):
        folder = tmp_path / name
        for words in (["status"], ["check"], ["verify"], ["report"], ["run", "--out", folder]):
            status, said, complained = told(*words, folder)
            assert status == 2, complained
            assert_harmless(said + complained)
        hostile_store(folder)
        for words in (["status"], ["verify"], ["report", "--format", "html"]):
            _, said, complained = told(*words, folder)
            assert_harmless(said + complained)
        next(folder.glob("cases/*.parquet")).unlink()
        assert_harmless("".join(told("verify", folder)[1:]))


def test_a_campaign_file_of_hostile_text_is_answered_without_steering(tmp_path):
    (tmp_path / "model.py").write_text(f"raise ValueError({PAYLOAD!r})")
    for body in ('model = "model.py"', f"model = {json.dumps(PAYLOAD)}", 'model = "campaigns.deorbit"\nx = "\x07"'):
        (tmp_path / "campaign.toml").write_text(f'[campaign]\ntitle = {json.dumps(PAYLOAD)}\nseed = "x"\n{body}\n',
                                                encoding="utf-8")  # fmt: skip
        status, said, complained = told("check", tmp_path)
        assert status == 2
        assert_harmless(said + complained)
        with pytest.raises(CampaignError) as caught:
            load_campaign(tmp_path)
        assert_harmless(str(caught.value))


def test_errors_and_views_of_the_engine_called_from_python_are_clean_too(hostile):
    assert_harmless(str(EngineError(PAYLOAD + LONE)))
    assert_harmless(str(CampaignError("x", [Problem(PAYLOAD, PAYLOAD)])))
    run = open_run(hostile)
    for shown in (repr(run), repr(run.case(3)), run._repr_html_(), run.case(3)._repr_html_()):
        assert_harmless(shown)


@pytest.mark.parametrize("unit", [PAYLOAD, r"$\frac{$", r"$x$ \ {"])
def test_the_picture_of_a_replay_is_drawn_with_any_unit(hostile, unit):
    history = open_store(hostile).histories().reindex([0]).assign(case_id=0, t_s=0.0, force_n=1.0)
    figure = history_figure(history, [{"name": "force_n", "unit": unit, "description": ""}], "case 0")
    figure.draw_without_rendering()
    assert figure.axes[0].get_ylabel() == f"force_n [{clean(unit)}]"


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252"])
def test_what_an_encoding_lacks_is_written_as_an_escape(encoding):
    status, said, complained = told("published", encoding=encoding)
    assert (status, complained) == (0, "")
    assert re.search(r"a 11\.1 %, e 11\.8 %, \\u03c9 13\.2 %", said)


@posix
def test_a_bar_still_moves_the_cursor_and_what_others_say_beside_it_does_not(tmp_path):
    script = """if True:
        import logging, sys, warnings
        from mc_engine.text import clean_streams
        with clean_streams():
            from mc_engine.runner.progress import Progress
            with Progress() as progress:
                progress(1, 10, 0)
                print("said \\x1b[2J", file=sys.stderr)
                logging.getLogger("x").warning("logged \\x1b[2J")
                warnings.warn("warned \\x1b[2J")
            print("printed \\x1b[2J")
        """
    ours, theirs = pty.openpty()
    environment = {**ENVIRONMENT, "TERM": "xterm", "COLUMNS": "200"}
    process = subprocess.Popen([sys.executable, "-c", script], stdout=theirs, stderr=theirs, env=environment)
    os.close(theirs)
    screen = b""
    with open(ours, "rb", buffering=0) as terminal:
        while True:
            try:
                screen += terminal.read(4096)
            except OSError:  # its other end is closed
                break
    assert process.wait() == 0
    for word in (b"said", b"logged", b"warned", b"printed"):
        assert word + rb" \x1b[2J" in screen
    assert b"\x1b[2J" not in screen
    assert b"\x1b[2K" in screen


@given(st.text())
def test_clean_text_is_clean_keeps_what_can_be_seen_and_is_left_alone(text):
    found = clean(text)
    assert_harmless(found.replace("Traceback", ""))
    assert clean(found) == found
    assert found == "".join(map(clean, text))
    assert all(clean(one) == one for one in text if one.isprintable() or one in "\n\t\u00a0\u202f")
