"""Flight of the upper stage: a point mass under inverse-square gravity; burns, tail-offs and coasts by events.

Inertial axes, x to the ascending node of the nominal parking orbit, z to the north pole, SI.  The clock begins at the
first ignition of each case.  Thrust is of constant size and points as the burn program says, apart from pointing
errors; the program runs from the actual ignition of each burn.
"""

from collections import namedtuple

from campaigns.geo_injection.aiming import Aim, aimed, known, stored, turned
from campaigns.geo_injection.program_table import TERM_NAMES, burn_row, n_burns, segment_row, steering_row
from mc_engine.lanes import any_lane, fma, log, maximum, minimum, physics, sqrt, where
from mc_engine.physics.constants import MU_EARTH
from mc_engine.physics.gravity import point_mass

State = namedtuple("State", "x y z vx vy vz mass")  # m, m/s, kg
# steering of the segment; phase; burn and segment, counted from 0; until: time at which the phase ends [s];
# segment_end [s]; middle, rate: of the steering's argument s; mass_ignited [kg]; sensed: speed change at which a burn
# is shut down [m/s]; what re-aims the last burn (its thrust direction, stretch of its duration); tangents of the
# pointing errors; time of the last ignition and burn-out times so far [s]
Memory = namedtuple(  # type: ignore[misc]
    "Memory",
    (
        *TERM_NAMES,
        "phase", "burn", "segment", "until", "segment_end", "middle", "rate", "mass_ignited", "sensed",
        "aim_x", "aim_y", "aim_z", "stretch", "pitch", "yaw", "ignited", "burn_out_1", "burn_out_2",
    ),
)  # fmt: skip
Parameters = namedtuple(
    "Parameters",
    "x y z vx vy vz mass thrust flow ignition_2 ignition_3 delay_2 delay_3 delay_1 "
    "pitch_1 pitch_2 pitch_3 yaw_1 yaw_2 yaw_3 tail accelerometer "
    "known_r known_t known_n known_vr known_vt known_vn",
)
Events = namedtuple("Events", "ignite next_segment shut_down burn_out injected")
Forward = namedtuple("Forward", "x y z size")

COAST, BURN, TAIL = 0.0, 1.0, 2.0
BY_TIME = 0.0
OPEN_LOOP = 0.0
NEVER = -1.0  # value of an event that is not looked for


@physics
def initial(p, o):
    """State at the actual first ignition."""
    return State(p.x, p.y, p.z, p.vx, p.vy, p.vz, p.mass)


@physics
def _polynomial(s, c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11):
    """Horner's rule."""
    top = fma(fma(fma(fma(fma(c11, s, c10), s, c9), s, c8), s, c7), s, c6)
    return fma(fma(fma(fma(fma(fma(top, s, c5), s, c4), s, c3), s, c2), s, c1), s, c0)


@physics
def direction(t, m):
    """Unit vector of the thrust: the program's, turned by the pointing errors.

    d' = unit(d + tan(pitch) e1 + tan(yaw) e2) with e1 = unit(Z x d), e2 = d x e1 and Z the pole.

    Derived here from |d| = 1: e1 = (-y, x, 0) / level and e2 = (-z x, -z y, level^2) / level, no unit.
    """
    s = (t - m.middle) * m.rate
    x = _polynomial(s, m.x0, m.x1, m.x2, m.x3, m.x4, m.x5, m.x6, m.x7, m.x8, m.x9, m.x10, m.x11)
    y = _polynomial(s, m.y0, m.y1, m.y2, m.y3, m.y4, m.y5, m.y6, m.y7, m.y8, m.y9, m.y10, m.y11)
    z = _polynomial(s, m.z0, m.z1, m.z2, m.z3, m.z4, m.z5, m.z6, m.z7, m.z8, m.z9, m.z10, m.z11)
    inverse = 1.0 / sqrt(maximum(x * x + y * y + z * z, 1e-300))
    x, y, z = x * inverse, y * inverse, z * inverse
    level = sqrt(maximum(x * x + y * y, 1e-300))  # of a thrust along the pole no pitch is told from yaw
    a, b = m.pitch / level, m.yaw / level
    unit = 1.0 / sqrt(1.0 + m.pitch * m.pitch + m.yaw * m.yaw)
    return (x - a * y - b * z * x) * unit, (y + a * x - b * z * y) * unit, (z + b * level * level) * unit


