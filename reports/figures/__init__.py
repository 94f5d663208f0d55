"""The kinds of figures: data in, panels of marks out; `reports.drawing` draws them."""

from reports.figures.corridors import CorridorDrawing, LimitLine
from reports.figures.distributions import DistributionPanel, Distributions
from reports.figures.footprints import FootprintCurve, FootprintDrawing
from reports.figures.fronts import FrontDrawing
from reports.figures.histories import Histories, HistoryBand, HistoryLine
from reports.figures.levels import LevelPanel, LevelsDrawing
from reports.figures.maps import MapDrawing
from reports.figures.profiles import ProfileBand, ProfileDrawing
from reports.figures.scatter import ScatterDrawing

__all__ = [
    "CorridorDrawing",
    "DistributionPanel",
    "Distributions",
    "FootprintCurve",
    "FootprintDrawing",
    "FrontDrawing",
    "Histories",
    "HistoryBand",
    "HistoryLine",
    "LevelPanel",
    "LevelsDrawing",
    "LimitLine",
    "MapDrawing",
    "ProfileBand",
    "ProfileDrawing",
    "ScatterDrawing",
]
