"""The same rocket with steps of each case's own."""

from phased_rocket import DECLARED

from mc_engine.model import AdaptiveStep, model

MODEL = model(**DECLARED, clock=AdaptiveStep(until=200.0, rtol=1e-11, atol=1e-11, control_period=0.5))
