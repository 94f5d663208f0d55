"""The tests of faults turn red on builds that are broken on purpose; else their green would say nothing."""

import pytest
import test_damage
import test_failing_disk
import test_killed_runs
import test_power_cuts
import test_races
import test_worker_deaths
from broken_builds import BREAKS
from stones import results, stones

from mc_engine.errors import EngineError
from mc_engine.runner import runner

RED = (AssertionError, EngineError)


@pytest.fixture
def broken(request, monkeypatch):
    """The build of the test's parameter."""
    BREAKS[request.param](monkeypatch.setattr)


@pytest.mark.parametrize("name", ["line_before_part"])
def test_kills_find_a_store_that_counts_a_part_before_it_is_there(tmp_path, name):
    with pytest.raises(RED):
        test_killed_runs.check_kills(tmp_path, kills=60, seed=1, broken=(name,))


@pytest.mark.slow
def test_deaths_of_workers_find_a_runner_that_forgets_their_chunks(tmp_path):
    with pytest.raises(RED, match="flies the rest"):  # and exit status 4
        test_worker_deaths.check_kills(tmp_path, "loky", seed=1, kills=1, cases=500, broken="dead_worker_forgotten")


@pytest.mark.slow
def test_deadly_cases_find_a_runner_that_blames_their_neighbours(tmp_path):
    with pytest.raises(RED, match=r"\[(32, 33|40, 41), .*\] == \[40\]"):  # sixteen, or eight, fly at a time
        test_worker_deaths.check_isolated(tmp_path, 100, [40], "loky", broken="suspects_given_up")


@pytest.mark.parametrize("broken", ["disk_unheard"], indirect=True)
def test_failing_calls_find_a_store_that_does_not_hear_the_disk(tmp_path, broken):
    campaign = stones(tmp_path / "campaign", test_failing_disk.CASES)
    store = runner.run(campaign, tmp_path / "whole", workers=2, chunk=test_failing_disk.CHUNK)
    flown = campaign, results(store.path), store.cases()
    with pytest.raises(RED):
        test_failing_disk.check_failures(tmp_path, flown, "write", test_failing_disk.FULL, begin=8, step=1)


@pytest.mark.parametrize("broken", ["contents_unsynced", "names_unsynced"], indirect=True)
def test_power_cuts_find_a_store_that_does_not_sync(tmp_path, broken):
    record = test_power_cuts.recorded(tmp_path)
    with pytest.raises(RED):
        test_power_cuts.check_cuts(tmp_path, record, "all lost", begin=60, step=5, resume_each=1000)


@pytest.mark.parametrize("broken", ["digests_unread"], indirect=True)
def test_flipped_bits_find_a_verification_that_reads_no_digests(tmp_path, broken):
    campaign = stones(tmp_path / "campaign", 40)
    run = runner.run(campaign, tmp_path / "run", workers=2, chunk=40).path
    with pytest.raises(RED):
        test_damage.check_all_damage_is_named(run, cuts=1, flips=60, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["unlocked"])
def test_races_find_a_store_that_lets_everybody_write(tmp_path, name):
    with pytest.raises(RED):
        test_races.check_races(tmp_path, 20, 1, f"import broken_builds\nbroken_builds.BREAKS[{name!r}](setattr)")
