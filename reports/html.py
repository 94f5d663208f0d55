"""The report as one HTML file: nothing is loaded from anywhere, so it works from a disk without a network."""

import re
from functools import cache
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from reports.document import Document, FigureBlock, blocks_of


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
        {"id": f"figure-{block.number}-{index}", **panel}
        for block in blocks_of(document, FigureBlock)
        for index, panel in enumerate(block.drawing.interactive())
    ]
    page = _environment().get_template("report.html.j2")
    text = page.render(
        document=document,
        figures=figures,
        panels={block.number: len(block.drawing.interactive()) for block in blocks_of(document, FigureBlock)},
        style=_own_file("report.css"),
        script=_own_file("report.js"),
        plotly=Markup(plotly_script() if figures else ""),
    )
    return text.encode("utf-8")
