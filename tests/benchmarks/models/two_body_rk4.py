"""A day around a point mass, classical Runge-Kutta."""

from mc_engine.model import FixedStep
from tests.benchmarks.models.drag_orbit import LOW_ORBIT, RATES, orbit_model, two_body_rhs

MODEL = orbit_model("two-body orbit", two_body_rhs, LOW_ORBIT, FixedStep("step", "duration", rates=RATES))
