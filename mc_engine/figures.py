"""Figures that a model asks of every report, as data: what to draw, not how.

The run's manifest keeps them, so that a report can be made years later without the model.
"""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class MapFigure:
    """Filled contours of a metric over two inputs, with the flown cases on them."""

    metric: str
    x: str
    y: str
    title: str


@dataclass(frozen=True)
class HistoryFigure:
    """History quantities of the retained cases against time, one panel a quantity."""

    quantities: tuple[str, ...]
    title: str


@dataclass(frozen=True)
class ScatterFigure:
    """One column against another, a point a case."""

    x: str
    y: str
    title: str


KINDS = {"map": MapFigure, "history": HistoryFigure, "scatter": ScatterFigure}


def to_record(figure: Any) -> dict[str, Any]:
    """The figure as plain data for the manifest."""
    kind = next(name for name, cls in KINDS.items() if isinstance(figure, cls))
    return {"kind": kind, **asdict(figure)}


def from_record(record: dict[str, Any]) -> Any:
    """The figure that `to_record` wrote."""
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in record.items() if key != "kind"}
    return KINDS[record["kind"]](**values)
