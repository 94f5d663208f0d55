"""What the command line says to do next: where a word was a slip, where nothing is left to do, and to the shell."""

import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import cart
import pytest
from cart import CAMPAIGN, MODEL, call, fails_with, small_store

from mc_engine.campaign.search import SHIPPED
from mc_engine.command_line.next_step import after_flight, after_search, journal_lines
from mc_engine.errors import DiskError, StoreError
from mc_engine.interruption import NOTHING_BEGUN
from mc_engine.runner import runner
from mc_engine.store import store
from mc_engine.store.journal import damaged_line
from mc_engine.store.opening import open_store


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working folder with a campaign of a cart in `cart/`, which has two requirements."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart").mkdir()
    (tmp_path / "cart" / "model.py").write_text(MODEL)
    second = '[requirement.stop]\nmetric = "range_m"\nat_most = 9.0\n'
    (tmp_path / "cart" / "campaign.toml").write_text(CAMPAIGN + second)
    return tmp_path


def test_a_slip_is_answered_with_what_is_there_or_the_next_command(here):
    for name in ("b", "a"):
        small_store(here / "runs" / name)
    (here / "other").mkdir()
    (here / "other" / "case.toml").write_text("")
    for kind in ("tuning", "rare"):
        (here / f"its {kind}").mkdir()
        (here / f"its {kind}" / f"{kind}.json").write_text("{}")
    for words, said in [
        (["status", "deorbit"], "deorbit: is a campaign and no run; `mc-engine run deorbit` flies it"),
        (["status", "runs"], "runs: is no run directory; it holds 2 runs, the latest is runs/a"),
        (["status", "runs/a/manifest.json"], "runs/a/manifest.json: is a file of a run; name its directory, runs/a"),
        (["run", "cart", "--cases", "1,000"], "'1,000' is not a whole number in digits alone, such as 10000"),
        (["run", "cart", "--out", ""], "a name is empty where a folder or a file has to be named"),
        (["init", "cart/model.py"], "cart/model.py: cart/model.py is no folder that can be written to"),
        (["status", "cart"], "cart: is no run directory; `mc-engine run` makes one"),
        (["summary", "its tuning"], "its tuning: holds a tuning and no run; `mc-engine status 'its tuning'` shows"),
        (["resume", "its rare"], "its rare: holds a rare event and no run; `mc-engine status 'its rare'` shows what"),
        (["run", "runs"], "holds no campaign.toml; `mc-engine init DIR` makes a campaign in a new folder"),
        (["run", "other"], "holds no campaign.toml, but other/case.toml"),
        (["check", "cart/model.py"], "is no campaign file; name the .toml file that names this model"),
        (["run", "nowhere.toml"], "there is no such file; `mc-engine list` names the shipped campaigns"),
        (["tune", "cart"], "write [tuning.parameter.NAME] and [tuning.objective.NAME], as flexible_satellite/stage_1"),
        (["rare", "cart"], 'there are several; choose one of "reach", "stop", on the command line by `--requirement`'),
        (["replay", "runs/a", "-1"], "Invalid value for 'CASE'"),
        (["replay", "runs/a", "--case", "3"], "'--case' is no option of this command; give the number alone"),
        (["plan", "--share", "2", "--confidence", "0.9"], "--share is 2; it must be above 0 and below 1"),
    ]:
        fails_with(2, call(*words), said)


def test_what_cannot_be_asked_of_sound_folders_and_urls_is_wrong_usage_and_no_damage(here, monkeypatch):
    pytest.importorskip("fsspec")
    small_store(here / "a")
    small_store(here / "other", cases=50)
    small_store(here / "begun", fly=False)
    monkeypatch.setitem(cart.MANIFEST, "imported", {"file": "results.csv"})
    small_store(here / "imported")
    (here / "folder.html").mkdir()
    url = f"file://{here}"
    assert call("publish", "other", f"{url}/copy").exit_code == 0
    for words, said in [
        (["publish", "a", f"{url}/copy"], "holds another run; choose another place"),
        (["publish", "a", f"{url}/cart"], "holds model.py and no run; choose another place"),
        (["fetch", f"{url}/cart", "new"], "cart: holds no run"),
        (["status", f"{url}/nowhere"], "nowhere: holds no run"),
        (["fetch", f"{url}/copy", "a"], "a: is not empty; choose another folder"),
        (["merge", "whole", "a", "other"], "other: is not of the campaign of a"),
        *(
            (["merge", "whole", *runs], "cases 0 to 39 are missing; fly them with `mc-engine resume begun`")
            for runs in (["begun"], ["begun", "begun"])
        ),
        *(
            ([verb, *words], "imported: its results were imported from results.csv")
            for verb, *words in (["resume", "imported"], ["resume", "imported", "--repair"], ["replay", "imported", 3],
                                 ["extend", "imported", "--cases", 50], ["merge", "whole", "imported"])
        ),
        (["compare", "a", "other", "--report", "none/c.html"], "--report none/c.html: there is no folder none"),
        (["compare", "a", "other", "--report", "folder.html"], "--report folder.html: is a folder; name a file"),
        (["export", "a", "--out", "folder.html"], "--out folder.html: is a folder; name a file"),
        *(
            (["export", "a", "--out", name], f"--out {name}: is a file of the run a; name another")
            for name in ("a/manifest.json", "a/journal.jsonl")
        ),
        *(
            (words, f"{name}: lies in a folder of the run a; name a file elsewhere")
            for name in (next((here / "a").glob("cases/*")).relative_to(here), "a/cases/new.parquet", "a/cases/new.csv")
            for words in (["export", "a", "--out", name], ["sample", "cart", "--out", name])
        ),
    ]:  # fmt: skip
        answer = call(*words)
        fails_with(2, answer, said)
        assert not answer.stdout
    assert not (here / "whole").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such pipes")
