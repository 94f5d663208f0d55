"""Attitude: quaternions, scalar first, of the rotation from a reference frame R to body axes B.

Hamilton's product throughout.  The matrix of q = (q0, qv), which takes components in R to components in B, is
(q0^2 - qv.qv) I + 2 qv qv^T - 2 q0 [qv x].  A further rotation given in body axes multiplies from the right.

Kinematics on plain numbers, and `rotation_quaternion` in NumPy; products and matrices: `mc_engine.physics.rotations`.
M. J. Sidi, Spacecraft Dynamics and Control (1997), appendix A.4 and section 4.7.
"""

import numpy as np

from mc_engine.lanes import physics


@physics
def quaternion_rates(q0, q1, q2, q3, wx, wy, wz):
    """Rates [1/s] of the four components for a body rate [rad/s] relative to R, in body axes: q' = q (0, w) / 2."""
    x, y, z = 0.5 * wx, 0.5 * wy, 0.5 * wz
    return (
        -(q1 * x + q2 * y + q3 * z),
        q0 * x + (q2 * z - q3 * y),
        q0 * y + (q3 * x - q1 * z),
        q0 * z + (q1 * y - q2 * x),
    )


@physics
def second_axis_in_body(q0, q1, q2, q3):
    """The reference frame's second unit vector, in body axes."""
    return 2.0 * (q1 * q2 + q0 * q3), (q0 * q0 - q1 * q1) + (q2 * q2 - q3 * q3), 2.0 * (q2 * q3 - q0 * q1)


@physics
def turned_slightly(q0, q1, q2, q3, x, y, z):
    """Vector part of q after a further rotation by the small angles x, y, z [rad] about body axes, to first order."""
    x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    return q1 + (q0 * x + (q2 * z - q3 * y)), q2 + (q0 * y + (q3 * x - q1 * z)), q3 + (q0 * z + (q1 * y - q2 * x))


def rotation_quaternion(vector: np.ndarray) -> np.ndarray:
    """Quaternion [4, n] of a rotation about `vector` [3, n] by its length [rad].  NumPy."""
    half = 0.5 * np.sqrt((vector * vector).sum(axis=0))
    return np.array([np.cos(half), *(0.5 * np.sinc(half / np.pi) * vector)])
