"""A day in a transfer orbit with J2, and drag at perigee, classical Runge-Kutta."""

from mc_engine.model import FixedStep
from tests.benchmarks.models.drag_orbit import RATES, TRANSFER_ORBIT, orbit_model, transfer_rhs

MODEL = orbit_model("transfer orbit", transfer_rhs, TRANSFER_ORBIT, FixedStep("step", "duration", rates=RATES))
