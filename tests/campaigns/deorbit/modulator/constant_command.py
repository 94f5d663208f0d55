"""The pulse modulator alone, under a constant command: when it turns on, off, and on again."""

from collections import namedtuple

from mc_engine.lanes import physics, where
from mc_engine.model import Event, FixedStep, Parameter, inputs, metrics, model, outputs, states
from mc_engine.physics.pulse_modulators import lag_rate

Inputs = inputs(
    command_n=Parameter(20.0, "commanded force"),
    gain=Parameter(1.0, "gain on command and output", unit=""),
    level_n=Parameter(30.0, "force of the thruster"),
    on_n=Parameter(10.0, "lag output that switches the thruster on"),
    off_n=Parameter(5.0, "lag output that switches it off again"),
    time_constant_s=Parameter(5.0, "time constant of the lag"),
)
State = states(filtered_n="output of the lag")
Memory = namedtuple("Memory", "firing switches first_on first_off second_on", defaults=(0.0,) * 5)
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
    return State(filtered=lag_rate(s.filtered, p.command, m.firing * p.level, p.gain, p.gain, p.time_constant))


@physics
def above_on(s, m, p):
    """How far the lag's output is above the upper level of the Schmitt trigger, while it is off."""
    return where(m.firing > 0.5, -1.0, s.filtered - p.on)


@physics
def above_off(s, m, p):
    """How far it is above the lower level, while the trigger is on."""
    return where(m.firing > 0.5, s.filtered - p.off, 1.0)


@physics
def noted(t, turned, number, before):
    """The time of one turn of the trigger: now, if this is the one."""
    return where(turned == number, t, before)


@physics
def switch(t, s, m, hit):
    """Turn the trigger over and note the time of each of its first three turns."""
    firing = where(hit.pulse_on > 0.5, 1.0, where(hit.pulse_off > 0.5, 0.0, m.firing))
    turned = m.switches + hit.pulse_on + hit.pulse_off
    return s, Memory(
        firing=firing,
        switches=turned,
        first_on=noted(t, turned, 1.0, m.first_on),
        first_off=noted(t, turned, 2.0, m.first_off),
        second_on=noted(t, turned, 3.0, m.second_on),
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
        "pulse_on": Event(above_on, "rising", "switch"),
        "pulse_off": Event(above_off, "falling", "switch"),
    },
    switch=switch,
    observe=observe,
    evaluate=evaluate,
)
