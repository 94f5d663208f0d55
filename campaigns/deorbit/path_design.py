"""Design of the de-orbit path and of its burn, and what burn errors make of it.  NumPy, SI, whole chunks.

S. Divsalar, R. Nadafi, M. Kabganian, Electronics Industries Quarterly 7(1), 2016: eqs (11)-(23) design the
ellipse through the wanted entry state and its two crossings with the circular initial orbit.
"""

from dataclasses import dataclass

import numpy as np

from mc_engine.model import Refusals
from mc_engine.physics.constants import MU_EARTH

TAU = 2.0 * np.pi


@dataclass
class DeorbitPath:
    """The desired ellipse and its burn; float64[n], SI.

    a, e, omega : semi-major axis, eccentricity, argument of perigee;  f_entry : true anomaly at entry
    f_burn, theta_burn : true anomaly on the ellipse and argument of latitude of the burn
    dv, alpha : burn magnitude, and its angle from the retrograde direction;  tilt : +1 where the burn points
        below the horizon (descending crossing), -1 above
    """

    a: np.ndarray
    e: np.ndarray
    omega: np.ndarray
    f_entry: np.ndarray
    f_burn: np.ndarray
    theta_burn: np.ndarray
    dv: np.ndarray
    alpha: np.ndarray
    tilt: np.ndarray

    @property
    def p(self) -> np.ndarray:
        """Semi-latus rectum, eq. (7)."""
        return self.a * (1.0 - self.e**2)

    def flight_time(self) -> np.ndarray:
        """Time [s] from the burn to the entry state along the undisturbed path."""
        n = np.sqrt(MU_EARTH / self.a**3)
        return np.mod(mean_anomaly(self.f_entry, self.e) - mean_anomaly(self.f_burn, self.e), TAU) / n


def mean_anomaly(f, e):
    """Mean anomaly [rad] of true anomaly f on an ellipse of eccentricity e."""
    eccentric = 2.0 * np.arctan2(np.sqrt(1.0 - e) * np.sin(0.5 * f), np.sqrt(1.0 + e) * np.cos(0.5 * f))
    return eccentric - e * np.sin(eccentric)


def true_anomaly(mean, e):
    """True anomaly [rad] of a mean anomaly; Kepler's equation by Newton's method, 12 steps."""
    mean = np.mod(np.asarray(mean) + np.pi, TAU) - np.pi
    eccentric = mean + e * np.sin(mean)
    for _ in range(12):
        eccentric = eccentric - (eccentric - e * np.sin(eccentric) - mean) / (1.0 - e * np.cos(eccentric))
    return 2.0 * np.arctan2(np.sqrt(1.0 + e) * np.sin(0.5 * eccentric), np.sqrt(1.0 - e) * np.cos(0.5 * eccentric))


def design_path(a_initial, speed, angle, radius, theta_entry, ascending, refusals: Refusals) -> DeorbitPath:
    """Ellipse to the entry state and the burn that reaches it from a circular orbit.

    a_initial [m] : radius of the initial orbit;  speed [m/s], angle [rad, positive below the horizon],
    radius [m], theta_entry [rad] : entry state;  ascending : where true, burn at the ascending crossing D2.
    Cases whose entry state lies on no ellipse, or whose ellipse misses the orbit, join `refusals`.
    """
    a = MU_EARTH / (2.0 * (MU_EARTH / radius - speed**2 / 2.0))  # eq. (11)
    refusals.add(~((a > 0.0) & np.isfinite(a)), "no ellipse reaches the entry state: its speed is at or above escape")
    e = np.sqrt(1.0 - (radius * speed * np.cos(angle)) ** 2 / (MU_EARTH * a))  # eq. (12)
    refusals.add(
        ~(e > 1e-7),  # rounding in eq. (12) leaves about 1e-8 of a circle
        "the entry state lies on a circle, which has no perigee to aim with",
    )
    cos_psi = (a - radius) / (a * e)  # eq. (15)
    sin_psi = -radius * speed * np.sin(angle) / (e * np.sqrt(MU_EARTH * a))  # eq. (16)
    f_entry = np.mod(np.arctan2(np.sqrt(1.0 - e**2) * sin_psi, cos_psi - e), TAU)  # eq. (14)
    omega = np.mod(theta_entry - f_entry, TAU)  # eq. (13)
    p = a * (1.0 - e**2)
    cos_f = (p / a_initial - 1.0) / e  # eq. (17) with e_i = 0
    refusals.add(~(np.abs(cos_f) <= 1.0), "the initial orbit and the path to the entry state do not intersect")
    f_burn = np.where(ascending, np.arccos(cos_f), TAU - np.arccos(cos_f))
    v_initial = np.sqrt(MU_EARTH / a_initial)  # eq. (19)
    v_radial = np.sqrt(MU_EARTH / p) * e * np.sin(f_burn)
    v_transverse = np.sqrt(MU_EARTH * p) / a_initial
    # the velocity triangle of eqs (18) and (23), by components: no asin, no lost quadrant
    dv = np.hypot(v_radial, v_transverse - v_initial)
    tilt = np.where(ascending, -1.0, 1.0)
    alpha = np.arctan2(-tilt * v_radial, v_initial - v_transverse)
    return DeorbitPath(
        a=a,
        e=e,
        omega=omega,
        f_entry=f_entry,
        f_burn=f_burn,
        theta_burn=np.mod(f_burn + omega, TAU),
        dv=dv,
        alpha=alpha,
        tilt=tilt,
    )


def burnt_velocity(path: DeorbitPath, a_initial, magnitude_error, angle_error, out_of_plane):
    """(radial, transverse, normal) velocity [m/s] after the erroneous burn.

    magnitude_error, angle_error : VE and OE as fractions; OE is a fraction of the angle alpha itself.
    out_of_plane [rad] : angle of the burn out of the orbital plane, towards the orbit normal.
    """
    dv = path.dv * (1.0 + magnitude_error)
    alpha = path.alpha * (1.0 + angle_error)
    in_plane = dv * np.cos(out_of_plane)
    radial = -path.tilt * in_plane * np.sin(alpha)
    transverse = np.sqrt(MU_EARTH / a_initial) - in_plane * np.cos(alpha)
    return radial, transverse, dv * np.sin(out_of_plane)
