"""The laws flown by scipy in the plane, second by second, with nothing of the kernel but the designed gains."""

import numpy as np
from reentry_twin import G0, MU, RADIUS, standard_density
from scipy.integrate import solve_ivp

from campaigns.reentry.guidance.reference import (
    ALONG,
    LOST,
    PATH,
    RANGE_SET,
    SPEED,
    fly_reference,
    linear_system,
    riccati_gains,
    steered_part,
)

TRIGGER, LAST, SCALE_HEIGHT, FELT = 0.15 * G0, 400.0, 7000.0, 0.05 * G0


class Stored:
    """The reference over the speed, its steered part, as the laws know it."""

    def __init__(self, plan):
        self.whole = fly_reference(plan)
        path = steered_part(self.whole)
        self.speed = path.state[SPEED]
        gains = riccati_gains(self.speed[0] - self.speed, *linear_system(plan, path), RANGE_SET)
        self.rows = {
            "altitude": path.altitude, "drag": path.drag, "climb": path.climb, "path": path.state[PATH],
            "along": path.state[ALONG], **dict(enumerate(gains.T)),
        }  # fmt: skip

    def at(self, name, speed):
        """One quantity of the reference, or one of its three gains, at a speed."""
        return np.interp(-speed, -self.speed, self.rows[name])


class Account:
    """What law 3 keeps: speed lost by the accelerometer, reckoned range, last deceleration, last log-excess."""

    def __init__(self, stored):
        self.stored, whole = stored, stored.whole
        self.t, self.along = whole.t, whole.state[ALONG]
        felt = (whole.state[LOST] > 0.0) & (whole.state[SPEED] > LAST - 5.0)
        self.lost, self.rows = whole.state[LOST][felt], {
            "axial": whole.axial[felt], "speed": whole.state[SPEED][felt], "along": self.along[felt],
            "rate": np.gradient(self.along, self.t)[felt],
        }  # fmt: skip
        self.begin = self.t[felt][0]
        self.w, self.range, self.rate, self.n, self.excess = 0.0, 0.0, 0.0, 0.0, 0.0

    def at(self, name):
        """One quantity of the reference at the speed lost so far."""
        return np.interp(self.w, self.lost, self.rows[name])

    def clocked(self, t):
        """Range of the reference at a time before the air is felt, going on at its last rate."""
        early = np.interp(min(t, self.begin), self.t, self.along)
        return early + max(0.0, t - self.begin) * self.rows["rate"][0]

    def sample(self, t, n):
        """Vertical share of the lift after a second with the deceleration n at its end."""
        before = self.w <= 0.0
        if not before:
            self.w += 0.5 * (n + self.n)
        elif n > FELT:
            self.w = 0.5 * (n + FELT) * min(1.0, (n - FELT) / (n - self.n))
        rate = self.at("rate")
        self.range = self.clocked(t) if before else self.range + 0.5 * (rate + self.rate)
        excess = np.log(n) - np.log(self.at("axial"))
        growth = excess - self.excess
        self.rate, self.n, self.excess = rate, n, excess
        v = self.at("speed")
        high = np.clip(-SCALE_HEIGHT * (n / self.at("axial") - 1.0), -6e3, 6e3)
        climb = -SCALE_HEIGHT * (growth + 2.0 * (n - self.at("axial")) / v)
        tilt = np.clip(climb / v, -np.radians(2.0), np.radians(2.0))
        known = min(v, self.stored.speed[0])
        k = [self.stored.at(i, known) for i in range(3)]
        wanted = 0.5 - (k[0] * high + k[1] * tilt + k[2] * (self.range - self.at("along")))
        return np.clip(wanted, np.cos(np.radians(165.0)), 1.0) if v > LAST else 0.5


def share(law, stored, h, v, path, along, drag):
    """Vertical share of the lift by law 1 or by law 2 with range."""
    if law == "law1":
        high, tilt = h - stored.at("altitude", v), path - stored.at("path", v)
    else:
        high = np.clip(-SCALE_HEIGHT * (drag / stored.at("drag", v) - 1.0), -6e3, 6e3)
        tilt = (v * np.sin(path) - stored.at("climb", v)) / v
    ahead = along - stored.at("along", v)
    wanted = 0.5 - (stored.at(0, v) * high + stored.at(1, v) * tilt + stored.at(2, v) * ahead)
    return np.clip(wanted, np.cos(np.radians(165.0)), 1.0)


def rates(t, y, u, drag_area, lift_area):
    """Rates of altitude, speed, path angle and range over a sphere at rest."""
    h, v, path, _ = y
    r, push = RADIUS + h, 0.5 * standard_density(h) * v**2
    g = MU / r**2
    return [
        v * np.sin(path),
        -push * drag_area - g * np.sin(path),
        (push * lift_area * u - (g - v * v / r) * np.cos(path)) / v,
        v * np.cos(path) * RADIUS / r,
    ]


def low(t, y, *areas):
    """Where the flight ends: 10 km."""
    return y[0] - 10e3


low.terminal = True


def fly_guided(law, stored, start, drag_area, lift_area):
    """(range [m], flight time [s]) at 10 km; start: altitude, speed, path angle; one command a second."""
    y, t, steering, account = np.array([*start, 0.0]), 0.0, False, Account(stored)
    while True:
        drag = 0.5 * standard_density(y[0]) * y[1] ** 2 * drag_area
        steering = steering or drag > TRIGGER
        if law == "law3r":
            u = account.sample(t, drag)
        else:
            u = share(law, stored, y[0], y[1], y[2], y[3], drag) if y[1] > LAST else 0.5
        u = u if steering else 0.5
        second = solve_ivp(
            rates, (t, t + 1.0), y, "DOP853", args=(u, drag_area, lift_area), rtol=1e-9, atol=1e-9, events=low
        )
        y, t = second.y[:, -1], second.t[-1]
        if second.t_events[0].size:
            return y[3], t
