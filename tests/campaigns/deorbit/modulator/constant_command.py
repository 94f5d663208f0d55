"""The pulse modulator alone, under a constant command: when it turns on, off, and on again."""

from collections import namedtuple

from mc_engine.lanes import physics, where
from mc_engine.model import Event, Field, FixedStep, Model, Parameter
from mc_engine.physics.pulse_modulators import lag_rate

State = namedtuple("State", "filtered")
Parameters = namedtuple("Parameters", "command gain level on off time_constant")
Memory = namedtuple("Memory", "firing switches first_on first_off second_on")
Events = namedtuple("Events", "pulse_on pulse_off")
Metrics = namedtuple("Metrics", "first_on pulse pause")


@physics
def initial(p, o):
    """At rest."""
    return State(0.0 * p.command)


@physics
def start(p, o):
    """Off; nothing seen yet."""
    none = 0.0 * p.command
    return Memory(none, none, none, none, none)


@physics
def rhs(t, s, m, p, o):
    """The lag's rate in the standard form, with one gain."""
    return State(lag_rate(s.filtered, p.command, m.firing * p.level, p.gain, p.gain, p.time_constant))


@physics
def events(t, s, m, p, o):
    """The Schmitt trigger."""
    firing = m.firing > 0.5
    return Events(where(firing, -1.0, s.filtered - p.on), where(firing, s.filtered - p.off, 1.0))


@physics
def noted(t, turned, number, before):
    """The time of one turn of the trigger: now, if this is the one."""
    return where(turned == number, t, before)


@physics
def switch(t, s, m, p, o, hit):
    """Turn the trigger over and note the time of each of its first three turns."""
    firing = where(hit.pulse_on > 0.5, 1.0, where(hit.pulse_off > 0.5, 0.0, m.firing))
    turned = m.switches + hit.pulse_on + hit.pulse_off
    times = noted(t, turned, 1.0, m.first_on), noted(t, turned, 2.0, m.first_off), noted(t, turned, 3.0, m.second_on)
    return s, Memory(firing, turned, *times)


@physics
def observe(t, s, m, p, o):
    """The lag's output."""
    return State(s.filtered)


@physics
def evaluate(t, s, m, p, o, best, when):
    """Time of the first pulse, its length, and that of the pause after it."""
    return Metrics(m.first_on, m.first_off - m.first_on, m.second_on - m.first_off)


MODEL = Model(
    name="constant_command",
    title="Pulse modulator under a constant command",
    source="M. J. Sidi, Spacecraft Dynamics and Control (1997), section 9.3",
    parameters=(
        Parameter("command_n", "N", "commanded force", 20.0),
        Parameter("gain", "", "gain on command and output", 1.0),
        Parameter("level_n", "N", "force of the thruster", 30.0),
        Parameter("on_n", "N", "lag output that switches the thruster on", 10.0),
        Parameter("off_n", "N", "lag output that switches it off again", 5.0),
        Parameter("time_constant_s", "s", "time constant of the lag", 5.0),
    ),
    settings=(),
    states=(Field("filtered_n", "N", "output of the lag"),),
    quantities=(Field("filtered_n", "N", "output of the lag"),),
    metrics=(
        Field("first_on_s", "s", "start of the first pulse"),
        Field("pulse_s", "s", "length of the first pulse"),
        Field("pause_s", "s", "pause after the first pulse"),
    ),
    clock=FixedStep(0.1, 12.0),
    kernel_parameters=Parameters,
    initial=initial,
    start=start,
    rhs=rhs,
    events=events,
    switch=switch,
    event_list=(
        Event("pulse_on", "rising", "switch"),
        Event("pulse_off", "falling", "switch"),
    ),
    observe=observe,
    evaluate=evaluate,
)
