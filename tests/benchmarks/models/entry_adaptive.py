"""Entry to 10 km, an embedded pair."""

from mc_engine.model import AdaptiveStep
from tests.benchmarks.models.entry_physics import entry_model

MODEL = entry_model(AdaptiveStep("duration", "tolerance"))
