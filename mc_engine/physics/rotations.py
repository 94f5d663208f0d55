"""Attitude as quaternions, direction cosines, Euler angles and rotation vectors, with one convention.

A `Quaternion` is (q0, q1, q2, q3), scalar first, of unit length; products are Hamilton's.  `b_from_a` is the rotation
of frame b relative to frame a.  `transformed(b_from_a, v_a)` gives the components in b of a vector given in a, as does
its matrix `to_matrix(b_from_a)`.  `mc_engine.physics.attitude` has the same convention.  `chained(b_from_a, c_from_b)`
is c_from_a.  q and -q are the same attitude.  `rotated` uses a quaternion in the other sense: it rotates the vector and
keeps the axes.

M. J. Sidi, Spacecraft Dynamics and Control (1997), appendix A.4;  M. D. Shuster, A survey of attitude
representations, J. Astronautical Sciences 41 (1993) 439-517.
"""

from collections import namedtuple

from mc_engine.errors import ModelError
from mc_engine.lanes import atan2, cos, physics, sin, sincos, sqrt, where
from mc_engine.physics.attitude import quaternion_rates
from mc_engine.physics.vectors import Matrix, Vector, added, cross, dot, unit

Quaternion = namedtuple("Quaternion", "q0 q1 q2 q3")

_PI, _TURN = 3.141592653589793, 6.283185307179586


@physics
def product(p, q):
    """Hamilton's product of two quaternions, p q."""
    return Quaternion(
        p.q0 * q.q0 - p.q1 * q.q1 - p.q2 * q.q2 - p.q3 * q.q3,
        p.q0 * q.q1 + p.q1 * q.q0 + p.q2 * q.q3 - p.q3 * q.q2,
        p.q0 * q.q2 + p.q2 * q.q0 + p.q3 * q.q1 - p.q1 * q.q3,
        p.q0 * q.q3 + p.q3 * q.q0 + p.q1 * q.q2 - p.q2 * q.q1,
    )


@physics
def chained(b_from_a, c_from_b):
    """c_from_a: first from a to b, then from b to c."""
    return product(b_from_a, c_from_b)


@physics
def inverse(b_from_a):
    """a_from_b: the conjugate of a unit quaternion."""
    return Quaternion(b_from_a.q0, -b_from_a.q1, -b_from_a.q2, -b_from_a.q3)


@physics
def normalized(q):
    """The quaternion scaled to length 1; NaN for a zero quaternion."""
    u = 1.0 / sqrt(q.q0 * q.q0 + q.q1 * q.q1 + q.q2 * q.q2 + q.q3 * q.q3)
    return Quaternion(u * q.q0, u * q.q1, u * q.q2, u * q.q3)


@physics
def rotated(q, v):
    """The vector v rotated by q, in unchanged axes: q (0, v) q*, as v + 2 q0 (qv x v) + 2 qv x (qv x v)."""
    axis = Vector(q.q1, q.q2, q.q3)
    t = cross(axis, v)
    u = cross(axis, t)
    return Vector(
        v.x + 2.0 * (q.q0 * t.x + u.x), v.y + 2.0 * (q.q0 * t.y + u.y), v.z + 2.0 * (q.q0 * t.z + u.z)
    )  # fmt: skip


@physics
def transformed(b_from_a, v_a):
    """Components in frame b of a vector with components v_a in frame a."""
    return rotated(inverse(b_from_a), v_a)


@physics
def transformed_back(b_from_a, v_b):
    """Components in frame a of a vector with components v_b in frame b."""
    return rotated(b_from_a, v_b)


