"""Names, numbers and sizes that no honest campaign has, and cells that a spreadsheet would run."""

import ast
import re
import tomllib
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from processor_time import seconds

import mc_engine
from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.tables_beside import csv_text
from mc_engine.errors import CampaignError

HEAD = '[campaign]\nmodel = "campaigns.deorbit"\ncases = 10\ndesign = "mc"\nseed = 1\n'
SIZE = 249_000  # bytes, just within what is read at all
SENTENCE_S = 1.0  # of processor time; most take up to 0.4 s


def limit_s():
    """What a sentence may take; on a slow machine, six times what Python's own reader takes for the text."""
    return max(SENTENCE_S, 6.0 * seconds(lambda: tomllib.loads("x = [" + filled("-1,") + "]"), SENTENCE_S))


@pytest.fixture(scope="module", autouse=True)
def imported():
    """The model is imported once, and not on the clock."""
    load_campaign("deorbit")


def refused(text, directory=None):
    """The sentences about a campaign text, which must come soon."""
    sentences = []

    def load():
        with pytest.raises(CampaignError) as caught:
            load_campaign("x.toml", text=text, directory=directory)
        sentences.append(str(caught.value))

    duration = seconds(load, SENTENCE_S)
    assert duration < SENTENCE_S or duration < limit_s()
    assert len(sentences[0]) < 300_000
    assert all(letter.isprintable() or letter == "\n" for letter in sentences[0])
    return sentences[0]


