import csv
import errno
import os
import sys
from types import ModuleType, SimpleNamespace

import pandas as pd
import pyarrow.parquet as pq
import pytest
from cart import CAMPAIGN, MODEL, call, fails_with, small_store
from typer import Exit

import mc_engine.runner
from mc_engine import durable_file
from mc_engine.command_line.flight import judge_failures
from mc_engine.command_line.next_step import after_flight
from mc_engine.errors import ModelError, RunInterrupted, StoreError
from mc_engine.store.opening import open_store
from mc_engine.store.verification import damage
from mc_engine.studies import run_changes
from tests.mc_engine.store.small_run import MANIFEST, block


@pytest.fixture
def calls(monkeypatch):
    """The calls that reach runner and reports, which are stand-ins here; `calls.fail` is raised in flight."""
    seen = SimpleNamespace(runner=[], reports=[], fail=None, equal=True)

    def run(campaign, out=None, *, progress=None, workers=None, chunk=None, **options):
        seen.runner.append(("run", campaign.cases, campaign.seed, workers))
        if seen.fail is not None:
            raise seen.fail
        progress(40, 40, 4)
        return small_store(out)

    def resume(path, *, progress=None, workers=None, **options):
        seen.runner.append(("resume", str(path), workers))
        return open_store(path)

    def extend(path, cases, *, progress=None, workers=None, **options):
        seen.runner.append(("extend", str(path), cases))
        store = open_store(path)
        store.note("extended", cases=cases)
        return store

    def replay(path, case_id):
        history = pd.DataFrame({"case_id": [case_id] * 2, "t_s": [0.0, 1.0], "force_n": [1.0, 2.0]})
        return SimpleNamespace(
            equal=seen.equal,
            differences=["propellant_kg: 1 is not 2"],
            history=history,
            row={},
            lost="",
            tolerance=None,
        )

    def write_reports(path, formats=("html", "pdf")):
        seen.reports.append(formats)
        return [path / f"report.{kind}" for kind in formats]

    runner, reports = ModuleType("mc_engine.runner.runner"), ModuleType("reports")
    runner.run, runner.resume, runner.extend, runner.replay = run, resume, extend, replay
    reports.write_reports = write_reports
    reports.replay_picture = lambda store, case, history: b"\x89PNG"
    monkeypatch.setitem(sys.modules, "mc_engine.runner.runner", runner)
    monkeypatch.setattr(mc_engine.runner, "runner", runner, raising=False)
    monkeypatch.setitem(sys.modules, "reports", reports)
    return seen


# ---- before flying


def test_check_says_what_a_good_campaign_holds(here):
    result = call("check", "cart", "--no-model")
    assert result.exit_code == 0
    assert result.stdout == "cart: 20 cases, design mc, 1 dispersion, 0 correlations, 1 requirement; valid\n"
    assert call("check", "cart/campaign.toml", "--no-model").stdout == result.stdout


def test_check_lists_every_problem_of_a_bad_campaign_and_exits_with_2(here):
    bad = CAMPAIGN.replace('"uniform"', '"unifrom"').replace('"range_m"', '"rnage_m"')
    (here / "cart" / "campaign.toml").write_text(bad)
    fails_with(2, call("check", "cart"), "2 problems", 'did you mean "uniform"?', 'did you mean "range_m"?')


def test_a_model_that_cannot_be_imported_gets_a_sentence_with_its_line(here):
    (here / "cart" / "model.py").write_text("import math\n1 / 0\n")
    fails_with(2, call("check", "cart"), "model.py, line 2", "ZeroDivisionError")


def test_one_case_is_a_case(here):
    text = (here / "cart" / "campaign.toml").read_text()
    (here / "cart" / "campaign.toml").write_text(text.replace("cases = 20", "cases = 1"))
    for words in (("check", "cart", "--no-model"), ("sample", "cart"), ("plan", "cart")):
        assert call(*words).stdout.startswith("cart: 1 case, design mc")


def test_sample_prints_head_and_summary(here):
    result = call("sample", "cart", "--cases", 30)
    assert result.exit_code == 0
    assert "cart: 30 cases, design mc" in result.stdout
    head, summary = result.stdout.split("\n\n")[1:]
    assert [line.split()[0] for line in head.splitlines()] == ["case_id", "0", "1", "2", "3", "4"]
    assert summary.split()[:5] == ["mean", "std", "smallest", "largest", "push_n"]


def test_a_sample_in_parquet_and_one_in_csv_hold_the_same_numbers(here):
    assert call("sample", "cart", "--out", "a.parquet").exit_code == 0
    assert call("sample", "cart", "--out", "a.csv").exit_code == 0
    table = pd.read_parquet("a.parquet")
    assert len(table) == 20
    assert table["push_n"].between(1.0, 3.0).all()
    with open("a.csv", newline="") as file:
        assert [float(row["push_n"]) for row in csv.DictReader(file)] == table["push_n"].tolist()
    assert pq.read_schema("a.parquet").field("push_n").metadata[b"unit"] == b"N"


