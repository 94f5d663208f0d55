"""Flight of the upper stage: a point mass under inverse-square gravity; burns, tail-offs and coasts by events.

Inertial axes, x to the ascending node of the nominal parking orbit, z to the north pole, SI.  The clock begins at the
first ignition of each case.  Thrust is of constant size and points as the burn program says, apart from pointing
errors; the program runs from the actual ignition of each burn.
"""

from collections import namedtuple

from campaigns.geo_injection.aiming import next_aim, of_burn, stored, turned
from campaigns.geo_injection.inputs import CHOICES
from campaigns.geo_injection.program_table import burn_row, nominal, segment_row
from mc_engine.lanes import any_lane, fma, log, maximum, minimum, physics, sqrt, where
from mc_engine.model import Event, states
from mc_engine.physics.constants import MU_EARTH
from mc_engine.physics.gravity import point_mass
from mc_engine.physics.vectors import Vector

State = states(
    **{f"{axis}_m": f"inertial place, {axis}" for axis in "xyz"},
    **{f"v{axis}_m_s": f"inertial velocity, {axis}" for axis in "xyz"},
    mass_kg="mass",
)
# The segment that is flown.  end [s];  middle, rate: of the steering's argument s, from -1 to 1 over the segment
Arc = namedtuple("Arc", "steering end middle rate")
# next_segment: of a long burn;  burn_out: of a tail-off that does not end the flight
Crossings = namedtuple("Crossings", "ignite next_segment shut_down burn_out injected")
# burn, segment: counted from 0;  until: time at which the phase ends [s];  mass_ignited [kg];  pitch, yaw: of the burn
# ignited, burn_out_1, burn_out_2: times so far [s]
Memory = namedtuple(
    "Memory",
    "arc aim phase until mass_ignited pitch yaw burn segment ignited burn_out_1 burn_out_2",
    defaults=(0.0, 0.0, 0.0, 0.0, 0.0),
)

COAST, BURN, TAIL = 0.0, 1.0, 2.0
NEVER = -1.0  # value of an event that is not looked for


@physics
def initial(p):
    """State at the actual first ignition."""
    return State(x=p.x, y=p.y, z=p.z, vx=p.vx, vy=p.vy, vz=p.vz, mass=p.mass)


@physics
def _polynomial(s, c):
    """Horner's rule."""
    top = fma(fma(fma(fma(fma(c.c11, s, c.c10), s, c.c9), s, c.c8), s, c.c7), s, c.c6)
    return fma(fma(fma(fma(fma(fma(top, s, c.c5), s, c.c4), s, c.c3), s, c.c2), s, c.c1), s, c.c0)


@physics
def direction(t, m):
    """Unit vector of the thrust: the program's, turned by the pointing errors.

    d' = unit(d + tan(pitch) e1 + tan(yaw) e2) with e1 = unit(Z x d), e2 = d x e1 and Z the pole.

    Derived here from |d| = 1: e1 = (-y, x, 0) / level and e2 = (-z x, -z y, level^2) / level, no unit.
    """
    s, c = (t - m.arc.middle) * m.arc.rate, m.arc.steering
    x, y, z = _polynomial(s, c.x), _polynomial(s, c.y), _polynomial(s, c.z)
    inverse = 1.0 / sqrt(maximum(x * x + y * y + z * z, 1e-300))
    x, y, z = x * inverse, y * inverse, z * inverse
    level = sqrt(maximum(x * x + y * y, 1e-300))  # of a thrust along the pole no pitch is told from yaw
    a, b = m.pitch / level, m.yaw / level
    unit = 1.0 / sqrt(1.0 + m.pitch * m.pitch + m.yaw * m.yaw)
    return Vector((x - a * y - b * z * x) * unit, (y + a * x - b * z * y) * unit, (z + b * level * level) * unit)


@physics
def level_of(t, m, p):
    """Thrust over its full size, no unit: 1 in a burn, falling linearly in time in a tail-off."""
    falling = maximum(m.until - t, 0.0) / where(p.tail > 0.0, p.tail, 1.0)
    return where(m.phase == BURN, 1.0, where(m.phase == TAIL, falling, 0.0))


@physics
def rhs(t, s, m, p):
    """Time derivative of the state: eq. (1) of the source."""
    ax, ay, az = point_mass(s.x, s.y, s.z, MU_EARTH)
    flow = 0.0
    if any_lane(m.phase > COAST):
        level, to = level_of(t, m, p), direction(t, m)
        push = level * p.thrust / s.mass
        ax, ay, az = ax + push * to.x, ay + push * to.y, az + push * to.z
        flow = -p.flow * level
    return State(x=s.vx, y=s.vy, z=s.vz, vx=ax, vy=ay, vz=az, mass=flow)