@physics
def level_of(t, m, p):
    """Thrust over its full size, no unit: 1 in a burn, falling linearly in time in a tail-off."""
    falling = maximum(m.until - t, 0.0) / where(p.tail > 0.0, p.tail, 1.0)
    return where(m.phase == BURN, 1.0, where(m.phase == TAIL, falling, 0.0 * t))


@physics
def push_of(t, s, m, p):
    """Acceleration by thrust [m/s^2] with its components."""
    level = level_of(t, m, p)
    size = level * p.thrust / s.mass
    dx, dy, dz = direction(t, m)
    return Forward(size * dx, size * dy, size * dz, size)


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state: eq. (1) of the source."""
    gx, gy, gz = point_mass(s.x, s.y, s.z, MU_EARTH)
    flow = 0.0 * s.mass
    if any_lane(m.phase > COAST):
        push = push_of(t, s, m, p)
        gx, gy, gz = gx + push.x, gy + push.y, gz + push.z
        flow = -p.flow * level_of(t, m, p)
    return State(s.vx, s.vy, s.vz, gx, gy, gz, flow)


@physics
def _counted(s, m, p):
    """Speed change [m/s] that the accelerometer has counted since ignition, by the rocket equation."""
    return (1.0 + p.accelerometer) * (p.thrust / p.flow) * log(maximum(m.mass_ignited / s.mass, 1e-300))


@physics
def events(t, s, m, p, o):
    """Ignition, the next segment of a long burn, shut-down command, end of a tail-off, end of the flight.

    Times [s] past the due time, or, for shut-down by sensed velocity, speed change [m/s] past the one commanded.
    """
    never = NEVER + 0.0 * t
    coasting, burning, falling = m.phase == COAST, m.phase == BURN, m.phase == TAIL
    last = m.burn + 1.0 >= n_burns(o.tables)
    left = t - m.until
    shut = left
    if o.shutdown > BY_TIME:
        shut = _counted(s, m, p) - m.sensed
    ends_here = burning & last & (p.tail <= 0.0)
    ended = falling & last
    return Events(
        where(coasting, left, never),
        where(burning, t - m.segment_end, never),
        where(ends_here, never, where(burning, shut, never)),
        where(ended, never, where(falling, left, never)),
        where(ends_here, shut, where(ended, left, never)),
    )


@physics
def _of_burn(burn, first, second, third):
    """The value that belongs to a burn, counted from 0, in its own unit."""
    return where(burn < 0.5, first, where(burn < 1.5, second, third))


@physics
def _memory(phase, burn, segment, until, ignited, mass_ignited, sensed, aim, out_1, out_2, p, o):
    """Memory with the steering of the segment, SI; the steering's argument s goes from -1 to 1 over the segment."""
    row = segment_row(o.tables, segment)
    c = steering_row(o.tables, segment)
    if o.guidance > OPEN_LOOP:
        c = turned(c, aim, o)
    half = 0.5 * row.length * aim.stretch
    after = ignited + row.start * aim.stretch
    end = where(row.more > 0.5, after + 2.0 * half, 1e300)
    pitch, yaw = _of_burn(burn, p.pitch_1, p.pitch_2, p.pitch_3), _of_burn(burn, p.yaw_1, p.yaw_2, p.yaw_3)
    return Memory(
        x0=c[0], x1=c[1], x2=c[2], x3=c[3], x4=c[4], x5=c[5], x6=c[6], x7=c[7], x8=c[8], x9=c[9], x10=c[10], x11=c[11],
        y0=c[12], y1=c[13], y2=c[14], y3=c[15], y4=c[16], y5=c[17], y6=c[18], y7=c[19], y8=c[20], y9=c[21], y10=c[22],
        y11=c[23],
        z0=c[24], z1=c[25], z2=c[26], z3=c[27], z4=c[28], z5=c[29], z6=c[30], z7=c[31], z8=c[32], z9=c[33], z10=c[34],
        z11=c[35],
        phase=phase, burn=burn, segment=segment, until=until, segment_end=end, middle=after + half, rate=1.0 / half,
        mass_ignited=mass_ignited, sensed=sensed, aim_x=aim.x, aim_y=aim.y, aim_z=aim.z, stretch=aim.stretch,
        pitch=pitch, yaw=yaw, ignited=ignited, burn_out_1=out_1, burn_out_2=out_2,
    )  # fmt: skip