def test_plan_gives_the_classic_sample_sizes(here):
    lines = call("plan", "--share", "0.9", "--confidence", "0.9").stdout.splitlines()
    assert [line.split()[:2] for line in lines[3:5]] == [["0", "22"], ["1", "38"]]
    lines = call("plan", "--share", "0.9", "--confidence", "0.9", "--failures", "1").stdout.splitlines()
    assert [line.split()[:2] for line in lines[3:]] == [["1", "38"]]


def test_list_names_every_shipped_campaign():
    from mc_engine.campaign.search import list_campaigns

    lines = call("list").stdout.splitlines()
    named = [line.split()[0] for line in lines if not line.startswith(" ")]
    assert named == [campaign.name for campaign in list_campaigns()]


@pytest.fixture
def minimal(tmp_path, monkeypatch):
    """A shipped minimal campaign."""
    folder = tmp_path / "shipped" / "minimal"
    folder.mkdir(parents=True)
    (folder / "model.py").write_text(MODEL)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    monkeypatch.setattr("mc_engine.campaign.search.SHIPPED", folder.parent)


def test_init_makes_a_campaign_that_checks(here, minimal):
    assert call("init", "new/cart").exit_code == 0
    assert call("check", "new/cart", "--no-model").exit_code == 0


def test_init_overwrites_nothing(here, minimal):
    (here / "mine").mkdir()
    (here / "mine" / "model.py").write_text("mine")
    fails_with(2, call("init", "mine"), "mine/model.py: is there already")
    assert [path.name for path in (here / "mine").iterdir()] == ["model.py"]
    assert (here / "mine" / "model.py").read_text() == "mine"
    fails_with(2, call("init", "mine/model.py"), "model.py")


# ---- flying


def test_run_flies_into_a_folder_named_by_campaign_and_time_and_says_where(here, calls):
    result = call("run", "cart")
    assert result.exit_code == 0, result.output
    (folder,) = (here / "runs").iterdir()
    assert folder.name.startswith("cart-20")
    assert folder.name.endswith("Z")
    assert f"runs/{folder.name}\n" in result.stdout
    assert "40 of 40 cases: 36 ok, 4 no-stop" in result.stdout
    assert "fuel: pass, propellant_kg ≤ 100 kg in 36 of 40 cases (required: 50 % with 90 % confidence)" in result.stdout
    assert "zero: fail" in result.stdout
    assert f"runs/{folder.name}/report.html" in result.stdout
    assert calls.reports == [("html", "pdf")]
    assert calls.runner == [("run", 20, 7, None)]
    assert "40 of 40 cases" in result.stderr


def test_run_takes_folder_cases_seed_and_workers_from_its_options(here, calls):
    result = call("run", "cart", "--out", "a", "--cases", 5, "--seed", 0, "--workers", 1, "--no-report")
    assert result.exit_code == 0
    assert calls.runner == [("run", 5, 0, 1)]
    assert calls.reports == []
    assert len(open_store("a").cases()) == 40


def test_judging_exits_with_1_where_a_requirement_is_not_met(here, calls):
    fails_with(1, call("run", "cart", "--out", "a", "--judge"), "not every requirement is met")
    assert calls.reports == [("html", "pdf")]


def test_more_failed_cases_than_allowed_exit_with_3(here, calls, capsys):
    fails_with(3, call("run", "cart", "--out", "a", "--max-failed", 3, "--judge"), "4 cases failed; at most 3")
    assert call("run", "cart", "--out", "b", "--max-failed", 4).exit_code == 0
    for failed, said in [(1, "1 case failed; at most 0"), (2000, "2,000 cases failed; at most 0")]:
        with pytest.raises(Exit):
            judge_failures(failed, 0)
        assert said in capsys.readouterr().err


def test_what_goes_wrong_in_flight_sets_the_exit_status(here, calls):
    for error, status in [
        (RunInterrupted("stopped; `mc-engine resume a` completes it"), 4),
        (KeyboardInterrupt(), 4),
        (StoreError("a/cases: No space left on device"), 5),
        (ModelError("the model has no clock"), 2),
    ]:
        calls.fail = error
        fails_with(status, call("run", "cart", "--out", "a"), str(error))


def test_the_command_that_continues_a_published_run_keeps_its_copy_up_to_date(here, calls):
    pytest.importorskip("fsspec")
    url, calls.fail = f"file://{here}/copy", RunInterrupted("interrupted; `mc-engine resume a` flies the rest")
    fails_with(4, call("run", "cart", "--out", "a", "--publish", url), f"flies the rest; with --publish {url} it keeps")
    small_store(here / "b", fly=False)
    assert f"`mc-engine resume {here / 'b'} --workers 2 --publish {url}`" in after_flight(
        here / "b", " --workers 2", url
    )


