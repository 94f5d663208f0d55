"""A day in low orbit with J2 and drag, Gauss-Jackson of order 9."""

from mc_engine.model import FixedStep
from tests.benchmarks.models.drag_orbit import LOW_ORBIT, RATES, low_rhs, orbit_model

MODEL = orbit_model("low orbit", low_rhs, LOW_ORBIT, FixedStep("step", "duration", rates=RATES, method="gj9"))
