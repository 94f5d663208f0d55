"""The right-hand sides of the benchmark problems as an equation for any kind of number.

`lib` gives sqrt and exp: `math` for floats (scipy), `numpy` for arrays of 80-bit numbers (the reference), `heyoka` for
expressions.  Written apart from the models and from `lanes.cpp`, so that equal results mean equal physics.  SI.

Powers of r2 are asked for as powers: a Taylor integrator pays for each product, and a power costs it no more.
"""

from mc_engine.physics.constants import EARTH_RATE, EQUATORIAL_RADIUS, J2_EARTH, MU_EARTH
from tests.benchmarks.models.entry_physics import AIR as ENTRY_AIR
from tests.benchmarks.models.entry_physics import RADIUS, STOP_ALTITUDE

_J2_FACTOR = 1.5 * J2_EARTH * MU_EARTH * EQUATORIAL_RADIUS**2


def two_body(lib, s, p):
    """Derivative of (x, y, z, vx, vy, vz) by a point mass.  No parameters."""
    x, y, z, vx, vy, vz = s
    g = -MU_EARTH * (x**2 + y**2 + z**2) ** -1.5
    return [vx, vy, vz, g * x, g * y, g * z]


def oblate(lib, s, p):
    """Derivative by a point mass and J2.  No parameters.

    Curtis, Orbital Mechanics for Engineering Students, 3rd ed., eq. (12.30).
    """
    x, y, z, vx, vy, vz = s
    a, b = _gravity(x**2 + y**2 + z**2, z)
    return [vx, vy, vz, a * x, a * y, b * z]


def _gravity(r2, z):
    """Factors of (x, y) and of z in the acceleration by a point mass and J2."""
    u2, u3 = r2**-1.0, r2**-1.5
    q = _J2_FACTOR * u2 * u3
    a = q * (5.0 * z**2 * u2 - 1.0) - MU_EARTH * u3
    return a, a - 2.0 * q


def dragged(air):
    """Derivative by a point mass, J2, and drag in one exponential layer that turns with the Earth.

    air : reference density [kg/m^3], its altitude and the scale height [m].  Parameter: -0.5 / ballistic coefficient.
    """
    density, altitude, scale = air

    def rate(lib, s, p):
        x, y, z, vx, vy, vz = s
        r2 = x**2 + y**2 + z**2
        a, b = _gravity(r2, z)
        ux, uy = vx + EARTH_RATE * y, vy - EARTH_RATE * x
        rho = density * lib.exp((EQUATORIAL_RADIUS + altitude - lib.sqrt(r2)) / scale)
        d = p[0] * rho * lib.sqrt(ux**2 + uy**2 + vz**2)
        return [vx, vy, vz, a * x + d * ux, a * y + d * uy, b * z + d * vz]

    return rate


def entry(lib, s, p):
    """Derivative by a point mass, drag and lift.  Parameters: half drag, upward and sideward lift over mass [m^2/kg].

    Drag and lift are in air of 1 kg/m^3, so the parameters are in 1/m.
    """
    x, y, z, vx, vy, vz = s
    density, altitude, scale = ENTRY_AIR
    r2 = x**2 + y**2 + z**2
    g = -MU_EARTH * r2**-1.5
    speed = lib.sqrt(vx**2 + vy**2 + vz**2)
    thrust = density * lib.exp((RADIUS + altitude - lib.sqrt(r2)) / scale) * speed
    hx, hy, hz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    lift = thrust * (hx**2 + hy**2 + hz**2) ** -0.5
    d, up, aside = p[0] * thrust, p[1] * lift, p[2] * lift * speed
    return [
        vx,
        vy,
        vz,
        g * x - d * vx + up * (vy * hz - vz * hy) - aside * hx,
        g * y - d * vy + up * (vz * hx - vx * hz) - aside * hy,
        g * z - d * vz + up * (vx * hy - vy * hx) - aside * hz,
    ]


def ballistic(lib, s, p):
    """Derivative by a point mass and drag.  Parameter: half drag over mass, as in `entry`."""
    x, y, z, vx, vy, vz = s
    density, altitude, scale = ENTRY_AIR
    r2 = x**2 + y**2 + z**2
    g = -MU_EARTH * r2**-1.5
    speed = lib.sqrt(vx**2 + vy**2 + vz**2)
    d = p[0] * density * lib.exp((RADIUS + altitude - lib.sqrt(r2)) / scale) * speed
    return [vx, vy, vz, g * x - d * vx, g * y - d * vy, g * z - d * vz]


def entry_height(lib, s):
    """Height over the end of an entry [m], of which the fall through zero is sought."""
    x, y, z = s[0], s[1], s[2]
    return lib.sqrt(x**2 + y**2 + z**2) - (RADIUS + STOP_ALTITUDE)