@physics
def to_matrix(b_from_a):
    """Direction cosines: the Matrix that takes components in a to components in b."""
    q0, q1, q2, q3 = b_from_a
    return Matrix(
        q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3, 2.0 * (q1 * q2 + q0 * q3), 2.0 * (q1 * q3 - q0 * q2),
        2.0 * (q1 * q2 - q0 * q3), q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3, 2.0 * (q2 * q3 + q0 * q1),
        2.0 * (q1 * q3 + q0 * q2), 2.0 * (q2 * q3 - q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3,
    )  # fmt: skip


@physics
def from_matrix(b_from_a):
    """The quaternion b_from_a of a Matrix of direction cosines, with its largest component positive.

    S. W. Shepperd, J. Guidance and Control 1 (1978) 223-224: the largest component is found first.
    """
    m = b_from_a
    s0, s1 = 1.0 + m.xx + m.yy + m.zz, 1.0 + m.xx - m.yy - m.zz
    s2, s3 = 1.0 - m.xx + m.yy - m.zz, 1.0 - m.xx - m.yy + m.zz
    d1, d2, d3 = m.yz - m.zy, m.zx - m.xz, m.xy - m.yx
    p1, p2, p3 = m.yz + m.zy, m.zx + m.xz, m.xy + m.yx
    best, q = s0, Quaternion(s0, d1, d2, d3)
    best, q = _better(best, q, s1, Quaternion(d1, s1, p3, p2))
    best, q = _better(best, q, s2, Quaternion(d2, p3, s2, p1))
    best, q = _better(best, q, s3, Quaternion(d3, p2, p1, s3))
    return normalized(q)


@physics
def _better(best, q, other, r):
    """The larger of two components and the quaternion that goes with it."""
    m = other > best
    return where(m, other, best), Quaternion(
        where(m, r.q0, q.q0), where(m, r.q1, q.q1), where(m, r.q2, q.q2), where(m, r.q3, q.q3)
    )


@physics
def from_rotation_vector(v):
    """b_from_a of a rotation about v by its length [rad]; v has the same components in a and b."""
    angle2 = dot(v, v)
    small = angle2 < 1e-8
    angle = sqrt(where(small, 1.0, angle2))
    # two terms of the series: the next is below 1e-19 of the first
    share = where(small, 0.5 - angle2 * (1.0 / 48.0), sin(0.5 * angle) / angle)
    return Quaternion(where(small, 1.0 - 0.125 * angle2, cos(0.5 * angle)), share * v.x, share * v.y, share * v.z)


@physics
def to_rotation_vector(b_from_a):
    """The rotation vector [rad] of the shorter rotation from a to b, of length 0 to pi."""
    q0, q1, q2, q3 = b_from_a
    sign = where(q0 < 0.0, -1.0, 1.0)
    size = sqrt(q1 * q1 + q2 * q2 + q3 * q3)
    small = size < 1e-12
    share = sign * where(small, 2.0, 2.0 * atan2(size, sign * q0) / where(small, 1.0, size))
    return Vector(share * q1, share * q2, share * q3)


@physics
def from_small_angles(angles):
    """b_from_a of small angles [rad] about the three axes, of unit length: the error is the cube of the angle / 12."""
    return normalized(Quaternion(1.0, 0.5 * angles.x, 0.5 * angles.y, 0.5 * angles.z))


@physics
def from_two_vectors(a, b):
    """The shortest rotation q with rotated(q, a) along b; for opposite vectors, half a turn about a perpendicular axis.

    a, b : of lengths from 1e-150 to 1e154, not zero.  As a frame rotation, the second frame is the first one rotated by
    q.  The direction is accurate to 1e-15, also for nearly opposite vectors: there the sum of both directions h has no
    rounding, and cos(angle / 2) and the axis are computed from it as |h|^2 / 2 and a x h.
    """
    a, b = unit(a), unit(b)
    h = added(a, b)
    c = cross(a, h)
    w = 0.5 * dot(h, h)
    # an axis across a: its vector product with the axis that it has the smallest component along
    ax, ay, az = abs(a.x), abs(a.y), abs(a.z)
    along_x, along_y = (ax <= ay) & (ax <= az), ay <= az
    e = Vector(where(along_x, 1.0, 0.0), where(along_x, 0.0, where(along_y, 1.0, 0.0)),
               where(along_x, 0.0, where(along_y, 0.0, 1.0)))  # fmt: skip
    across = cross(a, e)
    opposite = w < 1e-30  # to rounding
    return normalized(Quaternion(where(opposite, 0.0, w), where(opposite, across.x, c.x),
                                 where(opposite, across.y, c.y), where(opposite, across.z, c.z)))  # fmt: skip


@physics
def derivative(b_from_a, rate_b):
    """Time derivative [1/s] of b_from_a for the angular rate [rad/s] of b relative to a, in axes of b: q (0, w) / 2."""
    q = b_from_a
    return Quaternion(*quaternion_rates(q.q0, q.q1, q.q2, q.q3, rate_b.x, rate_b.y, rate_b.z))


@physics
def derivative_held(b_from_a, rate_b, gain):
    """The `derivative` plus gain (1 - |q|^2) q / 2 [gain: 1/s], which holds |q| at 1 against integration errors."""
    q, d = b_from_a, derivative(b_from_a, rate_b)
    k = 0.5 * gain * (1.0 - (q.q0 * q.q0 + q.q1 * q.q1 + q.q2 * q.q2 + q.q3 * q.q3))
    return Quaternion(d.q0 + k * q.q0, d.q1 + k * q.q1, d.q2 + k * q.q2, d.q3 + k * q.q3)


@physics
def _wrapped(angle):
    """An angle between -2 pi and 2 pi [rad] as one between -pi and pi."""
    return where(angle > _PI, angle - _TURN, where(angle < -_PI, angle + _TURN, angle))


def euler_sequence(axes):
    """(from_angles, to_angles) for successive rotations about body axes, such as "321" for yaw, pitch, roll.

    axes : three digits of 1, 2, 3, adjacent ones different (twelve sequences); ModelError for others.
    from_angles(first, second, third) -> b_from_a, angles [rad];  to_angles(b_from_a) -> Vector of the three, first and
    third from -pi to pi, second from -pi/2 to pi/2 or, if first and third axis are the same, from 0 to pi.  If the
    second is at an end of its range, only the sum or difference of the others is determined; one such pair is returned.

    E. Bernardes and S. Viollet, PLoS ONE 17(11), e0276302 (2022): one formula for all sequences.
    """
    axes = str(axes)
    if len(axes) != 3 or not set(axes) <= set("123") or axes[0] == axes[1] or axes[1] == axes[2]:
        raise ModelError(f'"{axes}" is no Euler sequence; write three digits of 1, 2, 3, such as "321" or "313"')
    first, second, third = (int(axis) for axis in axes)

    @physics
    def from_angles(a, b, c):
        return product(product(_about(first, a), _about(second, b)), _about(third, c))

    return from_angles, _to_angles(first, second, third)


@physics
def _about(axis, angle):
    """Quaternion of a turn about one axis, 1, 2 or 3."""
    s, c = sincos(0.5 * angle)
    if axis == 1:
        return Quaternion(c, s, 0.0, 0.0)
    if axis == 2:
        return Quaternion(c, 0.0, s, 0.0)
    return Quaternion(c, 0.0, 0.0, s)


def _to_angles(first, second, third):
    """The way back of `euler_sequence`; the paper's axes are fixed ones, so its sequence is ours reversed."""
    proper = first == third
    i, j, k = third, second, 6 - first - second if proper else first
    sign = float((i - j) * (j - k) * (k - i) // 2)

    @physics
    def proper_angles(b_from_a):
        plus, minus, middle = _three_angles(b_from_a[0], b_from_a[i], b_from_a[j], sign * b_from_a[k])
        return Vector(_wrapped(plus + minus), middle, _wrapped(plus - minus))

    @physics
    def three_axes_angles(b_from_a):
        q0, qi, qj, qk = b_from_a[0], b_from_a[i], b_from_a[j], sign * b_from_a[k]
        plus, minus, middle = _three_angles(q0 - qj, qi + qk, qj + q0, qk - qi)
        return Vector(sign * _wrapped(plus + minus), middle - 0.5 * _PI, _wrapped(plus - minus))

    return proper_angles if proper else three_axes_angles


@physics
def _three_angles(a, b, c, d):
    """(half sum, half difference, second angle), with atan2 in place of the acos of the paper."""
    return atan2(b, a), atan2(d, c), 2.0 * atan2(sqrt(c * c + d * d), sqrt(a * a + b * b))


# yaw, pitch, roll: b_from_a = from_euler_321(yaw, pitch, roll)
from_euler_321, to_euler_321 = euler_sequence("321")


@physics
def advanced(b_from_a, rate_b, duration):
    """b_from_a after a duration [s] at a constant rate [rad/s] in axes of b: exact for any angle."""
    turn = Vector(rate_b.x * duration, rate_b.y * duration, rate_b.z * duration)
    return product(b_from_a, from_rotation_vector(turn))
