"""A falling stone whose discrete state holds records: a brake, and the last two samples.  It bounces once."""

from typing import NamedTuple

from mc_engine.lanes import physics, replace, where
from mc_engine.model import Event, FixedStep, Parameter, at_end, inputs, metrics, model, outputs, states

Inputs = inputs(lift_m_s2=Parameter(0.0, "acceleration upwards"))
State = states(x_m="height", v_m_s="speed")
Outputs = outputs(height_m="height", braked_m_s2="brake", sampled_m="height at the last sample", last_s="its time",
                  earlier_s="time of the sample before", bounce_s="time of the bounce")  # fmt: skip
Metrics = metrics(height_m=at_end("height_m", "height"), braked_m_s2=at_end("braked_m_s2", "brake"),
                  sampled_m=at_end("sampled_m", "sample"), last_s=at_end("last_s", "its time"),
                  earlier_s=at_end("earlier_s", "time before"), bounce_s=at_end("bounce_s", "bounce"))  # fmt: skip


class Sample(NamedTuple):
    """A height and its time."""

    height: float = -1.0
    time: float = -2.0


class Memory(NamedTuple):
    """Two samples, the brake, and when the stone bounced."""

    last: Sample = Sample()
    earlier: Sample = Sample()
    brake: float = 0.0
    bounce: float = float("nan")


@physics
def initial():
    return State(x=10.0, v=0.0)


@physics
def rhs(s, m, p):
    return State(x=s.v, v=p.lift - 9.0 + m.brake)


@physics
def control(t, s, m):
    m = replace(m, earlier=m.last, last=Sample(height=s.x, time=t))
    return where(s.x < 5.0, replace(m, brake=-0.1 * s.v), m)


@physics
def height(s):
    return s.x


@physics
def switch(t, s, m, hit):
    return where(hit.ground > 0.5, replace(s, v=-0.5 * s.v), s), replace(m, bounce=t)


@physics
def observe(s, m):
    return Outputs(height=s.x, braked=m.brake, sampled=m.last.height, last=m.last.time, earlier=m.earlier.time,
                   bounce=m.bounce)  # fmt: skip


MODEL = model(
    name="kept_records", title="A stone that keeps records", inputs=Inputs, states=State, outputs=Outputs,
    metrics=Metrics, clock=FixedStep(0.1, 2.0, control_every=5), initial=initial, rhs=rhs, memory=Memory,
    control=control, switch=switch, observe=observe, events={"ground": Event(height, "falling", "switch")},
)  # fmt: skip
