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
# What `prepare` gives: at the first ignition; of the engine; ignition: nominal time of the burn plus its delay, after
# the first [s]; pitch, yaw: tangents of the pointing errors; the inputs that are used as they are.  SI.
Parameters = namedtuple(
    "Parameters",
    "x y z vx vy vz mass thrust flow tail ignition_2 ignition_3 pitch_1 pitch_2 pitch_3 yaw_1 yaw_2 yaw_3 "
    "ignition_delay_1 ignition_delay_2 ignition_delay_3 accelerometer_scale_error "
    "navigation_position_r navigation_position_t navigation_position_n "
    "navigation_velocity_r navigation_velocity_t navigation_velocity_n",
)
# The segment that is flown.  end [s];  middle, rate: of the steering's argument s, from -1 to 1 over the segment
Arc = namedtuple("Arc", "steering end middle rate")
# burn, segment: counted from 0;  until: time at which the phase ends [s];  mass_ignited [kg];  pitch, yaw: of the burn
# ignited, burn_out_1, burn_out_2: times so far [s]
Memory = namedtuple(
    "Memory",
    "arc aim phase burn segment until mass_ignited pitch yaw ignited burn_out_1 burn_out_2",
    defaults=(0.0, 0.0, 0.0),
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
def _past_command(t, s, m, p, o):
    """Time [s] past the one at which a burn is shut down; by sensed velocity, speed change [m/s] past the commanded.

    The accelerometer counts the speed change since ignition: by the rocket equation.
    """
    if o.shutdown == CHOICES.shutdown.sensed_velocity:
        scale = (1.0 + p.accelerometer_scale_error) * (p.thrust / p.flow)
        return scale * log(maximum(m.mass_ignited / s.mass, 1e-300)) - m.aim.sensed
    return t - m.until


@physics
def _is_last(m, o):
    return m.burn + 1.0 >= nominal(o.tables).burns


@physics
def ignition(t, m):
    """Time [s] past the end of a coast."""
    return where(m.phase == COAST, t - m.until, NEVER)


@physics
def next_segment(t, m):
    """Time [s] past the end of a segment of a long burn."""
    return where(m.phase == BURN, t - m.arc.end, NEVER)


@physics
def shut_down(t, s, m, p, o):
    """Past the command, as `_past_command`, that does not end the flight."""
    goes_on = (m.phase == BURN) & ((not _is_last(m, o)) | (p.tail > 0.0))
    return where(goes_on, _past_command(t, s, m, p, o), NEVER)


@physics
def burn_out(t, m, o):
    """Time [s] past the end of a tail-off that does not end the flight."""
    return where((m.phase == TAIL) & (not _is_last(m, o)), t - m.until, NEVER)


@physics
def injected(t, s, m, p, o):
    """Past the end of the last burn: of its tail-off [s] or, without one, the command, as `_past_command`."""
    at_command, after_tail = (m.phase == BURN) & (p.tail <= 0.0), m.phase == TAIL
    past = where(at_command, _past_command(t, s, m, p, o), where(after_tail, t - m.until, NEVER))
    return where(_is_last(m, o), past, NEVER)


EVENTS = {
    "ignite": Event(ignition, "rising", "switch"),
    "next_segment": Event(next_segment, "rising", "switch", rare=True),
    "shut_down": Event(shut_down, "rising", "switch"),
    "burn_out": Event(burn_out, "rising", "switch", rare=True),
    "injected": Event(injected, "rising", "stop"),
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
        burn=0.0,
        segment=0.0,
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
