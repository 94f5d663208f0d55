"""A slow, obvious de-orbit flight to hold the compiled one against.

Absolute inertial coordinates instead of deviations, the path from the vectors of the entry state instead of
eqs (11)-(17), the desired place from Kepler's equation, and SciPy's eighth-order steps with their own error
control.  It shares no code with the campaign; inputs are the campaign's columns, in declared units.
"""

from itertools import count

import numpy as np
from scipy.integrate import solve_ivp

MU, G0 = 3.986004418e14, 9.80665
J2, R_EQUATOR, EARTH_SPIN = 1.08262668e-3, 6378136.3, 7.292115e-5
# Vallado, 4th ed., Table 8-4, the layers met between 100 and 300 km: base [km], density there, scale height [km]
LAYERS = [
    (100, 5.297e-7, 5.877),
    (110, 9.661e-8, 7.263),
    (120, 2.438e-8, 9.473),
    (130, 8.484e-9, 12.636),
    (140, 3.845e-9, 16.149),
    (150, 2.070e-9, 22.523),
    (180, 5.464e-10, 29.740),
    (200, 2.789e-10, 37.105),
    (250, 7.248e-11, 45.546),
]


class Path:
    """The desired ellipse, from the vectors of the entry state in its own plane (x to the node)."""

    def __init__(self, i):
        theta, gamma = np.radians(i["target_latitude_argument_deg"]), np.radians(i["target_flight_path_angle_deg"])
        out, ahead = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
        r, v = 1e3 * i["target_radius_km"], i["target_speed_m_s"]
        velocity = v * (np.cos(gamma) * ahead - np.sin(gamma) * out)
        h = r * v * np.cos(gamma)
        to_perigee = h * np.array([velocity[1], -velocity[0]]) / MU - out
        self.e, self.omega = np.hypot(*to_perigee), np.arctan2(to_perigee[1], to_perigee[0])
        self.p = h * h / MU
        self.a = self.p / (1.0 - self.e**2)
        self.mean_motion = np.sqrt(MU / self.a**3)
        self.r_burn = 1e3 * i["initial_semi_major_axis_km"]
        f = np.arccos((self.p / self.r_burn - 1.0) / self.e)
        self.f_burn = f if i["burn_point"] == "ascending" else -f
        tilt = np.radians(i["inclination_deg"])
        self.plane = np.array([[1.0, 0.0], [0.0, np.cos(tilt)], [0.0, np.sin(tilt)]])
        self.normal = np.array([0.0, -np.sin(tilt), np.cos(tilt)])

    def frame(self, f):
        """Unit vectors R, T, N at true anomaly f; rows."""
        theta = self.omega + f
        out, ahead = [np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]
        return np.array([self.plane @ out, self.plane @ ahead, self.normal])

    def place(self, t):
        """(position, velocity, frame) a time t after the nominal burn, by Kepler's equation."""
        start = 2.0 * np.arctan(np.sqrt((1.0 - self.e) / (1.0 + self.e)) * np.tan(0.5 * self.f_burn))
        mean = start - self.e * np.sin(start) + self.mean_motion * t
        anomaly = mean
        for _ in range(20):
            anomaly = mean + self.e * np.sin(anomaly)
        for _ in range(3):
            anomaly -= (anomaly - self.e * np.sin(anomaly) - mean) / (1.0 - self.e * np.cos(anomaly))
        f = 2.0 * np.arctan(np.sqrt((1.0 + self.e) / (1.0 - self.e)) * np.tan(0.5 * anomaly))
        frame = self.frame(f)
        root = np.sqrt(MU / self.p)
        r = self.p / (1.0 + self.e * np.cos(f))
        return r * frame[0], root * (self.e * np.sin(f) * frame[0] + (1.0 + self.e * np.cos(f)) * frame[1]), frame

    def burnt(self, i):
        """Position and velocity just after the erroneous burn."""
        on_circle = self.f_burn + np.sqrt(MU / self.r_burn**3) * i["burn_delay_s"]
        root = np.sqrt(MU / self.p)
        circular = np.sqrt(MU / self.r_burn)
        wanted = root * self.e * np.sin(self.f_burn), root * (1.0 + self.e * np.cos(self.f_burn)) - circular
        # as an angle from the retrograde direction, which the error stretches
        size, angle = np.hypot(*wanted), np.arctan2(-wanted[0], -wanted[1])
        size, angle = size * (1.0 + i["ve_pct"] / 100.0), angle * (1.0 + i["oe_pct"] / 100.0)
        off = np.radians(i["out_of_plane_error_deg"])
        burn = size * np.array([-np.cos(off) * np.sin(angle), -np.cos(off) * np.cos(angle), np.sin(off)])
        frame = self.frame(on_circle)
        return self.r_burn * frame[0], circular * frame[1] + burn @ frame


