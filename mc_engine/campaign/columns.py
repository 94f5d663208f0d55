"""The columns of a run's case table after case_id, status and reason.

In order: columns taken from an upstream run, dispersions, metrics, time and state at the end.
Flights need only the names, so the code that stores columns is imported where columns are made.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mc_engine.campaign.dispersions import Dispersion
from mc_engine.model.fields import Parameter, Setting
from mc_engine.model.simulator import System

if TYPE_CHECKING:
    from mc_engine.store.parts import Column

END_TIME = "end_time_s"
END_PHASE = "end_phase"  # of a model with phases


def input_column(item: Parameter | Setting) -> "Column":
    """The column of an input that differs from case to case."""
    from mc_engine.store.parts import Column

    kind = "number"
    if isinstance(item, Setting) and (item.choices or item.date):
        kind = "word"
    elif isinstance(item.default, bool):
        kind = "switch"
    return Column(item.name, item.unit, "dispersion", item.description, kind)


def result_columns(model: System) -> "list[Column]":
    """Metrics, and time and state at the end of the flight; of a simulator, metrics alone."""
    from mc_engine.store.parts import Column

    columns = [Column(metric.name, metric.unit, "metric", metric.description) for metric in model.metrics]
    if not model.states:
        return columns
    columns.append(Column(END_TIME, "s", "state", "time at the end of the flight, from its start"))
    if getattr(model, "phases", ()):
        columns.append(Column(END_PHASE, "", "state", "phase at the end of the flight", "word"))
    columns += [
        Column(f"end_{state.name}", state.unit, "state", f"{state.description}, at the end") for state in model.states
    ]
    return columns


def case_columns(model: System, dispersions: Sequence[Dispersion], upstream: "Sequence[Column]") -> "list[Column]":
    """All columns of a campaign's table; `upstream` are those of the run that it takes inputs from."""
    return [
        *upstream,
        *(input_column(model.input(dispersion.name)) for dispersion in dispersions),
        *result_columns(model),
    ]
