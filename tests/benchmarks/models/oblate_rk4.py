"""A day in low orbit with J2 alone, classical Runge-Kutta."""

from mc_engine.model import FixedStep
from tests.benchmarks.models.drag_orbit import LOW_ORBIT, oblate_rhs, orbit_model

MODEL = orbit_model("oblate orbit", oblate_rhs, LOW_ORBIT, FixedStep("step", "duration"))
