"""The report as one HTML file: nothing is loaded from anywhere, so it works from a disk without a network."""

import re
from collections import Counter
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from reports.document import CaseData, Document, FigureBlock, blocks_of
from reports.figures import screen
from reports.figures.scatter import screen_cloud

SCRIPTS = ("tables.js", "figures.js", "cases.js", "histories.js")


@cache
def plotly_script() -> str:
    """plotly.js as the plotly package ships it (the wheel holds the full bundle only)."""
    return files("plotly").joinpath("package_data/plotly.min.js").read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("reports", "templates"),
        autoescape=True,  # for every template, whatever its name
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["page_colour"] = page_colour
    environment.filters["breakable"] = breakable
    return environment


def breakable(name: str) -> Markup:
    """A name that may break behind its underscores."""
    return Markup("<wbr>").join(re.split(r"(?<=_)", name))


def page_colour(colour: str) -> str:
    """A drawing's colour as CSS: "@ink" is the page's own ink."""
    return f"var(--{colour[1:]})" if colour.startswith("@") else colour


def _own_file(name: str) -> Markup:
    """A style sheet or script of this package, as it is."""
    return Markup(files("reports").joinpath("templates", name).read_text(encoding="utf-8"))


def render_html(document: Document) -> bytes:
    """The page, UTF-8."""
    figures = [
        {"id": f"figure-{block.number}-{index}", "number": block.number, **panel}
        for block in blocks_of(document, FigureBlock)
        for index, panel in enumerate(block.drawing.interactive())
    ]
    page = _environment().get_template("report.html.j2")
    text = page.render(
        document=document,
        figures=figures,
        panels=Counter(figure["number"] for figure in figures),
        cases=case_record(document.cases),
        held=frozenset(document.cases.histories if document.cases else ()),
        style=_own_file("report.css"),
        scripts=[_own_file(name) for name in SCRIPTS],
        plotly=Markup(plotly_script() if figures else ""),
    )
    return text.encode("utf-8")


def case_record(cases: CaseData | None) -> dict[str, Any] | None:
    """What the page's scripts look single cases up in, as plain data."""
    if cases is None:
        return None
    time_axis = screen.axis("time [s]", zeroline=False)
    return {
        "tried": cases.n_tried,
        "ids": cases.ids,
        "outcome": cases.outcome,
        "outcomes": cases.outcomes,
        "columns": [
            {"name": column.name, "label": column.label, "role": column.role, "values": column.values}
            for column in cases.columns
        ],
        "axes": cases.axes,
        "clouds": [screen_cloud(k, name) for k, name in enumerate(cases.outcomes)],
        "quantities": [{"name": name, "label": label} for name, label in cases.quantities.items()],
        "histories": {
            str(case): {name: [screen.rounded(t), screen.rounded(y)] for name, (t, y) in curves.items()}
            for case, curves in cases.histories.items()
        },
        "panel": screen.layout(time_axis, screen.axis("", nticks=6), 240, " ", hovermode="closest"),
    }
