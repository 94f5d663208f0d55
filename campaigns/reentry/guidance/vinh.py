"""Vinh's equations of motion: the reference path is flown by them, and tests compare the flights with them.

The same motion as `dynamics.rhs` in distance, longitude, latitude, speed, flight-path angle and heading.  Singular in
vertical flight, at rest and over the poles, which is why the flight uses Cartesian components instead.

N. X. Vinh, A. Busemann, R. D. Culp, Hypersonic and Planetary Entry Flight Mechanics (1980), chapter 2, with the
heading from north, clockwise (Vinh: from east, counter-clockwise).  Angles over ground, SI.
"""

import numpy as np

from mc_engine.physics.constants import EQUATORIAL_RADIUS, J2_EARTH


def gravity(r, latitude, mu, j2=J2_EARTH):
    """(inward, northward) acceleration [m/s^2] by a point mass with J2."""
    q = j2 * (EQUATORIAL_RADIUS / r) ** 2
    s, c = np.sin(latitude), np.cos(latitude)
    return mu / r**2 * (1.0 - 1.5 * q * (3.0 * s * s - 1.0)), -3.0 * mu / r**2 * q * s * c


def rates(r, latitude, v, path, heading, drag, lift, bank, g_in, g_north, omega):
    """Rates (SI) of (r, longitude, latitude, v, path, heading); drag, lift, g_in, g_north are accelerations."""
    s, c = np.sin(path), np.cos(path)
    sh, ch = np.sin(heading), np.cos(heading)
    sl, cl = np.sin(latitude), np.cos(latitude)
    turn = omega**2 * r
    return (
        v * s,
        v * c * sh / (r * cl),
        v * c * ch / r,
        -drag - g_in * s + g_north * c * ch + turn * cl * (s * cl - c * sl * ch),
        (
            lift * np.cos(bank)
            - g_in * c
            - g_north * s * ch
            + v * v * c / r
            + 2.0 * omega * v * cl * sh
            + turn * cl * (c * cl + s * sl * ch)
        )
        / v,
        (
            lift * np.sin(bank) / c
            - g_north * sh / c
            + v * v * c * sh * sl / (cl * r)
            - 2.0 * omega * v * (s / c * cl * ch - sl)
            + turn * sl * cl * sh / c
        )
        / v,
    )
