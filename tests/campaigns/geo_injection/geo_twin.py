"""An independent flight of a burn program: SciPy's integrator, plain vectors, one case after another."""

import numpy as np
import pytest
from geo_sequences import FLOW, MASS, MU, THRUST
from numpy.polynomial import polynomial
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

EXACT = {"rtol": 1e-12, "atol": 1e-9, "method": "DOP853"}
ONE_METRE, TENTH_OF_A_MILLIMETRE_A_SECOND = 1.0, 1e-4


def ends(row):
    """State [7] at the end of a flown case, to compare with that of `fly_twin`."""
    return np.array([row[f"end_{name}"] for name in ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "mass_kg")])


def assert_same(ours, twin):
    assert ours[:3] == pytest.approx(twin[:3], abs=ONE_METRE)
    assert ours[3:6] == pytest.approx(twin[3:6], abs=TENTH_OF_A_MILLIMETRE_A_SECOND)
    assert ours[6] == pytest.approx(twin[6], abs=1e-6)


def _direction(burn, since, pitch_deg, yaw_deg):
    """Thrust direction a time after ignition, with pointing errors as the README defines them."""
    segment = next((one for one in burn.segments if since <= one.start_s + one.length_s), burn.segments[-1])
    s = 2.0 * (since - segment.start_s) / segment.length_s - 1.0
    d = polynomial.polyval(s, np.transpose([segment.x, segment.y, segment.z]))
    d = d / np.linalg.norm(d)
    e1 = np.cross([0.0, 0.0, 1.0], d)
    e1 = e1 / np.linalg.norm(e1)
    d = d + np.tan(np.radians(pitch_deg)) * e1 + np.tan(np.radians(yaw_deg)) * np.cross(d, e1)
    return d / np.linalg.norm(d)


def _gravity(y):
    return -MU * y[:3] / np.linalg.norm(y[:3]) ** 3


def _coasted(y, dt):
    if dt == 0.0:
        return y
    return solve_ivp(lambda t, y: [*y[3:6], *_gravity(y), 0.0], (0.0, dt), y, **EXACT).y[:, -1]


def fly_twin(program, *, tail_s=0.0, tail_nominal_s=0.0, sensed=False, **errors):
    """State [7] at the last burn-out.  errors : dispersions by column name, of which the rest are nominal."""
    get = errors.get
    thrust = THRUST * get("thrust_factor", 1.0)
    flow = FLOW * get("thrust_factor", 1.0) / get("isp_factor", 1.0)
    r, v = np.reshape(program.start, (2, 3))
    normal = np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    axes = np.array([r / np.linalg.norm(r), np.cross(normal, r / np.linalg.norm(r)), normal])
    place = r + sum(get(f"initial_position_{one}_m", 0.0) * axis for one, axis in zip("rtn", axes, strict=True))
    speed = v + sum(get(f"initial_velocity_{one}_m_s", 0.0) * axis for one, axis in zip("rtn", axes, strict=True))
    y, clock = np.array([*place, *speed, MASS * get("initial_mass_factor", 1.0)]), 0.0
    mass_nominal = MASS
    for k, burn in enumerate(program.burns, start=1):
        ignition = burn.ignition_s + get(f"ignition_delay_{k}_s", 0.0)
        y = _coasted(y, ignition - clock)
        pitch = get("pitch_error_deg", 0.0) + get(f"pitch_error_{k}_deg", 0.0)
        yaw = get("yaw_error_deg", 0.0) + get(f"yaw_error_{k}_deg", 0.0)
        length = burn.duration_s - 0.5 * tail_nominal_s
        end_nominal = mass_nominal - FLOW * burn.duration_s
        if sensed:
            exhaust = THRUST / FLOW
            wanted = exhaust * np.log(mass_nominal / end_nominal)
            wanted -= exhaust * np.log(1.0 + 0.5 * FLOW * tail_nominal_s / end_nominal)
            scale = 1.0 + get("accelerometer_scale_error", 0.0)

            def missing(length, m0=y[6], wanted=wanted, scale=scale):
                return scale * thrust / flow * np.log(m0 / (m0 - flow * length)) - wanted

            length = brentq(missing, 1.0, 1.5 * burn.duration_s, xtol=1e-12)

        def powered(t, y, burn=burn, pitch=pitch, yaw=yaw, length=length):
            level = 1.0 if t < length or tail_s == 0.0 else 1.0 - (t - length) / tail_s
            push = level * thrust / y[6] * _direction(burn, t, pitch, yaw)
            return [*y[3:6], *(_gravity(y) + push), -level * flow]

        y = solve_ivp(powered, (0.0, length), y, **EXACT).y[:, -1]
        if tail_s > 0.0:
            y = solve_ivp(powered, (length, length + tail_s), y, **EXACT).y[:, -1]
        clock = ignition + length + tail_s
        mass_nominal = end_nominal
    return y
