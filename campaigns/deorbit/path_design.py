"""Design of the de-orbit path and of its burn, and what burn errors make of it.  NumPy, SI, whole chunks.

S. Divsalar, R. Nadafi, M. Kabganian, Electronics Industries Quarterly 7(1), 2016: eqs (11)-(23) design the
ellipse through the wanted entry state and its two crossings with the circular initial orbit.
"""

from collections import namedtuple
from types import SimpleNamespace

import numpy as np

from mc_engine.model import Refusals
from mc_engine.physics.constants import MU_EARTH
from mc_engine.physics.frames import TURN, turned
from mc_engine.physics.orbital_elements import mean_anomaly, true_anomaly

# The desired ellipse and its burn; float64[n], SI.
# a, e, p, omega: semi-major axis, eccentricity, semi-latus rectum, argument of perigee; f_burn, theta_burn: true
# anomaly on the ellipse and argument of latitude of the burn; dv, alpha: burn magnitude, and its angle from the
# retrograde direction; tilt: +1 where the burn points below the horizon (descending crossing), -1 above;
# duration: time from the burn to the entry state along the undisturbed path
DeorbitPath = namedtuple("DeorbitPath", "a e p omega f_burn theta_burn dv alpha tilt duration")


def design_path(i: SimpleNamespace, ascending: np.ndarray, refusals: Refusals) -> DeorbitPath:
    """Ellipse to the entry state and the burn that reaches it from a circular orbit.

    i : inputs of the model, SI;  ascending : where true, burn at the ascending crossing D2.
    Cases whose entry state lies on no ellipse, or whose ellipse misses the orbit, join `refusals`.
    """
    a_initial, radius = i.initial_semi_major_axis, i.target_radius
    speed, angle = i.target_speed, i.target_flight_path_angle
    a = MU_EARTH / (2.0 * (MU_EARTH / radius - speed**2 / 2.0))  # eq. (11)
    refusals.add(~((a > 0.0) & np.isfinite(a)), "no ellipse reaches the entry state: its speed is at or above escape")
    e = np.sqrt(1.0 - (radius * speed * np.cos(angle)) ** 2 / (MU_EARTH * a))  # eq. (12)
    refusals.add(
        ~(e > 1e-7),  # rounding in eq. (12) leaves about 1e-8 of a circle
        "the entry state lies on a circle, which has no perigee to aim with",
    )
    cos_psi = (a - radius) / (a * e)  # eq. (15)
    sin_psi = -radius * speed * np.sin(angle) / (e * np.sqrt(MU_EARTH * a))  # eq. (16)
    f_entry = np.mod(np.arctan2(np.sqrt(1.0 - e**2) * sin_psi, cos_psi - e), TURN)  # eq. (14)
    omega = np.mod(i.target_latitude_argument - f_entry, TURN)  # eq. (13)
    p = a * (1.0 - e**2)  # eq. (7)
    cos_f = (p / a_initial - 1.0) / e  # eq. (17) with e_i = 0
    refusals.add(~(np.abs(cos_f) <= 1.0), "the initial orbit and the path to the entry state do not intersect")
    refusals.add(~(angle > 0.0), "the path is level at entry: it touches the interface and does not fall through it")
    f_burn = np.where(ascending, np.arccos(cos_f), TURN - np.arccos(cos_f))
    v_initial = np.sqrt(MU_EARTH / a_initial)  # eq. (19)
    v_radial = np.sqrt(MU_EARTH / p) * e * np.sin(f_burn)
    v_transverse = np.sqrt(MU_EARTH * p) / a_initial
    tilt = np.where(ascending, -1.0, 1.0)
    return DeorbitPath(
        a=a,
        e=e,
        p=p,
        omega=omega,
        f_burn=f_burn,
        theta_burn=np.mod(f_burn + omega, TURN),
        # the velocity triangle of eqs (18) and (23), by components: no asin, no lost quadrant
        dv=np.hypot(v_radial, v_transverse - v_initial),
        alpha=np.arctan2(-tilt * v_radial, v_initial - v_transverse),
        tilt=tilt,
        duration=np.mod(mean_anomaly(f_entry, e) - mean_anomaly(f_burn, e), TURN) / np.sqrt(MU_EARTH / a**3),
    )


def path_axes(omega, inclination):
    """Unit vectors [3, n] to the perigee and 90 degrees ahead of it: eq. (30) with the node on x."""
    zero = np.zeros_like(omega)
    node = np.array([np.ones_like(omega), zero, zero])
    across = np.array([zero, np.cos(inclination), np.sin(inclination)])
    return turned(node, across, np.cos(omega), np.sin(omega))


def first_deviation(path: DeorbitPath, i: SimpleNamespace, to_perigee, ahead):
    """(true anomaly of the desired place [rad], deviation of position [m] and velocity [m/s], [3, n]) after the burn.

    The burn happens `burn_delay` after its time: the craft has gone on along the circle, its target along the path.
    OE is a fraction of the angle alpha itself; the error out of the plane is positive towards the orbit normal.
    """
    angle = path.f_burn + np.sqrt(MU_EARTH / i.initial_semi_major_axis**3) * i.burn_delay
    radial, transverse = turned(to_perigee, ahead, np.cos(angle), np.sin(angle))
    dv, alpha = path.dv * (1.0 + i.ve), path.alpha * (1.0 + i.oe)
    in_plane, normal = dv * np.cos(i.out_of_plane_error), np.cross(to_perigee, ahead, axis=0)
    v_radial = -path.tilt * in_plane * np.sin(alpha)
    v_transverse = np.sqrt(MU_EARTH / i.initial_semi_major_axis) - in_plane * np.cos(alpha)
    velocity = v_radial * radial + v_transverse * transverse + dv * np.sin(i.out_of_plane_error) * normal
    mean = mean_anomaly(path.f_burn, path.e) + np.sqrt(MU_EARTH / path.a**3) * i.burn_delay
    f = np.where(i.burn_delay == 0.0, path.f_burn, true_anomaly(mean, path.e))
    wanted_radial, wanted_transverse = turned(to_perigee, ahead, np.cos(f), np.sin(f))
    root, rise = np.sqrt(MU_EARTH / path.p), 1.0 + path.e * np.cos(f)
    wanted = root * path.e * np.sin(f) * wanted_radial + root * rise * wanted_transverse  # (34), (37)
    return f, (i.initial_semi_major_axis * radial - path.p / rise * wanted_radial, velocity - wanted)  # (31)
