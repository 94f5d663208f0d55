"""The kinds of figures: data in, one drawing for the screen and one for paper out."""

from reports.figures.distributions import DistributionPanel, Distributions
from reports.figures.histories import Histories, HistoryLine
from reports.figures.maps import MapDrawing
from reports.figures.scatter import ScatterDrawing

__all__ = ["DistributionPanel", "Distributions", "Histories", "HistoryLine", "MapDrawing", "ScatterDrawing"]
