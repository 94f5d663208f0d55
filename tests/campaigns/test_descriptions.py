"""The one-line meanings of inputs, outputs and metrics: each stands alone in a table, away from the line before it."""

import importlib

import pytest

# A pronoun or a preposition whose noun stands in another line, or a power that no table prints.
DANGLING = ("the same", "its ", "of ", "when ", "it ", "that ", "in its ")
NAMES = ("deorbit", "flexible_satellite", "geo_injection", "geo_servicing", "reentry")


def described(model):
    """(name, meaning) of all that a model declares."""
    parts = (model.parameters, model.settings, model.quantities, model.metrics)
    return [(field.name, field.description) for part in parts for field in part]


@pytest.mark.parametrize("name", NAMES)
def test_each_meaning_can_be_read_by_itself(name):
    model = importlib.import_module(f"campaigns.{name}").MODEL
    found = described(model)
    assert len(found) > 40
    assert [pair for pair in found if not pair[1] or pair[1].startswith(DANGLING) or "^" in pair[1]] == []
