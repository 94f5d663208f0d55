"""How a search went on: one curve a panel over the candidates flown so far."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reports.figures.marks import Axis, Drawing, Line, Plot
from reports.figures.palette import BLUE

X_LABEL = "candidates flown"


@dataclass(frozen=True)
class Convergence(Drawing):
    """x : float64[n], candidates flown up to each generation; curves : float64[n] by label, NaN where undefined."""

    x: np.ndarray
    curves: dict[str, np.ndarray]
    form: ClassVar[str] = "Curves over the candidates"

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(
            Plot(
                (Line(self.x, y, BLUE, width=2.0, step="hv", key=f"after each of {self.x.size} generations"),),
                Axis(X_LABEL, most=4),
                Axis(name=label, zero=True),
                label,
                250.0,
            )
            for label, y in self.curves.items()
        )
