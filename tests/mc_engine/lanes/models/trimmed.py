"""A trimmed aeroplane, of which only the latitude changes, until a doublet of the elevator; linear.  SI."""

from mc_engine.lanes import physics, where
from mc_engine.model import AdaptiveStep, Parameter, inputs, maximum_of, metrics, model, outputs, states

TRIM = 0.05  # angle of attack, rad

Inputs = inputs(start_s=Parameter(1.0, "start of the doublet"))
State = states(latitude_rad="latitude", speed_m_s="speed", alpha_rad="angle of attack", pitch_rate_rad_s="pitch rate")
Outputs = outputs(alpha_rad="angle of attack")
Metrics = metrics(top_rad=maximum_of("alpha_rad", "largest angle of attack"))


@physics
def initial():
    return State(latitude=0.8, speed=200.0, alpha=TRIM, pitch_rate=0.0)


@physics
def rhs(t, s, p):
    u = t - p.start
    elevator = where((u > 0.0) & (u < 0.5), 0.05, 0.0) - where((u > 0.5) & (u < 1.0), 0.05, 0.0)
    more = s.alpha - TRIM
    return State(
        latitude=s.speed / 6.4e6,
        speed=-0.5 * more,
        alpha=s.pitch_rate - 0.8 * more,
        pitch_rate=5.0 * elevator - 4.0 * more - s.pitch_rate,
    )


@physics
def observe(s):
    return Outputs(alpha=s.alpha)


MODEL = model(
    name="trimmed",
    title="A doublet of the elevator",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=AdaptiveStep(until=30.0),
    initial=initial,
    rhs=rhs,
    observe=observe,
)
