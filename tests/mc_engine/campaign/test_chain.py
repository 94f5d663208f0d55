"""A chain: every case takes its inputs from the same case of another run, and keeps that case's columns."""

import json
import shutil
from dataclasses import replace
from hashlib import sha256

import numpy as np
import pandas as pd
import pytest

from mc_engine.campaign.cases import case_table
from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.reading import Findings
from mc_engine.campaign.sections import InputsSection
from mc_engine.campaign.upstream import COMPANION, link, read_rows
from mc_engine.errors import CampaignError, EngineError, StoreError
from mc_engine.runner.runner import extend, replay, rerun, resume, run
from mc_engine.store.journal import encode, scan
from mc_engine.store.opening import open_store
from mc_engine.store.verification import damage
from mc_engine.studies.opened_run import open_run
from tests.mc_engine.command_line.cart import call, fails_with

MODEL = '''
"""A throw, straight up."""
from mc_engine.lanes import physics
from mc_engine.model import (
    Event, FixedStep, Parameter, ScatterFigure, at_end, inputs, metrics, model, outputs, states,
)

Inputs = inputs(
    HEIGHT_km=Parameter(0.0, "first height"),
    speed_m_s=Parameter(10.0, "first speed", low=0.0),
    gravity_m_s2=Parameter(9.80665, "gravity"),
)
State = states(height_m="height", speed_m_s="speed")
Outputs = outputs(height_m="height")
Metrics = metrics(RESULT_m=at_end("height_m", "height of the top"), fall_s=at_end("t_s", "time to the top"))

def prepare(inputs, settings, refusals):
    refusals.add(inputs.speed < 1.5, "too slow")
    return vars(inputs)

@physics
def initial(p):
    return State(height=p.HEIGHT, speed=p.speed)

@physics
def rhs(s, p):
    return State(height=s.speed, speed=-p.gravity)

@physics
def climb(s):
    return s.speed

@physics
def observe(s):
    return Outputs(height=s.height)

MODEL = model(
    name="throw", title="A throw", source="Galilei", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(0.01, 5.0), prepare=prepare, initial=initial, rhs=rhs, events={"top": Event(climb)},
    observe=observe, figures=(ScatterFigure("fall_s", "RESULT_m", "Over the time of the fall"),),
)
'''
FIRST = """
[campaign]
model = "model.py"
design = "mc"
cases = 40
seed = 1
[dispersion.speed_m_s]
dist = "normal"
mean = 4.0
sigma = 2.0
lower = 0.0
"""
SECOND = """
[campaign]
model = "model.py"
design = "mc"
seed = 2
[inputs]
from = "{source}"
[dispersion.gravity_m_s2]
dist = "uniform"
mean = 9.8
half_range = 0.1
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two campaigns in folders of their own; the second begins at the top of the first one's throw."""
    here = tmp_path_factory.mktemp("chain")
    for name, text, height, result in (
        ("first", FIRST, "height", "top"),
        ("second", SECOND.format(source="../runs/first") + '[inputs.columns]\nheight_km = "top_m"\n', "height", "apex"),
    ):
        (here / name).mkdir()
        (here / name / "model.py").write_text(MODEL.replace("HEIGHT", height).replace("RESULT", result))
        (here / name / "campaign.toml").write_text(text)
    run(load_campaign(here / "first"), here / "runs" / "first")
    run(load_campaign(here / "second"), here / "runs" / "second")
    return here


@pytest.fixture(scope="module")
def cases(folder):
    return [pd.read_parquet(folder / "runs" / name / "cases").set_index("case_id") for name in ("first", "second")]


def test_every_case_starts_where_its_own_case_ended(cases):
    first, second = cases
    flown = second["status"] == "ok"
    assert flown.sum() == (first["status"] == "ok").sum() > 30
    np.testing.assert_array_equal(second["height_km"][flown], first["top_m"][flown] / 1000.0)
    rise = 10.0**2 / 2.0 / second["gravity_m_s2"]
    assert second["apex_m"][flown].to_numpy() == pytest.approx((first["top_m"] + rise)[flown].to_numpy(), rel=1e-9)