def test_a_pipe_a_device_or_a_link_is_not_replaced_by_an_output_file(here):
    small_store(here / "a")
    os.mkfifo(here / "pipe")
    (here / "stdout").symlink_to("/proc/self/fd/1")
    for name in ("pipe", "stdout"):
        fails_with(2, call("export", "a", "--out", name), f"--out {name}: is a link, a device or a pipe, and would be")
    assert (here / "pipe").is_fifo()
    assert (here / "stdout").is_symlink()


def test_a_file_beside_a_manifest_of_something_else_is_written_again(here):
    small_store(here / "a")
    (here / "manifest.json").write_text("{}")  # of a project of another kind
    (here / "out").mkdir()
    for _ in range(2):
        assert call("export", "a", "--out", "out/ends.csv").exit_code == 0


def test_a_sample_is_not_written_over_a_table_that_the_campaign_reads(here):
    own = 'dist = "empirical"\nfile = "pushes.csv"'
    campaign = CAMPAIGN.replace('dist = "uniform"\nlower = 1.0\nupper = 3.0', own)
    (here / "cart" / "campaign.toml").write_text(campaign)
    table = here / "cart" / "pushes.csv"
    table.write_text("push_n\n1.0\n2.0\n2.5\n")
    (here / "link.csv").symlink_to(table)
    for name, said in [("cart/pushes.csv", "the campaign reads this file; name another"), ("link.csv", "is a link, ")]:
        fails_with(2, call("sample", "cart", "--out", name), f"--out {name}: {said}")
    assert table.read_text() == "push_n\n1.0\n2.0\n2.5\n"
    assert call("sample", "cart", "--out", "cart/a.csv").exit_code == 0


def test_a_run_that_is_complete_is_not_flown_again(here):
    assert call("run", "minimal", "--cases", "20", "--no-report", "--out", "flown").exit_code == 0
    before = len(open_store("flown").notes())
    answer = call("resume", "flown")
    assert answer.exit_code == 0
    assert answer.stdout.startswith("flown: is complete; `mc-engine extend flown --cases N` adds cases, ")
    assert "`mc-engine report flown` writes the reports anew" in answer.stdout
    assert len(open_store("flown").notes()) == before
    assert not (here / "flown" / "report.html").exists()


def test_a_complete_run_of_other_sources_is_not_said_to_be_extended(here):
    small_store(here / "flown").note("finished")  # its manifest does not say which sources flew it
    assert call("resume", "flown").stdout == "flown: is complete; `mc-engine report flown` writes the reports anew\n"


def test_a_run_with_a_damaged_part_is_not_said_to_be_complete(here):
    store = small_store(here / "flown")
    store.note("finished")
    part = store.path / store.parts[1].file
    content = part.read_bytes()
    part.write_bytes(content[:100] + bytes([content[100] ^ 1]) + content[101:])
    said = f"flown/{store.parts[1].file}: damaged, its SHA-256 is not the one in the journal; `mc-engine resume flown"
    fails_with(5, call("resume", "flown"), f"{said} --repair` flies bad parts again")


def test_an_extension_that_was_interrupted_before_it_began_is_not_said_to_be_there(here, monkeypatch):
    small_store(here / "flown").note("finished")
    monkeypatch.setattr(runner, "extend", lambda *_, **__: _interrupted())
    fails_with(4, call("extend", "flown", "--cases", 50), NOTHING_BEGUN)
    lines = journal_lines(here / "flown")
    open_store(here / "flown").note("extended", cases=50)
    assert "`mc-engine resume " in after_flight(here / "flown", lines=lines)


def _interrupted():
    raise KeyboardInterrupt


def test_a_complete_run_that_cannot_be_extended_is_not_said_to_be(here):
    small_store(here / "latin", design="lhs").note("finished")
    answer = call("resume", "latin").stdout
    assert answer == "latin: is complete; `mc-engine report latin` writes the reports anew\n"


def test_a_complete_shard_is_to_be_merged(here):
    flight = ("run", "minimal", "--cases", "20", "--no-report", "--shard")
    assert call(*flight, "1/2", "--out", "part").exit_code == 0
    said = call("status", "part").stdout
    assert "\nshard     1 of 2, cases 0 to 9\n" in said
    assert said.endswith("\ncomplete; `mc-engine merge RUN SHARD...` makes one run of all shards, and its reports\n")
    answer = call("resume", "part").stdout
    assert answer.startswith("part: is complete; `mc-engine merge RUN SHARD...` makes one run")
    assert "extend" not in answer


