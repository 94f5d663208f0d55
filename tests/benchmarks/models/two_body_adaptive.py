"""A day around a point mass, an embedded pair."""

from mc_engine.model import AdaptiveStep
from tests.benchmarks.models.drag_orbit import LOW_ORBIT, orbit_model, two_body_rhs

MODEL = orbit_model("two-body orbit", two_body_rhs, LOW_ORBIT, AdaptiveStep("duration", "tolerance"))
