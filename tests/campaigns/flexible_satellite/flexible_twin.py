"""A slow, obvious flight of the flexible satellite to hold the compiled one against.

Rates and modal rates are the state, as printed, with matrices and cross products; the direction cosine matrix is
built whole; SciPy's eighth-order steps carry their own error control from sample to sample; pulses are kept as lists
of times.  It shares no code with the campaign; inputs are the campaign's columns, in declared units.
"""

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

# c0 of Table 11 as printed: rows body x, y, z; columns modes 1 to 4
C0 = np.array([[7.0, -1.2, 1.1, 1.2], [1.2, 0.9, 2.5, -2.6], [2.2, -1.7, -0.8, -1.1]])


def crossing(v):
    """The matrix r^x of (3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def cosines(q):
    """The matrix c of (9), orbital to body."""
    v = q[1:]
    return (q[0] ** 2 - v @ v) * np.eye(3) + 2.0 * np.outer(v, v) - 2.0 * q[0] * crossing(v)


class Craft:
    """Matrices of one case."""

    def __init__(self, i):
        factors = [i[f"inertia_{axis}_factor"] for axis in "xyz"]
        self.j = np.diag([i[f"inertia_{axis}_kg_m2"] * k for axis, k in zip("xyz", factors, strict=True)])
        for (a, b), pair in zip([(0, 1), (0, 2), (1, 2)], ["xy", "xz", "yz"], strict=True):
            self.j[a, b] = self.j[b, a] = i[f"inertia_{pair}_kg_m2"]
        self.c0 = C0 * i["coupling_factor"]
        self.lam = np.diag([i[f"modal_frequency_{k}_rad_s"] * i["modal_frequency_factor"] for k in (1, 2, 3, 4)])
        self.xi = np.diag([i[f"modal_damping_{k}"] * i["modal_damping_factor"] for k in (1, 2, 3, 4)])
        self.mass = np.block([[self.j, self.c0], [self.c0.T, np.eye(4)]])  # of w' and eta'' together
        turn = np.radians([i[f"misalignment_{axis}_deg"] for axis in "xyz"])
        self.factors = np.array([i[f"thrust_{axis}_factor"] for axis in "xyz"])
        self.axes = Rotation.from_rotvec(turn).as_matrix()
        self.orbit = np.array([0.0, -i["orbit_rate_rad_s"], 0.0])
        self.i = i

    def first(self):
        """First (q, w, eta, eta')."""
        i = self.i
        start = Rotation.from_quat([i[f"initial_q{k}"] for k in (1, 2, 3, 0)])
        errors = np.radians([i[f"initial_attitude_error_{axis}_deg"] for axis in "xyz"])
        x, y, z, w = (start * Rotation.from_rotvec(errors)).as_quat()
        flip = np.sign(w) * np.sign(i["initial_q0"])
        omega = [i[f"initial_omega_{axis}_rad_s"] for axis in "xyz"]
        return np.concatenate([flip * np.array([w, x, y, z]), omega, np.zeros(8)])

    def rates(self, t, s, torque):
        """Equations (1), (2) and (5) with the rate relative to the orbital frame."""
        i = self.i
        q, w, eta, etad = s[0:4], s[4:7], s[7:11], s[11:15]
        wave = i["disturbance_amplitude_n_m"] * (np.sin(i["disturbance_frequency_rad_s"] * t) + i["disturbance_offset"])
        right = torque + wave * np.ones(3) - np.cross(w, self.j @ w + self.c0 @ etad)
        accelerations = np.linalg.solve(
            self.mass, np.concatenate([right, -2.0 * self.xi @ self.lam @ etad - self.lam @ self.lam @ eta])
        )
        relative = w - cosines(q) @ self.orbit
        f = q[0] * np.eye(3) + crossing(q[1:])
        return np.concatenate(
            [[-0.5 * q[1:] @ relative], 0.5 * f @ relative, accelerations[:3], etad, accelerations[3:]]
        )


class Law:
    """Equations (11) to (16), with the integral by trapezoids."""

    def __init__(self, craft):
        self.craft, self.i = craft, craft.i
        self.q_first = craft.first()[1:4]
        self.integral, self.before = np.zeros(3), None

    def torque(self, s, period):
        i = self.i
        q, w = s[1:4], s[4:7].copy()
        if i["rate_used"] == "orbital":
            w -= cosines(s[0:4]) @ self.craft.orbit
        now = i["integral_rate_gain"] * w + i["integral_attitude_gain_1_s"] * q
        if self.before is not None:
            self.integral = self.integral + 0.5 * period * (self.before + now)
        self.before = now
        nu = self.integral - i["integral_gamma"] * (q - self.q_first)
        kp, kd, ki = i["kp"], i["kd"], i["ki"]
        if np.linalg.norm(w) >= i["rate_limit_rad_s"]:
            kp, kd, ki = kp / i["delta_p"], kd * i["delta_d"], ki / i["delta_i"]
        x = -kd * w - kp * q - ki * nu
        size, limit = np.linalg.norm(x), i["torque_limit_n_m"]
        x = x * (limit / size) if size > limit else x
        lean = i["switching_rate_gain"] * w + i["switching_attitude_gain_1_s"] * q
        return x - i["dbar_n_m"] * np.sign(lean)


class Modulator:
    """One axis: a lag and a Schmitt trigger, followed from switch to switch."""

    def __init__(self, i):
        self.k, self.tau = i["pwpf_gain"], i["pwpf_time_constant_s"]
        self.level = i["thrust_level"] * (0.5 if i["pwpf_pairing"] == "C" else 1.0)
        self.off, self.on = i["pwpf_u_off"], i["pwpf_u_off"] + i["pwpf_hysteresis"]
        self.f, self.y = 0.0, 0
        self.pulses = []  # [begin, end or None]

    def sample(self, t, command, period):
        """[(length, output), ...] that fill the sample."""
        pieces, left = [], period
        while True:
            drive = self.k * (command - self.y * self.level)
            wanted = self.y * self.off if self.y else np.copysign(self.on, drive)
            # time at which f reaches the wanted threshold, if it ever does
            z = (self.f - drive) / (wanted - drive)
            leaves = z >= 1.0 if self.y or abs(drive) > self.on else False
            time = self.tau * np.log(z) if leaves else np.inf
            if time > left:
                self.f = drive + (self.f - drive) * np.exp(-left / self.tau)
                return [*pieces, (left, self.y)]
            pieces.append((time, self.y))
            left, self.f = left - time, wanted
            if self.y:
                self.pulses[-1][1] = t + period - left
                self.y = 0
            else:
                self.pulses.append([t + period - left, None])
                self.y = int(np.sign(wanted))


def fly_twin(i, averaged=True):
    """Results of one case by column name.

    averaged : pulses act as their mean over a sample, as in the campaign; else when they fire.
    """
    craft = Craft(i)
    law, modulators = Law(craft), [Modulator(i) for _ in range(3)]
    period = i["step_s"] * i["steps_per_sample"]
    level = i["thrust_level"] * (1.0 if i["pwpf_pairing"] == "A" else 0.5)
    s, impulse, effort = craft.first(), np.zeros(3), 0.0
    fired = [np.zeros(3)] * 3
    delay = i["valve_delay_s"] / period
    for number in range(round(i["duration_s"] / period)):
        t = number * period
        command = law.torque(s, period)
        if i["actuator"] == "ideal":
            pieces = [(period, command)]
        else:
            outputs = [modulator.sample(t, u, period) for modulator, u in zip(modulators, command, strict=True)]
            pieces = merged(outputs, period)
            if averaged:
                mean = sum(length * output for length, output in pieces) / period
                fired = [mean, *fired[:2]]
                # the mean over a window that lies `delay` samples back
                pieces = [(period, sum(max(0.0, 1.0 - abs(delay - k)) * one for k, one in enumerate(fired)))]
            pieces = [(length, level * output) for length, output in pieces]
        for length, torque in pieces:
            torque = craft.factors * torque
            flight = solve_ivp(
                craft.rates, (t, t + length), s, "DOP853", args=(craft.axes @ torque,), rtol=1e-10, atol=1e-12
            )
            t, before, s = t + length, s, flight.y[:, -1]
            effort += 0.5 * length * (np.abs(before[1:4]) + np.abs(s[1:4])).sum()
            impulse = impulse + length * np.abs(torque)
    return results(i, craft, s, impulse, effort, modulators)


def merged(outputs, period):
    """The pieces of three axes on one time line: [(length, outputs), ...]."""
    marks = sorted({0.0, period, *(t for pieces in outputs for t in np.cumsum([length for length, _ in pieces])[:-1])})
    line = []
    for begin, end in pairwise(marks):
        middle = 0.5 * (begin + end)
        line.append((end - begin, np.array([value_at(pieces, middle) for pieces in outputs], dtype=float)))
    return line


def value_at(pieces, time):
    for length, output in pieces:
        if time < length:
            return output
        time -= length
    return pieces[-1][1]


def results(i, craft, s, impulse, effort, modulators):
    w, eta = s[4:7], s[7:11]
    columns = {f"q{k}": s[k] for k in range(4)} | {f"eta_{k + 1}": eta[k] for k in range(4)}
    columns |= {f"omega_{axis}_rad_s": w[k] for k, axis in enumerate("xyz")}
    columns |= {f"impulse_{axis}_n_m_s": impulse[k] for k, axis in enumerate("xyz")}
    columns |= {"control_effort_n_m_s": impulse.sum(), "attitude_effort_s": effort}
    columns["propellant_kg"] = impulse.sum() / (i["arm_m"] * i["isp_s"] * 9.80665)
    for axis, one in zip("xyz", impulse, strict=True):
        columns[f"propellant_{axis}_kg"] = one / (i["arm_m"] * i["isp_s"] * 9.80665)
    h = craft.j @ w + craft.c0 @ s[11:15]
    columns |= {f"end_momentum_{axis}_n_m_s": h[k] for k, axis in enumerate("xyz")}
    if i["actuator"] == "pwpf":
        for axis, modulator in zip("xyz", modulators, strict=True):
            widths = [end - begin for begin, end in modulator.pulses if end is not None]
            columns[f"pulse_count_{axis}"] = len(modulator.pulses)
            columns[f"min_pulse_{axis}_s"] = min(widths, default=np.nan)
    return columns
