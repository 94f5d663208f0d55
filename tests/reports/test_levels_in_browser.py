"""Levels of a switch on the axes of the figure of cases, in a real browser."""

import pytest
from browser import INSTALLED, chromium
from synthetic_run import synthetic_run

from reports import build, render_html

pytestmark = pytest.mark.skipif(not INSTALLED, reason="needs the Debian package chromium")
FIGURE = "document.getElementById(document.getElementById('explorer').dataset.figure)"
DRAWN = f"{FIGURE}.querySelectorAll('.xtick text').length > 0"
TICKS = f"[...{FIGURE}.querySelectorAll('.xtick text')].map((tick) => tick.textContent)"
NAMES = "[...document.getElementById('explorer-x').options].map((option) => option.textContent)"


def test_a_switch_has_its_levels_on_the_axis_and_another_column_has_numbers(tmp_path):
    run = synthetic_run(200, failed=0)
    run.table["oe_pct"] = run.table["case_id"] % 3 == 0
    run.table["propellant_kg"] = 3.0 * ~run.table["oe_pct"]
    file = tmp_path / "report.html"
    file.write_bytes(render_html(build(run, "run")))
    with chromium(tmp_path / "profile") as page:
        page.open(file)
        page.run(f"{FIGURE}.scrollIntoView({{behavior: 'instant'}})")
        page.until(DRAWN)
        names = page.run(NAMES)
        oe, ve = (next(k for k, name in enumerate(names) if name.startswith(one)) for one in ("oe", "ve"))
        assert page.run("Number(document.getElementById('explorer-x').value)") == oe
        assert page.run(TICKS) == ["no", "yes"]
        for column, levels in ((ve, False), (oe, True)):
            choose = f"s.value = {column}; s.dispatchEvent(new Event('change'))"
            page.run(f"(() => {{ const s = document.getElementById('explorer-x'); {choose}; }})()")
            page.until(f"{TICKS}.includes('yes') === {str(levels).lower()} && {DRAWN}")
            assert (page.run(TICKS) == ["no", "yes"]) == levels
