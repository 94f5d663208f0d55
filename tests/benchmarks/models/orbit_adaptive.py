"""A day in low orbit with J2 and drag, an embedded pair."""

from mc_engine.model import AdaptiveStep
from tests.benchmarks.models.drag_orbit import LOW_ORBIT, low_rhs, orbit_model

MODEL = orbit_model("low orbit", low_rhs, LOW_ORBIT, AdaptiveStep("duration", "tolerance"))
