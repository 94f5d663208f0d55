"""The report as one self-contained HTML file, which needs no network."""

import re
from collections import Counter
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from reports.document.blocks import CaseData, Document, FigureBlock, blocks_of
from reports.drawing import paper, screen
from reports.drawing.marks import Axis, Band, Limit, Line, Plot
from reports.figures.clouds import outcome_cloud
from reports.figures.histories import MEDIAN
from reports.text.numbers import count

SCRIPTS = ("tables.js", "figures.js", "cases.js", "histories.js")


@cache
def plotly_script() -> Markup:
    """plotly.js, its "basic" bundle: scatters and bars.  Its licence and notice stand at its head."""
    return _own_file("plotly-basic.min.js")


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("reports", "templates"),
        autoescape=True,  # for every template, whatever its name
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["swatch"] = lambda mark: Markup(paper.page_swatch(mark))
    environment.filters["breakable"] = breakable
    environment.filters["grouped"] = count
    return environment


def breakable(name: str) -> Markup:
    """A name that may break behind its underscores."""
    return Markup("<wbr>").join(re.split(r"(?<=_)", name))


def _own_file(name: str) -> Markup:
    """A style sheet or script of this package, as it is."""
    return Markup(files("reports").joinpath("templates", name).read_text(encoding="utf-8"))


def render_html(document: Document) -> bytes:
    """The page, UTF-8."""
    cases = document.cases
    figures = [
        {"id": f"figure-{block.number}-{index}", "number": block.number, **_background(plot), **_by_row(panel, cases)}
        for block in blocks_of(document, FigureBlock)
        for index, (plot, panel) in enumerate(
            zip(block.drawing.plots, screen.specifications(block.drawing), strict=True)
        )
    ]
    page = _environment().get_template("report.html.j2")
    text = page.render(
        document=document,
        figures=figures,
        heights=_heights(figures),
        cases=case_record(document),
        held=frozenset(cases.histories if cases else ()),
        found=Counter(cases.outcome.tolist() if cases else ()),
        style=_own_file("report.css"),
        scripts=[_own_file(name) for name in SCRIPTS],
        plotly=plotly_script() if figures else "",
    )
    return text.encode("utf-8")


def _heights(figures: list[dict[str, Any]]) -> dict[int, list[int]]:
    """Pixels of every panel, by the number of its figure: its place is kept until it is drawn."""
    heights: dict[int, list[int]] = {}
    for figure in figures:
        heights.setdefault(figure["number"], []).append(figure["layout"]["height"])
    return heights


def _by_row(panel: dict[str, Any], cases: CaseData | None) -> dict[str, Any]:
    """The panel, its clouds of cases over columns that the page holds without their numbers: `rows` say which cases."""
    names = {column.name for column in cases.columns if isinstance(column.values, np.ndarray)} if cases else set()
    for trace in panel["data"]:
        if trace.get("meta") == screen.CASES and cases is not None:
            row = np.searchsorted(cases.ids, trace["customdata"])
            held = row < cases.ids.size
            known = bool(held.all() and (cases.ids[row] == trace["customdata"]).all())
            if known and len(trace["columns"] or ()) > 1 and names.issuperset(trace["columns"]):
                for member in ("x", "y", "customdata", *["text"] * (len(trace["columns"]) > 2)):
                    del trace[member]
                trace["rows"] = screen.typed(row, "u4")
    return panel


def case_record(document: Document) -> dict[str, Any] | None:
    """What the page's scripts look single cases up in, as plain data."""
    cases = document.cases
    if cases is None:
        return None
    none = np.empty(0)
    clouds = [outcome_cloud(k, name, none, none, none) for k, name in enumerate(cases.outcomes)]
    return {
        "tried": cases.n_tried,
        "ids": screen.typed(cases.ids, "f8") if (np.diff(cases.ids) > 1).any() else [int(cases.ids[0]), cases.ids.size],
        "outcome": screen.typed(cases.outcome, "u1"),
        "outcomes": cases.outcomes,
        "columns": [{"name": column.name, "label": column.label, "role": column.role,
                     "values": screen.column(column.values) if isinstance(column.values, np.ndarray) else column.values}
                    for column in cases.columns],
        "axes": cases.axes,
        "clouds": [trace for cloud in clouds for trace in screen.traced(cloud, Plot((), Axis(), Axis()))],
        "quantities": [{"name": name, "label": label} for name, label in cases.quantities.items()],
        "histories": {
            str(case): {name: [screen.packed(t), screen.packed(y)] for name, (t, y) in curves.items()}
            for case, curves in cases.histories.items()
        },
        "panel": screen.history_panel(cases.time),
    }  # fmt: skip


def _background(plot: Plot) -> dict[str, Any]:
    """Of a panel of a history quantity, the traces that the curve of any case is drawn over: all but those of cases."""
    behind = [
        place
        for place, mark in enumerate(plot.marks)
        if isinstance(mark, Band | Limit) or (isinstance(mark, Line) and mark.name.startswith(MEDIAN))
    ]
    return {"quantity": plot.quantity, "behind": behind} if plot.quantity else {}
