"""Entry to 10 km, classical Runge-Kutta."""

from mc_engine.model import FixedStep
from tests.benchmarks.models.entry_physics import entry_model

MODEL = entry_model(FixedStep("step", "duration"))
