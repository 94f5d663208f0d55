"""The layout of the cases of a pick-freeze design in blocks (see `statistics.pick_freeze`); imports NumPy alone."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

RANDOM_DRAWS = "random draws"  # the group of the noise made in flight and of the parameters that name a draw
A, B, C = 0, 1, 2  # the independent points of a block
NOMINAL = 3  # in place of a point: nominal values


@dataclass(frozen=True)
class BlockLayout:
    """The rows of a block: A; A_B(g) for each group; B; A_C(g) for the groups in `repeated`; and for those in `held`
    A with the group at its nominal values.

    C is a third point.  A, A_B(g) and A_C(g) are three pairs in place of one for the total index of a repeated group:
    worth it for the random draws, which a whole metric may depend on, so that nothing else steadies its indices.
    """

    groups: tuple[str, ...]
    repeated: tuple[str, ...] = ()
    held: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Rows of a block."""
        return len(self.groups) + 2 + len(self.repeated) + len(self.held)

    @property
    def n_drawn(self) -> int:
        """Rows, the first ones, in which no group is at its nominal values."""
        return self.size - len(self.held)

    def points(self, group: str) -> np.ndarray:
        """int64[size]: the point, A, B or C, that each row takes the group from, or NOMINAL."""
        points = np.full(self.size, A)
        points[[self.groups.index(group) + 1, len(self.groups) + 1]] = B
        points[self._repetitions(group)] = C
        if group in self.held:
            points[self.without(group)[1]] = NOMINAL
        return points

    def _repetitions(self, group: str) -> list[int]:
        return [len(self.groups) + 2 + self.repeated.index(group)] if group in self.repeated else []

    def without(self, group: str) -> tuple[int, int]:
        """Rows with the group as drawn, and at its nominal values."""
        return 0, self.n_drawn + self.held.index(group)

    def in_common(self, group: str) -> list[tuple[int, int]]:
        """Pairs of rows that have the group alone in common."""
        return [(len(self.groups) + 1, self.groups.index(group) + 1)]

    def independent(self, group: str) -> list[tuple[int, int]]:
        """Pairs of rows with nothing in common that are like those in common but for the group."""
        return [(row, len(self.groups) + 1) for row in (0, *self._repetitions(group))]

    def differing(self, group: str) -> list[tuple[int, int]]:
        """Pairs of rows that differ in the group alone."""
        rows = [0, self.groups.index(group) + 1, *self._repetitions(group)]
        return list(combinations(rows, 2))
