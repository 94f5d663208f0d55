"""The layout of two small reports, compared with stored files; `golden_layout` says how to write these again."""

import pytest
from golden_layout import GOLDEN, SMALLER, outline, report_of


@pytest.mark.parametrize("name", SMALLER)
def test_the_layout_of_a_report_is_that_of_its_golden_file(name, tmp_path):
    assert outline(report_of(name, tmp_path)) == (GOLDEN / f"{name}.txt").read_text(encoding="utf-8")
