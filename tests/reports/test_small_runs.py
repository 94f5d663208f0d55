"""Runs with next to nothing in them: each format says so, in words, and warns of nothing else (warnings are errors)."""

import numpy as np
import pytest
from synthetic_run import synthetic_run

from reports import build, render_html, render_pdf
from reports.formats.markdown import figure_files, render_markdown


def constant(run):
    for name in run.table.columns[3:]:
        run.table[name] = 1.5
    return run


def without_numbers(run):
    run.table["propellant_kg"] = np.nan
    return run


def with_numbers(run, low, high):
    part = np.linspace(0.0, 1.0, len(run.table))
    run.table["propellant_kg"] = low * (1.0 - part) + high * part
    return run


UNDRAWN = "numbers beyond 1e140 or a standard deviation below 1e-140: propellant."
SMALL = {
    "no case": (synthetic_run(0, failed=0), "No case was flown."),
    "one case": (synthetic_run(1, failed=0), "the most of the one case with which"),
    "two cases": (synthetic_run(2, failed=0), "too few cases"),
    "one failed case": (synthetic_run(1, failed=1), "The only case failed"),
    "all failed": (synthetic_run(30, failed=30), "All 30 cases failed: no metric has a number."),
    "constant": (constant(synthetic_run(30, failed=0)), "the same in all cases"),
    "the whole range of numbers": (with_numbers(synthetic_run(300, failed=0), -1.7e308, 1.7e308), UNDRAWN),
    "numbers of 1e160": (with_numbers(synthetic_run(300, failed=0), 1e160, 3e160), UNDRAWN),
    "numbers that no square tells from 0": (with_numbers(synthetic_run(300, failed=0), 1e-300, 3e-300), UNDRAWN),
    "a metric without numbers": (without_numbers(synthetic_run(30, failed=0)), "no case has a number: propellant."),
}


FURTHER = ("numbers of 1e160", "numbers that no square tells from 0")


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=pytest.mark.slow if case in FURTHER else ()) for case in SMALL]
)
def test_the_report_says_so_in_every_format(case):
    run, said = SMALL[case]
    document = build(run, "run")
    page = render_html(document).decode()
    text = render_markdown(document).decode()
    assert said in page
    assert said in text
    assert "nan" not in text.split()
    assert render_pdf(document).startswith(b"%PDF")
    assert len(list(figure_files(document))) == page.count('<figure class="drawing"')
