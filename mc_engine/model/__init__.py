"""What a model is: the names that a model file imports."""

from mc_engine.model.designs import kept_design
from mc_engine.model.fields import AdaptiveStep, Event, Extremum, Field, FixedStep, Named, Parameter, Setting
from mc_engine.model.figures import (
    CorridorFigure,
    FootprintFigure,
    HistoryFigure,
    MapFigure,
    ProfileFigure,
    ScatterFigure,
)
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
    "ProfileFigure",
    "Refusals",
    "ScatterFigure",
    "Setting",
    "kept_design",
    "load_model",
]
