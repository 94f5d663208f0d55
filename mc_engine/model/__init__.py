"""What a model is: the names that a model file imports."""

from mc_engine.model.declarations import (
    at_end,
    choices,
    declared_in,
    inputs,
    last_above,
    maximum_of,
    metrics,
    minimum_of,
    outputs,
    states,
    time_of,
    time_of_maximum,
    time_of_minimum,
    value_at,
)
from mc_engine.model.declared import model, prepared
from mc_engine.model.designs import compiled_loop, kept_design
from mc_engine.model.fields import AdaptiveStep, Event, Extremum, Field, FixedStep, Named, Parameter, Setting
from mc_engine.model.figures import (
    CorridorFigure,
    FootprintFigure,
    HistoryFigure,
    MapFigure,
    ProfileFigure,
    ScatterFigure,
)
from mc_engine.model.phases import Phase
from mc_engine.model.record import Model, Refusals, load_model

__all__ = [
    "AdaptiveStep",
    "CorridorFigure",
    "Event",
    "Extremum",
    "Field",
    "FixedStep",
    "FootprintFigure",
    "HistoryFigure",
    "MapFigure",
    "Model",
    "Named",
    "Parameter",
    "Phase",
    "ProfileFigure",
    "Refusals",
    "ScatterFigure",
    "Setting",
    "at_end",
    "choices",
    "compiled_loop",
    "declared_in",
    "inputs",
    "kept_design",
    "last_above",
    "load_model",
    "maximum_of",
    "metrics",
    "minimum_of",
    "model",
    "outputs",
    "prepared",
    "states",
    "time_of",
    "time_of_maximum",
    "time_of_minimum",
    "value_at",
]