def test_a_fault_of_the_engine_itself_is_told_apart_from_all_else(here, calls):
    calls.fail = ZeroDivisionError("a bug")
    fails_with(6, call("run", "cart", "--out", "a"), "the program failed", "ZeroDivisionError: 'a bug'")


def test_an_occupied_folder_is_refused_before_flying(here, calls):
    small_store(here / "flown")
    fails_with(2, call("run", "cart", "--out", "flown"), "--out flown: holds a run already")
    fails_with(2, call("run", "cart", "--out", "cart"), "--out cart: is not empty and holds no run")
    fails_with(2, call("run", "cart", "--out", "flown/cases/in"), "--out flown/cases/in: lies inside the run flown")
    merged = call("merge", "flown", "flown")  # the folder is an argument there, and no option
    fails_with(2, merged, "flown: holds a run already")
    assert "--out" not in merged.stderr
    (here / "link").symlink_to("nowhere")
    url = f"file://{here}/copy"
    for words in (["run", "cart", "--out"], ["run", "cart", "--watch", "--out"], ["merge"], ["fetch", url]):
        for place in ("link", "link/in"):
            last = ["flown"] if words == ["merge"] else []
            fails_with(2, call(*words, place, *last), f"{place}: ", "is a symbolic link to nowhere, which is not there")
    (here / "flown" / "in").mkdir()
    (here / "flown" / "in" / ".lock").touch()  # as a creation that was cut short leaves it
    fails_with(2, call("run", "cart", "--out", "flown/in"), "--out flown/in: lies inside the run flown")
    assert calls.runner == []


def test_resume_completes_and_reports(here, calls):
    small_store(here / "flown", fly=False)
    assert call("resume", "flown", "--workers", 2).exit_code == 0
    assert calls.runner == [("resume", "flown", 2)]
    assert calls.reports == [("html", "pdf")]


def test_extend_takes_the_new_number_of_cases(here, calls):
    small_store(here / "flown")
    result = call("extend", "flown", "--cases", 60, "--no-report")
    assert result.exit_code == 0
    assert calls.runner == [("extend", "flown", 60)]
    assert "40 of 60 cases" in result.stdout
    fails_with(
        2, call("extend", "flown", "--cases", 60), "flown: is to have 60 cases already; give a larger number in all"
    )


def test_a_run_tells_of_the_further_cases_that_its_contributions_take(here, calls):
    (here / "model.py").write_text(MODEL)
    (here / "campaign.toml").write_text(CAMPAIGN + "\n[sensitivity]\ncases = 32\n")
    assert "96 further cases are flown for the contributions of the inputs" in call("run", "campaign.toml").stderr


def test_replay_says_that_the_bits_agree_and_leaves_history_and_picture(here, calls):
    small_store(here / "flown")
    result = call("replay", "flown", 17)
    assert result.exit_code == 0, result.output
    assert "case 17: every stored number has the same bits" in result.stdout
    table = pd.read_parquet(here / "flown" / "replay" / "case-17.parquet")
    assert table["force_n"].tolist() == [1.0, 2.0]
    assert table.attrs["units"]["force_n"] == "N"
    assert (here / "flown" / "replay" / "case-17.png").read_bytes().startswith(b"\x89PNG")
    assert damage(here / "flown") == []


def test_replay_tells_its_comparison_also_where_the_history_cannot_be_written(here, calls):
    small_store(here / "flown")
    (here / "flown" / "replay").write_text("")
    result = call("replay", "flown", 17)
    assert "case 17: every stored number has the same bits" in result.stdout
    fails_with(5, result, "case 17 was compared; its history and picture were not written: flown/replay: is no folder")


def test_where_nothing_can_be_written_a_difference_is_told_and_a_file_is_refused_before_the_work(
    here, calls, monkeypatch
):
    small_store(here / "flown")
    calls.equal = False
    with monkeypatch.context() as patch:
        patch.setattr(durable_file.os, "mkdir", lambda *_, **__: _no_permission())
        fails_with(5, call("replay", "flown", 17), "were not written: flown/replay", "case 17 is not the one in flown")
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)
    for words in (["export", "flown"], ["sample", "cart"]):
        fails_with(2, call(*words, "--out", "a.csv"), "--out a.csv: this user may not write to the folder .")


def _no_permission():
    raise PermissionError(errno.EACCES, "Permission denied")


def test_replay_of_a_case_with_other_bits_names_them_and_exits_with_5(here, calls):
    small_store(here / "flown")
    calls.equal = False
    fails_with(5, call("replay", "flown", 17), "propellant_kg: 1 is not 2", "case 17 is not the one in flown")


