"""Order statistics in passes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mc_engine.statistics import selection
from mc_engine.statistics.selection import Selection

FINITE = st.floats(allow_nan=False, allow_infinity=False).map(lambda value: value + 0.0)


def selected(parts, ranks):
    """All passes, in each the parts in another order."""
    passed, step = Selection(), 0
    while not passed.done:
        parts = parts[::-1]
        for part in parts:
            passed.add(part)
        passed = passed.next(ranks if step == 0 else None)
        step += 1
    return passed.values


@settings(max_examples=25, deadline=None)
@given(arrays(np.float64, st.integers(1, 30), elements=FINITE))
def test_every_rank_of_any_values_is_the_sorted_one(values):
    ordered = np.sort(values)
    assert selected([values], range(1, values.size + 1)) == {rank + 1: one for rank, one in enumerate(ordered.tolist())}


@pytest.mark.parametrize("few", [selection.FEW, 100, 0])
@pytest.mark.parametrize("kind", ["normal", "tied", "constant", "wide"])
def test_large_and_tied_columns_in_uneven_parts(kind, few, monkeypatch):
    monkeypatch.setattr(selection, "FEW", few)
    draw = np.random.Generator(np.random.Philox(key=5))
    values = draw.normal(1000.0, 1e-6, 20_000)
    if kind == "tied":
        values = np.round(draw.normal(0.0, 3.0, 20_000)) + 0.0
    if kind == "constant":
        values = np.full(20_000, -0.1)
    if kind == "wide":
        values = draw.normal(size=20_000) * 10.0 ** draw.integers(-300, 300, 20_000)
    ranks = [1, 2, 27, 10_000, 10_001, 19_999, 20_000]
    found = selected(np.split(values, [3, 9000, 9001]), ranks)
    assert found == {rank: float(np.sort(values)[rank - 1]) for rank in ranks}