def test_the_rows_keep_the_columns_upstream_under_names_that_are_free(cases):
    first, second = cases
    assert list(second.columns[:2]) == ["status", "reason"]
    for name, here in (("top_m", "top_m"), ("speed_m_s", "first_speed_m_s"), ("fall_s", "first_fall_s")):
        np.testing.assert_array_equal(first[name], second[here])
    assert second["first_status"].tolist() == first["status"].tolist()


@pytest.mark.parametrize("seed", [1, 2])
def test_campaigns_with_one_seed_are_said_to_draw_alike(folder, tmp_path, seed):
    text = (folder / "second" / "campaign.toml").read_text().replace("../runs", str(folder / "runs"))
    shutil.copytree(folder / "second", tmp_path / "second")
    (tmp_path / "second" / "campaign.toml").write_text(text.replace("seed = 2", f"seed = {seed}"))
    checked = call("check", tmp_path / "second")
    flown = call("run", tmp_path / "second", "--out", tmp_path / "run")
    assert (checked.exit_code, flown.exit_code) == (0, 0)
    page = (tmp_path / "run" / "report.html").read_text()
    assert "inputs       from a run of first: cases 40, seed 1" in flown.stdout
    assert "run upstream: digest" in page
    for said, words in ((checked.stdout, "seed 1 is"), (flown.stdout, "seed         1 is"), (page, "The seed 1 is")):
        assert (f"{words} also that of first: noise in flight" in said) == (seed == 1)


def test_roles_and_nominal_case_follow_the_chain(folder):
    store = open_store(folder / "runs" / "second")
    roles = {column.name: column.role for column in store.columns}
    wanted = {"height_km": "dispersion", "first_speed_m_s": "dispersion", "top_m": "upstream", "apex_m": "metric"}
    assert {name: roles[name] for name in wanted} == wanted
    nominal = open_store(folder / "runs" / "first").nominal()
    assert store.nominal()["height_km"] == nominal["top_m"] / 1000.0
    assert store.nominal()["top_m"] == nominal["top_m"]
    assert store.manifest["upstream"]["cases"] == 40
    assert store.manifest["upstream"]["links"] == {"height_km": "top_m"}


def test_what_is_told_of_the_run_upstream_is_told_of_its_own_columns(folder):
    manifest = open_store(folder / "runs" / "second").manifest
    assert [record["name"] for record in manifest["inputs"]] == ["first_speed_m_s", "gravity_m_s2"]
    axes = [(figure["x"], figure["y"]) for figure in manifest["figures"]]
    assert axes == [("fall_s", "apex_m"), ("first_fall_s", "top_m")]  # each run has a column fall_s
    assert [record["name"] for record in manifest["parameters"]] == ["speed_m_s"]  # height_km differs between the cases


def test_the_report_counts_the_dispersed_inputs_that_it_lists(folder, tmp_path):
    shutil.copytree(folder / "runs" / "second", tmp_path / "run")
    assert call("report", tmp_path / "run", "--format", "md").exit_code == 0
    report = (tmp_path / "run" / "report.md").read_text()
    assert "(independent random draws) with 2 dispersed inputs, and one nominal case" in report
    table = report.partition("Dispersed inputs\n\n")[2].partition("\n\n")[0]
    assert len(table.splitlines()) == 2 + 2  # head and rule, then the inputs


def test_a_case_that_failed_upstream_keeps_its_row_and_says_why(folder, cases):
    first, second = cases
    failed = first["status"] != "ok"
    assert failed.sum() >= 1
    assert set(second["status"][failed]) == {"refused"}
    assert set(second["reason"][failed]) == {"its case of first ended as refused"}
    assert second["gravity_m_s2"][failed].notna().all()
    assert replay(folder / "runs" / "second", int(failed.to_numpy().argmax())).differences == ()