def gravity(r):
    """Acceleration of the point mass."""
    return -MU * r / np.linalg.norm(r) ** 3


def oblateness(r):
    """Acceleration by J2: Curtis, 3rd ed., eq. (12.30)."""
    n = np.linalg.norm(r)
    z = 5.0 * r[2] ** 2 / n**2
    return 1.5 * J2 * MU * R_EQUATOR**2 / n**4 * (r / n) * (np.array([z, z, z]) - [1.0, 1.0, 3.0])


def drag(r, v, ballistic):
    """Acceleration by drag in air that turns with the Earth."""
    h = (np.linalg.norm(r) - R_EQUATOR) / 1e3
    base, density, scale = next(layer for layer in reversed(LAYERS) if h >= layer[0] or layer is LAYERS[0])
    wind = v - np.cross([0.0, 0.0, EARTH_SPIN], r)
    return -0.5 * density * np.exp(-(h - base) / scale) / ballistic * np.linalg.norm(wind) * wind


def mass_of(impulse, i):
    """Mass [kg] that the force moves."""
    burning = i["mass_model"] == "burning"
    return i["initial_mass_kg"] * (np.exp(-impulse / (i["isp_s"] * G0)) if burning else 1.0)


def commanded(path, t, r, v, i):
    """Commanded acceleration: eq. (28) with the navigation's errors along R, T, N of the desired path."""
    rd, vd, frame = path.place(t)
    parts = ("radial", "transverse", "normal")
    x = r - rd + np.array([i[f"navigation_{part}_position_error_m"] for part in parts]) @ frame
    w = v - vd + np.array([i[f"navigation_{part}_velocity_error_m_s"] for part in parts]) @ frame
    k = i["gain_1_s"]
    u = gravity(rd) - gravity(rd + x) - 2.0 * k * w - k * k * x
    return u - oblateness(rd + x) if i["j2_feedforward"] else u


def fed(path, t, r, v, i):
    """Command that is flown; a pulsed flight may take that of the exact law, of which the pulses know nothing."""
    if i["control"] == "pulsed" and i["pulse_feed"] == "continuous":
        r0, v0 = path.burnt(i)
        rd, vd, _ = path.place(i["burn_delay_s"])
        x0, w0, k, since = r0 - rd, v0 - vd, i["gain_1_s"], t - i["burn_delay_s"]
        x = (x0 + (w0 + k * x0) * since) * np.exp(-k * since)
        w = (w0 - k * (w0 + k * x0) * since) * np.exp(-k * since)
        rd, vd, _ = path.place(t)
        r, v = rd + x, vd + w
    return commanded(path, t, r, v, i)


def thrust(size, on, i):
    """True force [N] for a command of this size; `on` is the modulator's state."""
    words = {
        "continuous": size,
        "clipped": min(size, i["thrust_limit_n"]),
        "pulsed": on * i["thrust_limit_n"],
        "off": 0.0,
    }
    return words[i["control"]] * (1.0 + i["thrust_bias_pct"] / 100.0)


