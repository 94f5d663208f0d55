"""The campaign's pulse modulator alone, under a constant command: when it turns on, off, and on again."""

from collections import namedtuple

from campaigns.deorbit import dynamics
from mc_engine.lanes import physics, replace, where
from mc_engine.model import Event, FixedStep, Parameter, inputs, metrics, model, outputs, states
from mc_engine.physics.pulse_modulators import lag_rate

Inputs = inputs(
    command_n=Parameter(20.0, "commanded force"),
    gain=Parameter(1.0, "gain on command and output", unit=""),
    level_n=Parameter(30.0, "force of the thruster"),
    modulator_on_n=Parameter(10.0, "lag output that switches the thruster on"),
    modulator_off_n=Parameter(5.0, "lag output that switches it off again"),
    time_constant_s=Parameter(5.0, "time constant of the lag"),
)
State = states(filtered_n="output of the lag")
Memory = namedtuple("Memory", "on pulses turns first_on first_off second_on", defaults=(0.0,) * 6)
Outputs = outputs(filtered_n="output of the lag")
Metrics = metrics(
    first_on_s="start of the first pulse", pulse_s="length of the first pulse", pause_s="pause after the first pulse"
)


@physics
def initial():
    """At rest."""
    return State(filtered=0.0)


@physics
def rhs(s, m, p):
    """The lag's rate in the standard form, with one gain."""
    return State(filtered=lag_rate(s.filtered, p.command, m.on * p.level, p.gain, p.gain, p.time_constant))


@physics
def switch(t, s, m, hit):
    """Turn the trigger over and note the time of each of its first three turns."""
    s, m = dynamics.switch(s, m, hit)
    turns = m.turns + hit.pulse_on + hit.pulse_off
    return s, replace(
        m,
        turns=turns,
        first_on=where(turns == 1.0, t, m.first_on),
        first_off=where(turns == 2.0, t, m.first_off),
        second_on=where(turns == 3.0, t, m.second_on),
    )


@physics
def observe(s):
    """The lag's output."""
    return Outputs(filtered=s.filtered)


@physics
def evaluate(m):
    """Time of the first pulse, its length, and that of the pause after it."""
    return Metrics(first_on=m.first_on, pulse=m.first_off - m.first_on, pause=m.second_on - m.first_off)


MODEL = model(
    name="constant_command",
    title="Pulse modulator under a constant command",
    source="M. J. Sidi, Spacecraft Dynamics and Control (1997), section 9.3",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep(0.1, 12.0),
    initial=initial,
    memory=Memory,
    rhs=rhs,
    events={
        "pulse_on": Event(dynamics.trigger, "rising", "switch"),
        "pulse_off": Event(dynamics.trigger, "falling", "switch"),
    },
    switch=switch,
    observe=observe,
    evaluate=evaluate,
)
