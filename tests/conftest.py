"""Settings for all tests: the same examples on every machine, and no clock on a single one.

At the end of every run, also of `pytest -q`, stands what the tests of faults have counted and measured: a test says it
with `record_property(what, number)`, and the processes of `-n` hand it on with their reports.
"""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

FAULTS = "tests/faults/"


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