@pytest.mark.parametrize("cause", [KeyboardInterrupt(), DiskError("whole/cases: No space left on device")])
def test_a_merge_that_breaks_off_is_begun_again_and_not_flown(here, monkeypatch, cause):
    def breaks_off(*_):
        raise cause

    shards = ("1", "2")
    for number in shards:
        flight = ("run", "minimal", "--cases", "20", "--no-report", "--shard", f"{number}/2", "--out", number)
        assert call(*flight).exit_code == 0
    with monkeypatch.context() as patch:
        patch.setattr("mc_engine.runner.shards._write_part", breaks_off)
        fails_with(4, call("merge", "whole", *shards), "remove whole and run the same `mc-engine merge` again")
        assert "; remove whole and run the same `mc-engine merge` again" in call("status", "whole").output
        again = ("run", "minimal", "--out", "whole")
        fails_with(2, call(*again), "whole: holds a run that is not complete; remove whole and run the same `mc-engine")
    shutil.rmtree("whole")
    assert call("merge", "whole", *shards, "--no-report").exit_code == 0


def test_a_creation_that_the_disk_cut_short_is_begun_again_by_the_same_command(here, monkeypatch):
    durably = store.disk.write_inside

    def full(root, name, content):
        if name == store.JOURNAL:
            raise DiskError(f"{root / name}: No space left on device")
        return durably(root, name, content)

    shutil.copytree(SHIPPED / "minimal", here / "mine")
    flight = ("run", "mine", "--cases", "8", "--no-report", "--out", "flown")
    with monkeypatch.context() as patch:
        patch.setattr(store.disk, "write_inside", full)
        fails_with(4, call(*flight), "journal.jsonl: No space left on device")
    assert (here / "flown" / "model.py").exists()  # which its creation left, and only a run of this model expects
    (here / "flown" / "mine.txt").touch()
    fails_with(5, call(*flight), "flown: is not empty and holds no run")
    (here / "flown" / "mine.txt").unlink()
    assert call(*flight).exit_code == 0


def test_a_folder_that_may_not_be_read_is_named(here, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    for verb in ("verify", "status"):
        fails_with(2, call(verb, "cart"), "cart: is a folder that this user may not read")


def test_a_part_that_is_gone_is_named_with_the_verb_that_names_all_damage(here):
    small_store(here / "flown")
    part = next((here / "flown" / "cases").iterdir())
    part.unlink()
    fails_with(5, call("summary", "flown"), "`mc-engine verify flown` names all damage")
    with pytest.raises(StoreError, match=r"No such file or directory; `mc-engine verify .*flown` names all damage"):
        open_store(here / "flown").cases()


posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows' shells quote in another way")


def commands_in(text):
    """The words of all commands that a text names, as a shell takes them."""
    return [shlex.split(command)[1:] for command in re.findall("`(mc-engine [^`]*)`", text)]


@posix
@pytest.mark.parametrize("name", ["r s/1", pytest.param("deorbit", marks=pytest.mark.slow)])
def test_the_command_that_flies_a_missing_shard_can_be_given_as_it_stands(here, name):
    shutil.copytree(SHIPPED / "minimal", here / "mine")
    flight = ("run", "mine", "--cases", "30", "--no-report")
    assert call(*flight, "--shard", "1/2", "--out", name).exit_code == 0
    shutil.rmtree(here / "mine")
    refused = call("merge", "whole", name)
    [command] = commands_in(refused.stderr)
    assert command[1] == {"deorbit": "./deorbit"}.get(name, name)
    assert call(*[{"DIR": "other"}.get(word, word) for word in command]).exit_code == 0
    merged = call("merge", "whole", name, "other", "--no-report")
    assert merged.exit_code == 0, merged.output
    assert open_store("whole").n_cases == 30


@posix
@pytest.mark.parametrize("name", [pytest.param("a c", marks=pytest.mark.slow), "-dash", "it's $HOME; ls"])
def test_a_command_that_is_named_can_be_given_as_it_stands_whatever_the_folder_is_called(here, name):
    assert call("run", "minimal", "--cases", 20, "--out", f"./{name}", "--no-report").exit_code == 0
    run = Path(name)
    part = next((run / "cases").iterdir())
    part.write_bytes(part.read_bytes()[:-1])
    [repair] = commands_in(call("verify", f"./{name}").stderr)
    answer = call(*repair, "--no-report")
    assert answer.exit_code == 0, answer.output
    assert call("verify", f"./{name}").exit_code == 0
    texts = [call("resume", f"./{name}").stdout, str(damaged_line(run / "journal.jsonl", 2, "torn"))]
    texts += [after_flight(run), after_flight(run, url="s3://b/x y"), after_search(run, "manifest.json", "x")]
    commands = [command for text in texts for command in commands_in(text)]
    assert [command[0] for command in commands] == [
        "extend",
        "report",
        "resume",
        "report",
        "report",
        "publish",
        "report",
    ]
    for command in commands:
        assert f"./{name}" in command or (name in command and not name.startswith("-"))
    assert commands[5][-1] == "s3://b/x y"
