"""The kinds of figures: data in, one drawing for the screen and one for paper out."""

from reports.figures.convergence import Convergence
from reports.figures.distributions import DistributionPanel, Distributions
from reports.figures.fronts import FrontDrawing
from reports.figures.histories import Histories, HistoryBand, HistoryLine
from reports.figures.maps import MapDrawing
from reports.figures.scatter import ScatterDrawing

__all__ = [
    "Convergence",
    "DistributionPanel",
    "Distributions",
    "FrontDrawing",
    "Histories",
    "HistoryBand",
    "HistoryLine",
    "MapDrawing",
    "ScatterDrawing",
]