@physics
def _commanded(burn, sensed, p, o):
    """Speed change [m/s] at which the command is due, so that a nominal tail-off makes up for the rest.

    Derived here: the flow falls linearly, so a tail-off spends half of flow times its duration; rocket equation.
    """
    end = burn_row(o.tables, burn).end_mass
    return sensed - o.thrust / o.mass_flow * log(1.0 + 0.5 * o.mass_flow * o.tail_off / end)


@physics
def start(p, o):
    """Memory at the first ignition, SI; the command is due half a tail-off before the nominal duration is over."""
    zero = 0.0 * p.mass
    row, aim = burn_row(o.tables, zero), stored(zero, o)
    sensed = _commanded(zero, row.sensed, p, o)
    until = row.duration - 0.5 * o.tail_off
    return _memory(BURN + zero, zero, zero, until, zero, p.mass, sensed, aim, zero, zero, p, o)


@physics
def _next_aim(t, s, burn, p, o):
    """The aim [1, m/s, s] of the next burn, as a coast begins: as stored, or of the last burn, if guided, aimed now."""
    zero = 0.0 * t
    kept = stored(burn, o)
    ignition = where(burn < 1.5, p.ignition_2, p.ignition_3)
    x, y, z, stretch, sensed = kept.x, kept.y, kept.z, kept.stretch, kept.sensed
    if o.guidance > OPEN_LOOP:
        new = aimed(t, known(s, p), burn, o)
        last = burn + 1.0 >= n_burns(o.tables)
        x, y, z = where(last, new.x, x), where(last, new.y, y), where(last, new.z, z)
        stretch, sensed = where(last, new.stretch, stretch), where(last, new.sensed, sensed)
        delay = where(burn < 1.5, p.delay_2, p.delay_3)
        ignition = where(last, maximum(new.ignition + delay, t), ignition)
    return Aim(x + zero, y + zero, z + zero, stretch + zero, sensed + zero, ignition + zero)


@physics
def switch(t, s, m, p, o, hit):
    """The phase that follows an event, and when it ends [s]."""
    ignite, segment = hit.ignite > 0.5, hit.next_segment > 0.5
    shut, over = hit.shut_down > 0.5, hit.burn_out > 0.5
    to_tail = shut & (p.tail > 0.0)
    to_coast = over | (shut & (p.tail <= 0.0))
    phase = where(ignite, BURN, where(to_tail, TAIL, where(to_coast, COAST, m.phase)))
    n = n_burns(o.tables)
    following = minimum(m.burn + 1.0, n - 1.0)
    burn = where(ignite, following, m.burn)
    row = burn_row(o.tables, following)
    new = _next_aim(t, s, following, p, o)
    # the aim of the next burn is kept from the start of the coast on
    aim = Aim(
        where(to_coast, new.x, m.aim_x),
        where(to_coast, new.y, m.aim_y),
        where(to_coast, new.z, m.aim_z),
        where(to_coast, new.stretch, m.stretch),
        0.0,
        0.0,
    )
    sensed = where(to_coast, _commanded(following, new.sensed, p, o), m.sensed)
    duration = row.duration * aim.stretch - 0.5 * o.tail_off
    until = where(ignite, t + duration, where(to_tail, t + p.tail, where(to_coast, new.ignition, m.until)))
    out_1 = where(to_coast & (m.burn < 0.5), t, m.burn_out_1)
    out_2 = where(to_coast & (m.burn > 0.5), t, m.burn_out_2)
    return s, _memory(
        phase,
        burn,
        where(ignite, row.first, where(segment, m.segment + 1.0, m.segment)),
        until,
        where(ignite, t, m.ignited),
        where(ignite, s.mass, m.mass_ignited),
        sensed,
        aim,
        out_1,
        out_2,
        p,
        o,
    )
