"""Validation of a model's figures: types of their fields, and names that the model declares."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from mc_engine.errors import ModelError
from mc_engine.model.figures import (
    CorridorFigure,
    Figure,
    FootprintFigure,
    HistoryFigure,
    MapFigure,
    ProfileFigure,
    ScatterFigure,
)
from mc_engine.model.record_types import refuse_other_types
from mc_engine.suggestions import hint, nearest

if TYPE_CHECKING:
    from mc_engine.model.record import Model

_OF_EVERY_CASE = ("case_id", "end_time_s")


def refuse_false_figures(model: "Model") -> None:
    """ModelError if a figure of the model has a field of another type, or names what the model does not have."""
    for figure in model.figures:
        figure_name = f'the {type(figure).__name__} "{figure.title}"'
        refuse_kinds(figure, figure_name)
        for word, name, known in _names_in_figure(figure, model):
            if name not in known:
                raise ModelError(f'{figure_name}: there is no {word} "{name}"{_other_table(name, word, model)}'
                                 f"{_hint(name, known)}")  # fmt: skip


def refuse_kinds(figure: Figure, figure_name: str) -> None:
    """ModelError about the figure of this name if a field of it is of another type, or names nothing to draw."""
    refuse_other_types(figure, figure_name)
    for name, value in vars(figure).items():
        if value == ():
            raise ModelError(f"{figure_name} has () as its `{name}`; it must name one at least")


def _names_in_figure(figure: Figure, model: "Model") -> Iterator[tuple[str, str, list[str]]]:
    """Every name in the figure that the model must have: what it is, the name, all that there are."""
    inputs = [item.name for item in (*model.parameters, *model.settings)]
    metrics = [metric.name for metric in model.metrics]
    columns = [*inputs, *metrics, *(f"end_{state.name}" for state in model.states), *_OF_EVERY_CASE]
    quantities = [quantity.name for quantity in model.quantities]
    if isinstance(figure, MapFigure):
        yield "column", figure.metric, columns
    if isinstance(figure, CorridorFigure):
        yield from (("metric", name, metrics) for name in figure.metrics)
    if isinstance(figure, MapFigure | ScatterFigure | CorridorFigure) and not figure.upstream:
        yield from (("column", name, columns) for name in (figure.x, figure.y))
    if isinstance(figure, HistoryFigure):
        yield from (("quantity", name, quantities) for name in figure.quantities)
    if isinstance(figure, ProfileFigure):
        yield from (("quantity", name, ["t_s", *quantities]) for name in (figure.x, figure.y))
    if isinstance(figure, FootprintFigure):
        above = () if figure.ends_below is None else figure.ends_below[:1]
        yield from (("column", str(name), columns) for name in (figure.latitude, figure.longitude, *above))
        yield from (("column", name, columns) for name in figure.target or ())
        if figure.planet:
            yield "setting", figure.planet, [item.name for item in model.settings]


def _hint(name: str, known: list[str]) -> str:
    """`hint`, where a name with the same end, which is its unit, comes first."""
    alike = [column for column in known if column.rpartition("_")[2] == name.rpartition("_")[2]]
    return hint(name, alike if nearest(name, alike) else known)


def _other_table(name: str, word: str, model: "Model") -> str:
    """Why a name that the model has is not for this figure: histories and the table of cases are two tables."""
    if word == "quantity" and name in [item.name for item in (*model.parameters, *model.settings, *model.metrics)]:
        return " (it is a column of the table of cases, histories do not have it)"
    if word in ("column", "metric") and name in [quantity.name for quantity in model.quantities]:
        return " (it is a quantity of histories, the table of cases does not have it)"
    return ""
