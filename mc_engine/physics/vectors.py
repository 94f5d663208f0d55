"""Vectors of three components, in any frame and unit, which the names of variables state: `r_ecef`, `v_body`.

Written for named tuples with the fields x, y, z, such as `Vector`; results are `Vector`s.  Components may be numbers,
lanes or arrays.  A `Matrix` has its numbers row by row: xx, xy, xz, yx, yy, yz, zx, zy, zz; xy is in row x, column y.
"""

from collections import namedtuple

from mc_engine.lanes import physics, sqrt

Vector = namedtuple("Vector", "x y z")


@physics
def dot(a, b):
    """Scalar product a . b."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@physics
def cross(a, b):
    """Vector product a x b."""
    return Vector(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@physics
def norm(a):
    """Length of a, of 1e-150 to 1e154.

    The squares of shorter vectors lose digits and are zero below 1e-162; those of longer ones are infinite.
    """
    return sqrt(dot(a, a))


@physics
def unit(a):
    """Unit vector a / |a|, for lengths as in `norm`; NaN for the zero vector."""
    return scaled(1.0 / norm(a), a)


@physics
def scaled(factor, a):
    """Product of a number and the vector a."""
    return Vector(factor * a.x, factor * a.y, factor * a.z)


@physics
def added(a, b):
    """Sum a + b."""
    return Vector(a.x + b.x, a.y + b.y, a.z + b.z)


@physics
def subtracted(a, b):
    """Difference a - b."""
    return Vector(a.x - b.x, a.y - b.y, a.z - b.z)


@physics
def added_scaled(a, factor, b):
    """a + factor b."""
    return Vector(a.x + factor * b.x, a.y + factor * b.y, a.z + factor * b.z)


Matrix = namedtuple("Matrix", "xx xy xz yx yy yz zx zy zz")


@physics
def matrix_times(m, a):
    """Product of a Matrix and a vector."""
    return Vector(
        m.xx * a.x + m.xy * a.y + m.xz * a.z,
        m.yx * a.x + m.yy * a.y + m.yz * a.z,
        m.zx * a.x + m.zy * a.y + m.zz * a.z,
    )


@physics
def transposed_times(m, a):
    """Product of the transpose of a Matrix and a vector: for direction cosines, the inverse transformation."""
    return Vector(
        m.xx * a.x + m.yx * a.y + m.zx * a.z,
        m.xy * a.x + m.yy * a.y + m.zy * a.z,
        m.xz * a.x + m.yz * a.y + m.zz * a.z,
    )


@physics
def matrix_product(a, b):
    """Product of two matrices: c_from_a = matrix_product(c_from_b, b_from_a)."""
    return Matrix(
        a.xx * b.xx + a.xy * b.yx + a.xz * b.zx,
        a.xx * b.xy + a.xy * b.yy + a.xz * b.zy,
        a.xx * b.xz + a.xy * b.yz + a.xz * b.zz,
        a.yx * b.xx + a.yy * b.yx + a.yz * b.zx,
        a.yx * b.xy + a.yy * b.yy + a.yz * b.zy,
        a.yx * b.xz + a.yy * b.yz + a.yz * b.zz,
        a.zx * b.xx + a.zy * b.yx + a.zz * b.zx,
        a.zx * b.xy + a.zy * b.yy + a.zz * b.zy,
        a.zx * b.xz + a.zy * b.yz + a.zz * b.zz,
    )
