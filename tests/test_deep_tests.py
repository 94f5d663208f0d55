"""The table of deep tests in conftest.py names tests that there are."""

from pathlib import Path

from tests.conftest import DEEP, DEEP_PARAMETERS, NOT_DEEP

HERE = Path(__file__).parent


def test_every_line_of_the_table_begins_the_name_of_a_test():
    for entry in (*DEEP, *NOT_DEEP):
        path, _, name = entry.partition("::")
        assert (HERE / path).exists(), entry
        assert not name or f"\ndef {name.partition('[')[0]}" in (HERE / path).read_text(encoding="utf-8"), entry


def test_every_parameter_of_deep_tests_is_that_of_a_test():
    paths = [path for path in HERE.rglob("test_*.py") if path.name != Path(__file__).name]
    texts = "".join(path.read_text(encoding="utf-8") for path in paths)
    assert [parameter for parameter in DEEP_PARAMETERS if f'"{parameter[1:]}' not in texts] == []


def test_what_is_always_run_is_an_exception_from_what_is_deep():
    assert [entry for entry in NOT_DEEP if not entry.startswith(DEEP)] == []