@physics
def crossings(t, s, m, p, o):
    """What rises through zero at the events, `NEVER` where it is not looked for: times [s] past what is due.

    By sensed velocity a burn is shut down where the speed change [m/s] that the accelerometer has counted since
    ignition is the commanded one: by the rocket equation.
    """
    late = t - m.until
    commanded = late
    if o.shutdown == CHOICES.shutdown.sensed_velocity:
        scale = (1.0 + p.accelerometer_scale_error) * (p.thrust / p.flow)
        commanded = scale * log(maximum(m.mass_ignited / s.mass, 1e-300)) - m.aim.sensed
    burning, in_tail, has_tail = m.phase == BURN, m.phase == TAIL, p.tail > 0.0
    is_last = m.burn + 1.0 >= nominal(o.tables).burns
    end = where(burning & (not has_tail), commanded, where(in_tail, late, NEVER))
    return Crossings(
        ignite=where(m.phase == COAST, late, NEVER),
        next_segment=where(burning, t - m.arc.end, NEVER),
        shut_down=where(burning & ((not is_last) | has_tail), commanded, NEVER),
        burn_out=where(in_tail & (not is_last), late, NEVER),
        injected=where(is_last, end, NEVER),
    )


EVENTS = {
    "ignite": Event(crossings, "rising", "switch"),
    "next_segment": Event(crossings, "rising", "switch", rare=True),
    "shut_down": Event(crossings, "rising", "switch"),
    "burn_out": Event(crossings, "rising", "switch", rare=True),
    "injected": Event(crossings, "rising", "stop"),
}


@physics
def _arc(segment, ignited, aim, o):
    """The arc of a segment of a burn that was ignited at a time [s]."""
    row, steering = segment_row(o.tables, segment)
    if o.guidance == CHOICES.guidance.re_aimed:
        steering = turned(steering, aim, o)
    half = 0.5 * row.length * aim.stretch
    after = ignited + row.start * aim.stretch
    end = where(row.more > 0.5, after + 2.0 * half, 1e300)
    return Arc(steering=steering, end=end, middle=after + half, rate=1.0 / half)


@physics
def start(p, o):
    """Memory at the first ignition, SI; the command is due half a tail-off before the nominal duration is over."""
    aim = stored(0.0, p, o)
    return Memory(
        arc=_arc(0.0, 0.0, aim, o),
        aim=aim,
        phase=BURN,
        until=burn_row(o.tables, 0.0).duration - 0.5 * o.tail_off,
        mass_ignited=p.mass,
        pitch=p.pitch_1,
        yaw=p.yaw_1,
    )


@physics
def switch(t, s, m, p, o, hit):
    """The phase that follows an event, and when it ends [s]."""
    ignite, shut = hit.ignite > 0.5, hit.shut_down > 0.5
    to_tail = shut & (p.tail > 0.0)
    to_coast = (hit.burn_out > 0.5) | (shut & (p.tail <= 0.0))
    following = minimum(m.burn + 1.0, nominal(o.tables).burns - 1.0)
    row, new = burn_row(o.tables, following), next_aim(t, s, following, p, o)
    aim = where(to_coast, new, m.aim)  # that of the next burn is kept from the start of the coast on
    burn = where(ignite, following, m.burn)
    segment = where(ignite, row.first, where(hit.next_segment > 0.5, m.segment + 1.0, m.segment))
    ignited = where(ignite, t, m.ignited)
    burnt = t + (row.duration * aim.stretch - 0.5 * o.tail_off)
    return s, Memory(
        arc=_arc(segment, ignited, aim, o),
        aim=aim,
        phase=where(ignite, BURN, where(to_tail, TAIL, where(to_coast, COAST, m.phase))),
        burn=burn,
        segment=segment,
        until=where(ignite, burnt, where(to_tail, t + p.tail, where(to_coast, new.ignition, m.until))),
        mass_ignited=where(ignite, s.mass, m.mass_ignited),
        pitch=of_burn(burn, p.pitch_1, p.pitch_2, p.pitch_3),
        yaw=of_burn(burn, p.yaw_1, p.yaw_2, p.yaw_3),
        ignited=ignited,
        burn_out_1=where(to_coast & (m.burn < 0.5), t, m.burn_out_1),
        burn_out_2=where(to_coast & (m.burn > 0.5), t, m.burn_out_2),
    )