@pytest.mark.parametrize("kind", ["gone", "flipped"])
def test_what_was_taken_is_verified_before_it_is_used(folder, tmp_path, kind):
    shutil.copytree(folder / "runs" / "second", tmp_path / "run")
    copy = tmp_path / "run" / "upstream.parquet"
    content = bytearray(copy.read_bytes())
    content[len(content) // 2] ^= 1
    copy.unlink() if kind == "gone" else copy.write_bytes(content)
    word = "No such file" if kind == "gone" else "damaged or edited"
    assert [problem for problem in damage(tmp_path / "run") if word in problem]
    for use in (replay, lambda path, case: resume(path)):
        with pytest.raises(StoreError, match=rf"upstream.parquet: {word}"):
            use(tmp_path / "run", 3)


def test_neither_chunks_nor_the_number_of_cases_change_a_case(folder, cases, tmp_path):
    campaign = load_campaign(folder / "second", cases=17)
    with pytest.raises(CampaignError, match="there is no case 17; they are 0 to 16"):
        case_table(campaign, np.array([17]))
    some = run(campaign, tmp_path / "some", chunk=5, workers=2).cases()
    pd.testing.assert_frame_equal(some.set_index("case_id"), cases[1].iloc[:17], check_exact=True)


def test_a_campaign_that_is_not_flown_yet_is_flown_first_beside_the_run(folder, cases, tmp_path):
    text = (folder / "second" / "campaign.toml").read_text().replace("../runs/first", "../first/campaign.toml")
    chain = load_campaign("second", text=text, directory=folder / "second")
    run(chain, tmp_path / "both")
    pd.testing.assert_frame_equal(
        pd.read_parquet(tmp_path / "both" / "cases").set_index("case_id"), cases[1], check_exact=True
    )
    assert open_store(tmp_path / "both-first").n_cases == 40
    with pytest.raises(StoreError, match="takes its inputs from another run"):
        extend(tmp_path / "both", 80)
    fails_with(2, call("extend", tmp_path / "both", "--cases", 80), "takes its inputs from another run")
    shutil.rmtree(tmp_path / "both")
    other = replace(chain, first=replace(chain.first, digest="of another campaign"))
    for extended, asked in ((40, other), (41, chain)):
        if extended > 40:
            extend(tmp_path / "both-first", extended)
        with pytest.raises(StoreError, match="both-first: holds another run than this campaign takes its inputs from"):
            run(asked, tmp_path / "both")


def test_check_names_an_event_that_happens_in_no_case_of_a_chain(folder, tmp_path):
    model = (folder / "second" / "model.py").read_text()
    model = model.replace("\nMODEL", "\n@physics\ndef depth(s):\n    return s.height + 1.0\n\nMODEL")
    (tmp_path / "model.py").write_text(model.replace("Event(climb)", 'Event(climb), "cellar": Event(depth)'))
    text = (folder / "second" / "campaign.toml").read_text().replace("../runs", str(folder / "runs"))
    (tmp_path / "campaign.toml").write_text(text)
    fails_with(2, call("check", tmp_path), "1 problem", 'the event "cellar" crosses zero in none of 26 cases')


def test_check_says_that_no_case_flew_where_the_first_campaign_is_yet_to_be_flown(folder, tmp_path):
    text = (folder / "second" / "campaign.toml").read_text().replace("../runs", str(folder / "runs"))
    shutil.copy(folder / "second" / "model.py", tmp_path)
    (tmp_path / "campaign.toml").write_text(text)
    assert "no case was flown" not in call("check", tmp_path).stdout
    (tmp_path / "campaign.toml").write_text(text.replace(f"{folder}/runs/first", f"{folder}/first/campaign.toml"))
    checked = call("check", tmp_path)
    assert (checked.exit_code, checked.stdout.count("\n")) == (0, 2)
    assert 'no case was flown to check the model, as its inputs come from "first", which has' in checked.stdout
    assert "no case was flown" not in call("check", tmp_path, "--no-model").stdout


def test_numbers_from_outside_hold_also_where_the_first_campaign_is_yet_to_be_flown(folder, tmp_path):
    text = (folder / "second" / "campaign.toml").read_text().replace("../runs/first", "../first/campaign.toml")
    text = text.replace("seed = 2", "seed = 2\ncases = 40")
    store = run(load_campaign("second", text=text, directory=folder / "second", cases=6, seed=9), tmp_path / "both")
    assert (store.n_cases, store.manifest["campaign"]["seed"]) == (6, 9)


def test_what_does_not_fit_is_said_with_its_place(folder):
    text = (folder / "second" / "campaign.toml").read_text()
    grid = FIRST.replace('"mc"\ncases = 40', '"grid"').replace(
        'dist = "normal"\nmean = 4.0\nsigma = 2.0', "levels = 3\nupper = 9"
    )
    (folder / "first" / "grid.toml").write_text(grid)
    for change, message in [
        (('from = "../runs/first"', 'from = "../first/grid.toml"'), 'its design "grid" does not go with "mc"'),
        (('from = "../runs/first"', 'from = "../runs/none"'), "is neither a run nor a campaign that can be flown"),
        (('height_km = "top_m"', 'heigth_km = "top_m"'), 'is not a parameter of throw; did you mean "height_km"?'),
        (('height_km = "top_m"', 'height_km = "to_m"'), '"to_m" is no column of numbers of that run'),
        (('height_km = "top_m"', 'height_km = "fall_s"'), '"fall_s" is in s, which does not fit km'),
        (('height_km = "top_m"', ""), "no result of that run has the name of a parameter of throw"),
        (('design = "mc"', 'design = "grid"'), 'its design "mc" does not go with "grid"'),
        (('design = "mc"', 'design = "table"'), 'write design = "mc" to disperse more'),
        (("[inputs]", "[parameters]\nheight_km = 1\n[inputs]"), "comes from the run of first; leave it out here"),
        (("seed = 2", "seed = 2\ncases = 41"), "41 is not allowed; the run upstream has 40 cases"),
        (("from =", "height_km = 1\nfrom ="), 'inputs.height_km: is not a known key; known are "from"'),
    ]:
        assert change[0] in text
        with pytest.raises(CampaignError) as caught:
            load_campaign("second", text=text.replace(*change), directory=folder / "second")
        assert message in str(caught.value)
        assert "campaign.cases: is missing" not in str(caught.value)  # the run upstream has them


@pytest.mark.parametrize(
    ("nominal", "message"),
    [
        (
            {"top_m": float("nan")},
            '"height_km" takes "top_m", which is no finite number in the nominal case of that run',
        ),
        ({"status": "no-result", "reason": "not imported"}, "the nominal case of that run ended as no-result (not imp"),
    ],
)
def test_a_run_whose_nominal_case_has_no_number_is_refused(folder, nominal, message):
    rows, second, findings = read_rows(folder / "runs" / "first"), load_campaign(folder / "second"), Findings()
    section = InputsSection.model_validate({"from": "first", "columns": {"height_km": "top_m"}})
    link(replace(rows, nominal={**rows.nominal, **nominal}), section, second.model, (), findings)
    assert [message in str(problem) for problem in findings.problems] == [True]


def test_a_case_that_failed_upstream_gives_no_number_and_an_incomplete_run_is_refused(folder, tmp_path):
    path = shutil.copytree(folder / "runs" / "first", tmp_path / "first")
    rows, second, findings = read_rows(path), load_campaign(folder / "second"), Findings()
    section = InputsSection.model_validate({"from": "first", "columns": {"height_km": "top_m"}})
    status, top = (rows.table[name].copy() for name in ("status", "top_m"))
    status[7], top[7] = "no-stop", 5.0  # where it was when it was given up
    linked = link(
        replace(rows, table={**rows.table, "status": status, "top_m": top}), section, second.model, (), findings
    )
    assert np.isnan(linked.table["height_km"][7])
    open_store(path).withdraw(open_store(path).parts[0])
    with pytest.raises(StoreError, match="first: is not complete; `mc-engine resume"):
        read_rows(path)


def test_a_campaign_is_the_same_whatever_bytes_arrow_makes_of_its_upstream_run(folder, monkeypatch):
    copy = folder / "runs" / "second" / COMPANION
    rows, campaign = read_rows(copy), load_campaign(folder / "second")
    monkeypatch.setattr("mc_engine.campaign.upstream.parquet_bytes", lambda table: b"of another version of Arrow")
    assert read_rows(copy).digest == rows.digest == read_rows(folder / "runs" / "first").digest
    assert load_campaign(folder / "second").digest == campaign.digest
    for name, wrong in (("top_m", 1.0), ("status", "no-stop")):
        values = rows.table[name].copy()
        values[7] = wrong
        assert replace(rows, table={**rows.table, name: values}).digest != rows.digest
    assert replace(rows, nominal={**rows.nominal, "top_m": 1.0}).digest != rows.digest


def test_a_run_to_take_inputs_from_is_refused_where_the_campaign_takes_none(folder, tmp_path):
    asked = ("run", folder / "first", "--from", folder / "runs" / "second", "--out", tmp_path / "new")
    fails_with(2, call(*asked), "inputs: is missing; --from needs a section [inputs]")
    assert not (tmp_path / "new").exists()
    text = (folder / "second" / "campaign.toml").read_text().replace("from = ", "form = ")
    with pytest.raises(CampaignError) as caught:  # where it is there with a mistake
        load_campaign("x", text=text, directory=folder / "second", upstream=folder / "runs" / "first")
    assert "is missing; --from" not in str(caught.value)


# ---- where [inputs] may lead


def with_files(folder, **contents):
    """Change files of a run directory, for which its journal vouches afterwards."""
    events = list(scan((folder / "journal.jsonl").read_bytes()).entries)
    for name, content in contents.items():
        (folder / name.replace("_", ".")).write_bytes(content)
        events[0].facts[name.split("_")[0]] = sha256(content).hexdigest()
    events[0].facts["companions"].pop("upstream.parquet", None)
    lines = [encode(number, entry.at, entry.event, entry.facts) for number, entry in enumerate(events, start=1)]
    (folder / "journal.jsonl").write_bytes(b"".join(lines))


@pytest.fixture
def theirs(folder, tmp_path):
    """The second run of the chain, as somebody else might send it."""
    return shutil.copytree(folder / "runs" / "second", tmp_path / "run")


def trap(folder, mark):
    """A campaign elsewhere, whose model leaves a mark."""
    folder.mkdir()
    (folder / "model.py").write_text(
        f"import pathlib; pathlib.Path({str(mark)!r}).touch()\n"
        + MODEL.replace("HEIGHT", "height").replace("RESULT", "top")
    )
    (folder / "campaign.toml").write_text(FIRST)
    return folder


USES = (resume, rerun, lambda folder: replay(folder, 3), lambda folder: open_run(folder).case(3).replay(),
        lambda folder: load_campaign(folder / "campaign.toml"))  # fmt: skip


@pytest.mark.parametrize("kind", ["a run", "a campaign"])
def test_the_campaign_file_of_a_run_leads_to_no_other_run_and_no_other_campaign(theirs, folder, tmp_path, kind):
    mark = tmp_path / "marked"
    outside = folder / "runs" / "first" if kind == "a run" else trap(tmp_path / "trap", mark)
    text = (theirs / "campaign.toml").read_text().replace("../runs/first", str(outside))
    manifest = json.loads((theirs / "manifest.json").read_bytes())
    manifest["upstream"] = None
    with_files(theirs, campaign_toml=text.encode(), manifest_json=json.dumps(manifest).encode())
    (theirs / "upstream.parquet").unlink()
    for use in USES:
        with pytest.raises(EngineError, match=r"upstream\.parquet: No such file"):
            use(theirs)
    assert not mark.exists()


def test_the_campaign_file_of_a_run_is_read_with_the_copy_that_the_run_keeps(theirs):
    """From wherever it lies: the run upstream is nowhere near."""
    assert not (theirs.parent / "runs").exists()
    assert load_campaign(theirs / "campaign.toml").upstream.rows.n_cases == 40