def rates(t, s, on, path, i):
    """Derivative of position, velocity, impulse and the lag's output."""
    r, v, mass = s[0:3], s[3:6], mass_of(s[6], i)
    u = fed(path, t, r, v, i)
    size = np.linalg.norm(u)
    force = thrust(mass * size, on, i)
    acceleration = gravity(r) + force / mass * (u / size if size > 0.0 else u)
    if i["j2"]:
        acceleration = acceleration + oblateness(r)
    if i["drag"]:
        acceleration = acceleration + drag(r, v, i["ballistic_coefficient_kg_m2"])
    drive = i["modulator_input_gain"] * mass * size - i["modulator_feedback_gain"] * on * i["thrust_limit_n"]
    lag = (drive - s[7]) / i["modulator_time_constant_s"] if i["control"] == "pulsed" else 0.0
    return np.concatenate([v, acceleration, [force / mass, lag]])


def entry(t, s, on, path, i):
    """Height over the entry interface."""
    return np.linalg.norm(s[0:3]) - 1e3 * i["target_radius_km"]


def trigger(t, s, on, path, i):
    """Rises through zero where the modulator turns."""
    return i["modulator_off_n"] - s[7] if on else s[7] - i["modulator_on_n"]


entry.terminal = trigger.terminal = True
entry.direction, trigger.direction = -1, 1


def fly_twin(i):
    """Results of one case by column name; i : every input of the campaign.

    Steps of 5 s at most: switches are found on the interpolant, and with steps of 20 s they move an entry by 2 mm.
    """
    path, errors = Path(i), []
    t, s = i["burn_delay_s"], np.concatenate([*path.burnt(i), [0.0, 0.0]])
    for number in count():
        flight = solve_ivp(
            rates, (t, t + 5000.0), s, "DOP853", dense_output=True, events=[entry, trigger],
            args=(float(number % 2), path, i), rtol=1e-11, atol=[1e-6] * 3 + [1e-9] * 5, max_step=5.0,
        )  # fmt: skip
        instants = np.linspace(t, flight.t[-1], 1 + int(np.ceil((flight.t[-1] - t) / 0.25)))
        errors += [(now, np.linalg.norm(flight.sol(now)[0:3] - path.place(now)[0])) for now in instants]
        t, s = flight.t[-1], flight.y[:, -1]
        if flight.t_events[0].size:
            return _results(path, i, t, s, np.array(errors))


def _results(path, i, t, s, errors):
    r, v = s[0:3], s[3:6]
    x, y = r @ path.plane
    worst, when = _crest(errors)
    return {
        "correction_impulse_m_s": s[6],
        "propellant_kg": i["initial_mass_kg"] * (1.0 - np.exp(-s[6] / (i["isp_s"] * G0))),
        "entry_time_s": t,
        "entry_speed_m_s": np.linalg.norm(v),
        "entry_flight_path_angle_deg": np.degrees(np.arcsin(r @ v / np.linalg.norm(r) / np.linalg.norm(v))),
        "entry_latitude_argument_deg": np.degrees(np.arctan2(y, x)) % 360.0,
        "entry_latitude_deg": np.degrees(np.arcsin(r[2] / np.linalg.norm(r))),
        "max_position_error_m": worst,
        "max_position_error_time_s": when,
        "final_position_error_m": errors[-1, 1],
    }


def _crest(errors):
    """Largest error and its time, by a parabola through the three samples about it."""
    k = int(np.argmax(errors[:, 1]))
    if k in (0, len(errors) - 1):
        return errors[k, 1], errors[k, 0]
    a, b, c = np.polyfit(errors[k - 1 : k + 2, 0] - errors[k, 0], errors[k - 1 : k + 2, 1], 2)
    return c - b * b / (4.0 * a), errors[k, 0] - b / (2.0 * a)