def filled(unit):
    return unit * (SIZE // len(unit))


@pytest.mark.parametrize(
    "body",
    [
        pytest.param("x = " + filled("["), id="brackets"),
        pytest.param("x = " + filled("{a="), id="braces"),
        pytest.param(filled("a.") + "a = 1", id="dotted key"),
        pytest.param(filled('"a" . ') + "a = 1", id="dotted key in quotes"),
        pytest.param(("a." * 400 + "b = 1\n") * 300, id="dotted keys"),
        pytest.param("[" + filled("a.") + "a]", id="dotted header"),
        pytest.param("".join(f"[a{i}]\n" for i in range(25_000)), id="sections"),
        pytest.param("".join(f"[dispersion.a{i}]\n" for i in range(10_000)), id="dispersions"),
        pytest.param("[parameters]\n" + "".join(f"a{i}=1\n" for i in range(25_000)), id="parameters"),
        pytest.param(filled("[[correlation]]\n"), id="correlations"),
        pytest.param('[dispersion.ve_pct]\ndist = "discrete"\nvalues = [' + filled('"a",') + "]", id="values"),
        pytest.param("[retention.histories]\ncases = [" + filled("-1,") + "]", id="cases"),
        pytest.param("x = " + filled("9"), id="digits"),
        pytest.param("x = 0x" + filled("f"), id="hexadecimal"),
        pytest.param(filled("x") + " = 1", id="long key"),
        pytest.param('[dispersion.ve_pct]\ndist = "' + filled("x") + '"', id="long word"),
        pytest.param('[inputs]\nfrom = "' + filled("x") + '"', id="long name of a run"),
        pytest.param("seed = 2", id="key twice"),
        pytest.param("[parameters]\n[parameters]", id="section twice"),
    ],
)
def test_what_is_made_to_overwhelm_is_refused_within_a_second(body):
    assert refused(HEAD + body).startswith("x.toml: ")


@pytest.mark.parametrize(
    "number", ["1e400", "-1e400", "nan", "inf", "-inf", "9" * 400, "-" + "9" * 400, "1e300", "1" + "0" * 60]
)
@pytest.mark.parametrize(
    ("body", "place"),
    [
        ("[parameters]\nisp_s = {}", "parameters.isp_s"),
        ('[dispersion.ve_pct]\ndist = "normal"\nsigma = {}', "dispersion.ve_pct.sigma"),
        ('[dispersion.ve_pct]\ndist = "discrete"\nvalues = [1, {}]', "dispersion.ve_pct.values 2"),
        ('[dispersion.ve_pct]\ndist = "constant"\nvalue = {}', "dispersion.ve_pct.value"),
        ("[retention.histories]\nfirst = {}", "retention.histories.first"),
    ],
)
def test_absurd_numbers_are_refused_wherever_they_stand(body, place, number):
    assert refused(HEAD + body.format(number)).startswith(f"x.toml: 1 problem\n  {place}: ")


NAMES = ["../outside", "/etc/passwd", "a\\u0000b", "x" * 5000, "sub/../../outside", "link", "round", "", " ", "."]


@pytest.fixture
def folder(tmp_path):
    """A campaign's folder with a link out of it, one that goes round, and files outside."""
    for ending in (".py", ".csv"):
        (tmp_path / f"outside{ending}").write_text("raise SystemExit('this ran')\n")
    (tmp_path / "here").mkdir()
    for ending in (".py", ".csv"):
        try:
            (tmp_path / "here" / f"link{ending}").symlink_to(tmp_path / f"outside{ending}")
            (tmp_path / "here" / f"round{ending}").symlink_to(tmp_path / "here" / f"round{ending}")
        except OSError:
            pytest.skip("links need a privilege here")
    return tmp_path / "here"


@pytest.mark.parametrize("name", NAMES)
def test_no_model_outside_the_folder_of_the_campaign_runs(folder, name):
    said = refused(HEAD.replace("campaigns.deorbit", f"{name}.py"), folder)
    assert "campaign.model: " in said
    assert "this ran" not in said
    assert "ends the program" not in said


@pytest.mark.parametrize("name", NAMES)
def test_no_table_outside_the_folder_of_the_campaign_is_read(folder, name):
    table = HEAD.replace('"mc"', '"table"').replace("cases = 10\n", "") + f'table = "{name}.csv"\n'
    assert "campaign.table: " in refused(table, folder)
    assert "ve_pct.file: " in refused(HEAD + f'[dispersion.ve_pct]\ndist = "empirical"\nfile = "{name}.csv"', folder)


@pytest.mark.parametrize(
    "name", ["\\u001b[2J", "\\u202eevil", "ｖe_pct", "ve\\u200b_pct", "vе_pct", "", "a/../b", "\\u0007"]
)
def test_letters_that_deceive_the_eye_or_steer_a_terminal_do_neither(name):
    refused(HEAD + f'[dispersion."{name}"]\ndist = "normal"\nsigma = 1')


@pytest.mark.parametrize("size", [250_001, 100_000_000])
def test_a_file_of_any_size_is_refused_within_a_second(tmp_path, size, record_property):
    path = tmp_path / "campaign.toml"
    with open(path, "wb") as file:
        file.write(HEAD.encode())
        file.truncate(size)

    def load():
        with pytest.raises(CampaignError, match="is larger than 250 kB"):
            load_campaign(path)

    record_property("seconds", duration := seconds(load, SENTENCE_S))
    assert duration < SENTENCE_S


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32", "cp037", "utf-16-le"])
def test_other_encodings_are_refused_and_a_byte_order_mark_does_no_harm(tmp_path, encoding):
    path = tmp_path / "campaign.toml"
    path.write_bytes((HEAD + "# é").encode(encoding))
    with pytest.raises(CampaignError):
        load_campaign(path)
    path.write_bytes((HEAD + "# é").encode("utf-8-sig"))
    assert load_campaign(path).cases == 10


FREE = '[requirement.fuel]\nmetric = "propellant_kg"\nat_most = 2.5\n'


@pytest.mark.parametrize("text", ["\\u001b]0;x\\u0007", "\\u202eevil", "two\\nlines", "x" * 200_000])
@pytest.mark.parametrize(
    ("head", "place"),
    [
        (HEAD + "title = ", "campaign.title"),
        (HEAD + FREE + "source = ", "requirement.fuel.source"),
        (HEAD + '[dispersion.ve_pct]\ndist = "normal"\nsigma = 1\nunit = ', "dispersion.ve_pct.unit"),
    ],
)
def test_text_that_steers_a_terminal_or_fills_a_report_is_refused(head, place, text):
    assert f"{place}: " in refused(f'{head}"{text}"\n')


def test_campaigns_that_take_their_inputs_from_one_another_are_refused(tmp_path):
    text = '[campaign]\nmodel = "campaigns.reentry"\ndesign = "mc"\nseed = 1\n[inputs]\nfrom = "campaign.toml"\n'
    (tmp_path / "campaign.toml").write_text(text)
    with pytest.raises(CampaignError) as caught:
        load_campaign(tmp_path)
    assert [str(problem) for problem in caught.value.problems] == [
        "inputs.from: the campaigns take their inputs from one another, round and round (campaign.toml, ...)"
    ]


DANGERS = re.compile(r"\b(pickle|marshal|shelve|dill|cloudpickle|yaml)\b")
WORDS = re.compile(
    rf"{DANGERS.pattern}|\b(eval|exec|compile|__import__|allow_pickle)\b"
)  # without one, no syntax is read


def test_no_source_reads_pickles_or_turns_text_into_code():
    root = Path(mc_engine.__file__).resolve().parents[1]
    dangerous = []
    for path in [*root.glob("mc_engine/**/*.py"), *root.glob("reports/**/*.py"), *root.glob("campaigns/**/*.py")]:
        text = path.read_text(encoding="utf-8")
        if text.isascii() and not WORDS.search(text):
            continue
        for node in ast.walk(ast.parse(text)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            called = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
            allow_pickle = (
                isinstance(node, ast.keyword) and node.arg == "allow_pickle" and ast.unparse(node.value) != "False"
            )
            if called in ("eval", "exec", "compile", "__import__") or allow_pickle or any(map(DANGERS.search, names)):
                dangerous.append(f"{path.relative_to(root)}, line {getattr(node, 'lineno', 0)}")
    assert dangerous == []


# ---- CSV

CELLS = ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "'=1", "plain", "a=b", ""]


def test_text_cells_that_a_spreadsheet_would_run_are_guarded_and_numbers_are_not():
    frame = pd.DataFrame({"word": CELLS, "=cmd": CELLS, "number": np.linspace(-1.0, 1.0, len(CELLS))})
    assert csv_text(frame[:2]).splitlines() == ["word,'=cmd,number", "'=1+1,'=1+1,-1.0", "'+1,'+1,-0.7777777777777778"]
    for cell in pd.read_csv(StringIO(csv_text(frame)), keep_default_na=False)["word"]:
        assert not cell.startswith(("=", "+", "-", "@", "\t", "\r"))
