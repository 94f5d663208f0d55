"""A day in a transfer orbit with J2, and drag at perigee, the pair of order 5."""

from mc_engine.model import AdaptiveStep
from tests.benchmarks.models.drag_orbit import TRANSFER_ORBIT, orbit_model, transfer_rhs

MODEL = orbit_model(
    "transfer orbit", transfer_rhs, TRANSFER_ORBIT, AdaptiveStep("duration", "tolerance", method="dp54")
)
