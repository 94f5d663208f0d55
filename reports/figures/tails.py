"""How a small probability was reached: the probability of each level over its margin, down to the limit."""

from dataclasses import dataclass

import numpy as np

from reports.figures.marks import Axis, Drawing, Limit, Line, Plot, Points
from reports.figures.palette import BLUE, INK, VERMILION
from reports.numbers import number

Y_LABEL = "probability of being nearer"


@dataclass(frozen=True)
class Tail(Drawing):
    """margin, probability : float64[n], of the levels;  estimate : (probability, lower, upper) at margin zero.

    label : of the margin, with its unit.
    """

    label: str
    margin: np.ndarray
    probability: np.ndarray
    estimate: tuple[float, float, float]

    @property
    def alternative(self) -> str:
        p, lower, upper = (number(value, 4) for value in self.estimate)
        return (
            f"The probability falls over {self.margin.size} levels as the margin falls to zero, where it is {p}, "
            f"interval {lower} to {upper}."
        )

    @property
    def plots(self) -> tuple[Plot, ...]:
        p, lower, upper = (np.array([value]) for value in self.estimate)
        marks = (
            Limit(0.0, "x", INK, "limit", width=1.0),
            Line(self.margin, self.probability, BLUE, "levels", width=2.0, key="levels"),
            Points(self.margin, self.probability, BLUE, "levels", size=6.0),
            Points(
                np.zeros(1), p, VERMILION, "not met", size=8.0, y_ends=(lower, upper), key="not met, with its interval"
            ),
        )
        x = Axis(self.label, reach=Axis().ends([self.margin, np.zeros(1)])[::-1])
        return (Plot(marks, x, Axis(Y_LABEL, log=True), height=340.0),)