def test_replay_of_a_case_with_other_bits_names_the_machine_if_it_is_another(here, calls, monkeypatch):
    calls.equal = False
    monkeypatch.setitem(MANIFEST, "provenance", {"cpu": "znver3", "packages": {"numpy": "2.0.0"}})
    small_store(here / "flown")
    now = {"cpu": "znver4", "python": "3.13.0", "packages": {"numpy": "2.0.0", "pyerfa": "2.0.1.5"}}
    monkeypatch.setattr(run_changes, "environment", lambda: now)
    fails_with(
        5, call("replay", "flown", 17), "the run was changed, or it is of another machine (cpu: znver3 -> znver4)"
    )
    monkeypatch.setattr(run_changes, "environment", lambda: {**now, "cpu": "znver3"})
    fails_with(5, call("replay", "flown", 17), "or its results depend on more than its inputs")


# ---- after flying


def test_report_writes_the_formats_asked_for(here, calls):
    small_store(here / "flown")
    assert call("report", "flown").stdout.split() == ["flown/report.html", "flown/report.pdf"]
    assert call("report", "flown", "--format", "pdf").stdout.split() == ["flown/report.pdf"]
    several = call("report", "flown", "--format", "md", "--format", "json").stdout.split()
    assert several == ["flown/report.md", "flown/report.json"]
    assert calls.reports == [("html", "pdf"), ("pdf",), ("md", "json")]
    fails_with(2, call("report", "flown", "--format", "docx"), '"docx" is not known; html, pdf, md')
    fails_with(2, call("report", "flown", "--format", "md", "--format", "docx"), '"docx" is not known')
    fails_with(2, call("report", "flown", "--template", "none.md"), "--template none.md: there is no such file")


def test_status_says_how_far_a_run_is(here):
    store = small_store(here / "flown", cases=60)
    text = call("status", "flown").stdout
    assert "40 of 60 cases: 36 ok, 4 no-stop" in text
    assert "missing   40 to 59; `mc-engine resume flown` flies them" in text
    store.append(40, 20, block(40, 20))
    assert "complete" in call("status", "flown").stdout
    lost = sorted((here / "flown" / "cases").iterdir())[0]
    lost.unlink()
    fails_with(5, call("status", "flown"), f"flown/cases/{lost.name}: is gone; `mc-engine verify flown`")


def test_verify_names_each_damaged_file_and_exits_with_5(here):
    store = small_store(here / "flown")
    assert call("verify", "flown").stdout == "flown: every byte is as it was written\n"
    files = sorted((here / "flown" / "cases").iterdir())
    for path in files[:2]:
        path.write_bytes(path.read_bytes()[:-3])
    fails_with(5, call("verify", "flown"), files[0].name, files[1].name, "flown: 2 problems")
    (store.path / "journal.jsonl").write_bytes(b"?\n?\n")
    fails_with(5, call("verify", "flown"), "flown/journal.jsonl: its first line, the creation, is lost")


def test_summary_tells_the_metrics_asked_for_and_refuses_others(here):
    small_store(here / "flown")
    text = call("summary", "flown", "--metric", "propellant_kg").stdout
    assert text.startswith("propellant_kg [kg]: 36 of 40 cases have a number\n  mean ")
    assert text.endswith("each holding with 90 % for independent cases\n")
    small_store(here / "part", cases=60)  # whose number of cases is not the one fixed in advance
    assert call("summary", "part").stdout.endswith("fixed in advance; here they hold somewhat less often\n")
    fails_with(
        2, call("summary", "flown", "--metric", "fuel"), '"fuel" is no metric of this run; it has', "propellant_kg"
    )


@pytest.mark.parametrize("verb", ["status", "report", "resume", "verify"])
def test_a_damaged_journal_exits_with_5_and_the_line(here, calls, verb):
    small_store(here / "flown")
    journal = here / "flown" / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().replace(b'"rows":10', b'"rows":11', 1))
    fails_with(5, call(verb, "flown"), "journal.jsonl, line 2: damaged")


@pytest.mark.parametrize(
    "verb", [["status"], ["report"], ["resume"], ["verify"], ["summary"], ["extend", "--cases", 9], ["replay"]]
)
@pytest.mark.parametrize("folder", ["cart", "nowhere", "cart/model.py"])
def test_a_path_that_is_no_run_is_a_usage_error_that_names_it(here, calls, verb, folder):
    case = [0] if verb == ["replay"] else []
    fails_with(2, call(*verb, folder, *case), folder)
    assert calls.runner == []


def test_the_list_of_commands_says_what_each_does_in_80_columns():
    listed = call("--help").stdout.split("Commands:")[1]
    assert "  replay " in listed
    assert "..." not in listed
