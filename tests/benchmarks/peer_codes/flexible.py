"""The flexible satellite's derivative for scipy, by matrices of NumPy: apart from models/satellite.py and lanes.cpp.

The gain switch makes the rate slide along its limit: an adaptive step collapses there, and no finer step is closer to
the truth than the sampled one.  So errors are taken against the same Runge-Kutta steps, flown here.

H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical Engineering 24 (3) (2022), eqs (1)-(17).  SI.
"""

import math

import numpy as np

COUPLING = np.array([[7.0, -1.2, 1.1, 1.2], [1.2, 0.9, 2.5, -2.6], [2.2, -1.7, -0.8, -1.1]])
FREQUENCY, DAMPING = np.array([0.7, 1.0, 1.8, 2.5]), np.array([0.0056, 0.0086, 0.0128, 0.0252])
TARGET = np.array([0.2, 0.4, -0.8])
# rate, quaternion, modes, their rates, integral
FIRST = np.array([0.07, -0.05, -0.04, 0.4, 0.2, 0.4, -0.8, *[0.0] * 11])


def _torque(w, q, integral):
    """Control torque [N m], eqs (11), (13)-(16)."""
    fast = w @ w >= 0.01
    kd, kp, ki = (200.0, 2.5, 0.02) if fast else (20.0, 5.0, 0.1)
    torque = -kd * w - kp * q[1:] - ki * (integral - 1.5 * (q[1:] - TARGET))
    size = math.sqrt(torque @ torque)
    return torque * min(1.0, 0.5 / size) if size else torque


def derivative_of(inertia):
    """Function (t, s) of the derivative of one case; inertia : float64[3], of the principal axes [kg m^2]."""
    inverse = np.linalg.inv(np.diag(inertia) - COUPLING @ COUPLING.T)

    def derivative(t, s):
        w, q, modes, speeds, integral = s[:3], s[3:7], s[7:11], s[11:15], s[15:]
        disturbance = 2.8867513459481287e-4 * (math.sin(t) + 0.5)
        elastic = 2.0 * DAMPING * FREQUENCY * speeds + FREQUENCY**2 * modes
        momentum = inertia * w + COUPLING @ speeds
        gyro = np.array(
            [
                w[1] * momentum[2] - w[2] * momentum[1],
                w[2] * momentum[0] - w[0] * momentum[2],
                w[0] * momentum[1] - w[1] * momentum[0],
            ]
        )
        dw = inverse @ (_torque(w, q, integral) - gyro + disturbance + COUPLING @ elastic)
        # the orbital frame turns about -y: eqs (7)-(9)
        orbital = 1.078e-3 * np.array(
            [
                2.0 * (q[1] * q[2] + q[0] * q[3]),
                q[0] ** 2 - q[1] ** 2 + q[2] ** 2 - q[3] ** 2,
                2.0 * (q[2] * q[3] - q[0] * q[1]),
            ]
        )
        r, v = w + orbital, q[1:]
        cross = [v[1] * r[2] - v[2] * r[1], v[2] * r[0] - v[0] * r[2], v[0] * r[1] - v[1] * r[0]]
        dq = 0.5 * (q[0] * r + np.array(cross))
        out = np.empty(18)
        out[:3], out[3], out[4:7], out[7:11] = dw, -0.5 * (v @ r), dq, speeds
        out[11:15] = -elastic - COUPLING.T @ dw
        out[15:] = 0.025 * w + 0.005 * v
        return out

    return derivative


def flown(first, inertia, duration, step):
    """End state of one case by classical Runge-Kutta steps [s]."""
    derivative, s = derivative_of(inertia), first
    for k in range(round(duration / step)):
        t = k * step
        k1 = derivative(t, s)
        k2 = derivative(t + 0.5 * step, s + 0.5 * step * k1)
        k3 = derivative(t + 0.5 * step, s + 0.5 * step * k2)
        k4 = derivative(t + step, s + step * k3)
        s = s + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return s
