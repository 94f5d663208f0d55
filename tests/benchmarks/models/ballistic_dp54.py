"""Ballistic entry to 10 km, the pair of order 5."""

from mc_engine.model import AdaptiveStep
from tests.benchmarks.models.entry_physics import ballistic_rhs, entry_model

MODEL = entry_model(AdaptiveStep("duration", "tolerance", method="dp54"), ballistic_rhs)
