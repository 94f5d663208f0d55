"""Motion near a geostationary place to first order, against which flights are held.  NumPy.

Numbers in brackets are equations of the source (`model.SOURCE`).
"""

import numpy as np

from campaigns.geo_servicing.dynamics import R0, RATE, SIDEREAL_DAY
from mc_engine.physics.frames import TURN


def longitude_after(y, v, e, anomaly, flown):
    """Longitude deviation [rad] after an angle flown [rad]; y, v : of it and its drift [rad, rad/rev].  (3.36)"""
    return y + v * flown / TURN + 4.0 * e * np.sin(0.5 * flown) * np.cos(anomaly + 0.5 * flown)


def radius_deviation(v, e, anomaly, flown):
    """Radius less the synchronous one [m] after an angle flown [rad].  (3.38)-(3.40)"""
    return R0 * (-v / (1.5 * TURN) - e * np.cos(anomaly + flown))


def relative_eccentricity(e_s, anomaly_s, e_t, anomaly_t):
    """(length of the difference of two eccentricity vectors, anomaly on the relative ellipse [rad]).  (3.43), (3.44)

    The pericentres point alike.
    """
    along = e_s * np.cos(anomaly_s) - e_t * np.cos(anomaly_t)
    across = e_s * np.sin(anomaly_s) - e_t * np.sin(anomaly_t)
    return np.hypot(along, across), np.arctan2(across, along)


def coast_time(e_s, theta_s, e_t, theta_t, u, turns):
    """Coast [s] to the place where a correction u makes the relative ellipse smaller (3.45).

    e, theta : eccentricities and anomalies [rad] of the module and the target, pericentres alike;  turns : m_k
    """
    a = e_s * np.cos(theta_s) - e_t * np.cos(theta_t)
    alpha = np.arctan((e_s * np.sin(theta_s) - e_t * np.sin(theta_t)) / a)
    sign = np.sign(u * a)
    return SIDEREAL_DAY * (turns + 0.25 * (1.0 - sign)) - alpha / RATE
