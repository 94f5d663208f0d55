"""Settings for all tests: which of them are deep, the same examples on every machine, and no clock on a single one.

At the end of every run, also of `pytest -q`, stands what the tests of faults have counted and measured: a test says it
with `record_property(what, number)`, and the processes of `-n` hand it on with their reports.
"""

import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

TESTS = "tests/"
FAULTS = TESTS + "faults/"

# Tests that take long and that a first change of the code seldom breaks, by how their names begin.  `pytest` leaves
# them out, as it does all tests marked `benchmark`; `pytest -m deep` runs them, and so does continuous integration.
DEEP = (
    "benchmarks/",
    "campaigns/flexible_satellite/test_flexible_modulator.py::test_cases_with_many_pulses",
    "campaigns/flexible_satellite/test_flexible_tuning.py",
    "campaigns/flexible_satellite/test_flexible_twin.py::test_every_width",
    "campaigns/geo_injection/",
    "campaigns/geo_servicing/",
    "campaigns/reentry/",
    "campaigns/test_published_values.py::test_recomputed_values_are_the_kept_ones_to_the_digits_that_are_shown[geo",
    "documentation/test_calisto.py",
    "documentation/test_examples.py",
    "documentation/test_simulator_examples.py",
    "documentation/test_site.py",
    "documentation/test_tutorial.py",
    "faults/",
    "mc_engine/command_line/test_watching.py::test_every",
    "mc_engine/flight/test_five_kinds.py",
    "mc_engine/flight/test_fmus.py",
    "mc_engine/flight/test_kernel.py",
    "mc_engine/flight/test_lost_numbers.py",
    "mc_engine/flight/test_model_contract.py",
    "mc_engine/flight/test_simulator_peers.py",
    "mc_engine/flight/test_simulator_studies.py",
    "mc_engine/lanes/test_adaptive_flight.py::test_a_history",
    "mc_engine/lanes/test_adaptive_flight.py::test_every_width",
    "mc_engine/lanes/test_adaptive_flight.py::test_neither_order",
    "mc_engine/statistics/test_change_tests.py",
    "mc_engine/statistics/test_coverage.py",
    "mc_engine/statistics/test_rare_events.py",
    "mc_engine/store/test_verification.py::test_verify_reports_every_cut",
    "mc_engine/store/test_writer_lock.py::test_two_runs_that_start",
    "mc_engine/studies/test_rare_event.py",
    "mc_engine/test_contributions.py",
    "mc_engine/test_files_beside.py",
    "mc_engine/test_interruption.py::test_a_signal_that",
    "mc_engine/test_interruption.py::test_a_signal_while",
    "mc_engine/test_lazy_imports.py::test_check_and_status",
    "mc_engine/test_shell.py::test_a_standard_error",
    "mc_engine/test_shell.py::test_streams",
    "reports/test_browser.py",
    "reports/user_sections/test_template_bounds.py",
)
# Of these, the ones that are always run: re-entry against its twins, one fault of each kind, the smallest models.
NOT_DEEP = (
    "campaigns/reentry/test_reentry_twins.py",
    "faults/test_damage.py::test_verify_names_every_file",
    "faults/test_hostile_input.py",
    "faults/test_killed_runs.py::test_a_killed_run",
    "faults/test_worker_deaths.py::test_workers_killed",
    "mc_engine/flight/test_fmus.py::test_an_fmu_of_another",
    "mc_engine/flight/test_fmus.py::test_every_kind_of_fmu_flies_the_ball[2-co",
    "mc_engine/flight/test_fmus.py::test_what_is_taken",
    "mc_engine/flight/test_model_contract.py::test_shipped_campaigns_keep_the_contract[deorbit",
    "mc_engine/flight/test_model_contract.py::test_shipped_campaigns_keep_the_contract[minimal",
    "mc_engine/statistics/test_change_tests.py::test_a_paired_share",
    "mc_engine/statistics/test_change_tests.py::test_a_spread",
    "mc_engine/statistics/test_change_tests.py::test_holm",
    "mc_engine/statistics/test_change_tests.py::test_newcombes",
    "mc_engine/statistics/test_change_tests.py::test_the_same_numbers",
    "mc_engine/test_contributions.py::test_what_cannot",
    "reports/user_sections/test_template_bounds.py::test_a_template_without_measure_gets_a_sentence[a macro",
)


@pytest.hookimpl(tryfirst=True)  # before pytest chooses among the tests by their markers
def pytest_collection_modifyitems(items):
    """Mark the deep tests."""
    for item in items:
        name = item.nodeid.removeprefix(TESTS)
        if item.get_closest_marker("benchmark") or (name.startswith(DEEP) and not name.startswith(NOT_DEEP)):
            item.add_marker("deep")


def pytest_terminal_summary(terminalreporter):
    """The table of the numbers of the tests of faults, one line a test."""
    reports = [report for outcome in ("passed", "failed") for report in terminalreporter.stats.get(outcome, ())]
    lines = [
        f"{report.nodeid.removeprefix(FAULTS)}: {', '.join(f'{name} {_shown(value)}' for name, value in said)}"
        for report in reports
        if report.nodeid.startswith(FAULTS) and report.when == "call" and (said := report.user_properties)
    ]
    if lines:
        terminalreporter.write_sep("=", "numbers of the tests of faults")
        terminalreporter.write_line("\n".join(sorted(lines)))


def _shown(value):
    """Many numbers by how many they are, and by their range."""
    if isinstance(value, list | tuple) and len(value) > 1:
        return f"{_shown(min(value))} to {_shown(max(value))} in {len(value)}"
    if isinstance(value, list | tuple):
        return _shown(value[0]) if value else "none"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
