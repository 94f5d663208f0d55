"""Elementary functions on numbers and lanes: branch-free, the same bits at every width.

Errors, the largest among tens of millions of arguments: at most 1 ulp for log, 1.01 ulp for rsqrt, 1.5 ulp for exp and
pow, 1.6 ulp for sin and cos, 2.1 ulp for atan and atan2, 2.7 ulp for asin and acos, 3 ulp for tan.  Angles up to 1e9
rad keep that accuracy; for larger ones the reduction gradually loses digits, and from 7e15 rad on the result is
meaningless.  A NaN argument gives NaN.  Zeros and infinities are as in C99, rsqrt's as in C23, except that sin and tan
of -0.0 are 0.0 and rsqrt of -0.0 is infinity.
"""

from mc_engine.lanes.functions import (
    exponent,
    fma,
    inverse_root_guess,
    mantissa,
    maximum,
    minimum,
    rint,
    scaled,
    sign_copied,
    sqrt,
    where,
)
from mc_engine.lanes.physics_function import physics

_INF = float("inf")
_NAN = float("nan")

# pi/2 and pi/4 in unevaluated sums of doubles
_HALF_PI, _HALF_PI_2, _HALF_PI_3 = 1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33
_QUARTER_PI, _QUARTER_PI_2 = 0.7853981633974483, 3.061616997868383e-17
_PI, _PI_2 = 3.141592653589793, 1.2246467991473532e-16
_TAN_EIGHTH_PI = 0.4142135623730951

# ln 2 with 21 trailing zero bits, so that n * _LN2 is exact for every exponent n
_LN2, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_LOG2_E = 1.4426950408889634
# e**r = 1 + r + r**2 / 2 + c3 r**3 + ... + c11 r**11, of the smallest relative error (5.9e-18) for |r| <= ln 2 / 2
_EXP = (
    0.16666666666666433, 0.041666666666604, 0.008333333333499915,
    0.0013888888926778442, 0.00019841269466431397, 2.480150870702109e-05,
    2.7557640736100665e-06, 2.762517634505255e-07, 2.497839973900035e-08,
)  # fmt: skip


@physics
def rsqrt(x):
    """1/sqrt(x); infinity from 0 to 2.2e-308, 0 at infinity, NaN below zero.

    Products and sums alone, of which a processor does many while it does one root or one quotient.
    With y a guess and e = 1 - x y**2, 1/sqrt(x) = y (1 - e)**-1/2: a fitted polynomial of e (relative error 7.5e-7),
    then Taylor terms of the rest.
    """
    y = inverse_root_guess(x)
    e = fma(-(x * y), y, 1.0)
    y = y * fma(fma(fma(e, 0.3130333839067852, 0.3762816181521908), e, 0.5000004762160797), e, 0.9999992505602853)
    e = fma(-(x * y), y, 1.0)
    y = fma(y * e, fma(e, 0.375, 0.5), y)
    y = where(x == _INF, 0.0, where(x < 2.2250738585072014e-308, _INF, y))
    return where(x < 0.0, _NAN, y)


@physics
def _exp_of_sum(x, x_low):
    """e**(x + x_low) for |x_low| below an ulp of x: Cody-Waite reduction, and a polynomial by Estrin's scheme."""
    x = minimum(maximum(x, -746.0), 710.0)
    n = rint(x * _LOG2_E)
    r = fma(n, -_LN2_LOW, fma(n, -_LN2, x)) + x_low
    r2 = r * r
    r4 = r2 * r2
    c3, c4, c5, c6, c7, c8, c9, c10, c11 = _EXP
    start = fma(fma(r, c3, 0.5), r2, r)
    low = fma(fma(r, c7, c6), r2, fma(r, c5, c4))
    high = fma(fma(r, c11, c10), r2, fma(r, c9, c8))
    return scaled(1.0 + fma(fma(high, r4, low), r4, start), n)


@physics
def exp(x):
    """e**x; overflows to infinity above 709.78, falls to zero through the subnormals below -708."""
    return _exp_of_sum(x, -0.0)  # adding -0.0 changes nothing, so it costs nothing


@physics
def _reduce_angle(x):
    """(r, quadrant): x = r + quadrant pi/2 with |r| <= pi/4; quadrant as 0.0, 1.0, 2.0 or 3.0."""
    n = rint(x * 0.6366197723675814)
    r = fma(n, -_HALF_PI_3, fma(n, -_HALF_PI_2, fma(n, -_HALF_PI, x)))
    # floor(n / 4) by rounding: n/4 - 3/8 is never half-way
    return r, n - 4.0 * rint(n * 0.25 - 0.375)


@physics
def _sin_kernel(r):
    """sin r for |r| <= pi/4.  Coefficients of fdlibm, k_sin.c (Sun Microsystems, 1993)."""
    z = r * r
    p = fma(z, fma(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08), 2.75573137070700676789e-06)
    p = fma(z, fma(z, p, -1.98412698298579493134e-04), 8.33333333332248946124e-03)
    return fma(z * r, fma(z, p, -1.66666666666666324348e-01), r)


@physics
def _cos_kernel(r):
    """cos r for |r| <= pi/4.  Coefficients of fdlibm, k_cos.c (Sun Microsystems, 1993)."""
    z = r * r
    p = fma(z, fma(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09), -2.75573143513906633035e-07)
    p = fma(z, fma(z, p, 2.48015872894767294178e-05), -1.38888888888741095749e-03)
    p = fma(z, p, 4.16666666666666019037e-02)
    half = 0.5 * z
    w = 1.0 - half
    return w + fma(z * z, p, (1.0 - w) - half)


@physics
def sincos(x):
    """(sin x, cos x) of the angle x [rad], with one reduction; both lose digits beyond 1e9 rad, all from 7e15 on."""
    r, quadrant = _reduce_angle(x)
    s, c = _sin_kernel(r), _cos_kernel(r)
    odd = (quadrant == 1.0) | (quadrant == 3.0)
    sine, cosine = where(odd, c, s), where(odd, s, c)
    return where(quadrant >= 2.0, -sine, sine), where((quadrant == 1.0) | (quadrant == 2.0), -cosine, cosine)


@physics
def sin(x):
    """Sine of x [rad]; it loses digits beyond 1e9 rad, and all from 7e15 rad on."""
    return sincos(x)[0]


@physics
def cos(x):
    """Cosine of x [rad]; it loses digits as the sine does."""
    return sincos(x)[1]


@physics
def tan(x):
    """Tangent of x [rad]: the quotient of the sine and cosine kernels; it loses digits as the sine does."""
    r, quadrant = _reduce_angle(x)
    s, c = _sin_kernel(r), _cos_kernel(r)
    odd = (quadrant == 1.0) | (quadrant == 3.0)
    return where(odd, -c, s) / where(odd, s, c)


@physics
def atan2(y, x):
    """Angle [rad] of the point (x, y), in [-pi, pi]; atan2(0, 0) is 0 or pi by the sign of x, as in C99.

    One division brings the ratio below tan(pi/8); there atan(t) = t + t z P(z), z = t**2, P fitted by
    Chebyshev nodes in 60-digit arithmetic (error below 2e-18).  |x| + |y| must not overflow.
    """
    ax, ay = abs(x), abs(y)
    swap = ay > ax
    large, small = where(swap, ay, ax), where(swap, ax, ay)
    # inf/inf and 0/0 stand for the ratios 1 and 0
    both_infinite = small == _INF
    large, small = where(both_infinite, 1.0, large), where(both_infinite, 1.0, small)
    large = where(large == 0.0, 1.0, large)
    steep = small > _TAN_EIGHTH_PI * large
    t = where(steep, small - large, small) / where(steep, small + large, large)
    z = t * t
    p = fma(z, fma(z, 0.016284375050043393, -0.03456931506332609), 0.045515447340221615)
    p = fma(z, fma(z, p, -0.05230443640686948), 0.05878927554473807)
    p = fma(z, fma(z, p, -0.0666642476020052), 0.07692296368042296)
    p = fma(z, fma(z, p, -0.09090908753259112), 0.11111111105150588)
    p = fma(z, fma(z, p, -0.14285714285659779), 0.19999999999999804)
    p = fma(z, p, -0.3333333333333333)
    # sum of the main angle and the small rest; the tails of pi enter with the rest
    angle, rest = where(steep, _QUARTER_PI, 0.0), fma(t * z, p, where(steep, _QUARTER_PI_2, 0.0))
    rest = rest + where(steep, t, 0.0)
    angle = where(steep, angle, t)
    angle, rest = where(swap, _HALF_PI - angle, angle), where(swap, _HALF_PI_2 - rest, rest)
    left = sign_copied(1.0, x) < 0.0
    angle, rest = where(left, _PI - angle, angle), where(left, _PI_2 - rest, rest)
    missing = (x != x) | (y != y)
    return where(missing, _NAN, sign_copied(angle + rest, y))


@physics
def atan(x):
    """Angle [rad] whose tangent is x, in [-pi/2, pi/2]."""
    return atan2(x, 1.0)


@physics
def asin(x):
    """Angle [rad] whose sine is x, in [-pi/2, pi/2]; NaN outside [-1, 1]."""
    return atan2(x, sqrt(fma(-x, x, 1.0)))


@physics
def acos(x):
    """Angle [rad] whose cosine is x, in [0, pi]; NaN outside [-1, 1]."""
    return atan2(sqrt(fma(-x, x, 1.0)), x)


@physics
def _split(x):
    """(n, m): |x| = 2**n m with sqrt(1/2) < m <= sqrt(2), for positive x, subnormal ones too."""
    tiny = abs(x) < 2.2250738585072014e-308
    x = where(tiny, x * 18014398509481984.0, x)  # 2**54
    n, m = exponent(x), mantissa(x)
    high = m > 1.4142135623730951
    return where(tiny, n - 54.0, n) + where(high, 1.0, 0.0), where(high, 0.5 * m, m)


@physics
def log(x):
    """Natural logarithm; -infinity at 0, NaN below.  Coefficients of fdlibm, e_log.c (Sun Microsystems, 1993)."""
    n, m = _split(x)
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    p = fma(z, fma(z, 1.479819860511658591e-01, 1.531383769920937332e-01), 1.818357216161805012e-01)
    p = fma(z, fma(z, p, 2.222219843214978396e-01), 2.857142874366239149e-01)
    p = z * fma(z, fma(z, p, 3.999999999940941908e-01), 6.666666666666735130e-01)
    half_f2 = 0.5 * f * f
    value = n * _LN2 - ((half_f2 - fma(s, half_f2 + p, n * _LN2_LOW)) - f)
    value = where(x == 0.0, -_INF, where(x == _INF, _INF, value))
    return where((x < 0.0) | (x != x), _NAN, value)


@physics
def _log_pair(x):
    """ln x for positive x as an unevaluated sum (high, low), good to about 2**-66 relative.

    ln m = 2 atanh(s), s = (m - 1)/(m + 1); the terms s and s**3 are carried in pairs of doubles.
    """
    n, m = _split(x)
    f, d = m - 1.0, m + 1.0
    s = f / d
    # m + 1 is rounded; its lost part and the division's remainder make the low word of s
    s_low = (fma(-s, d, f) - s * (m - (d - 1.0))) / d
    z = s * s
    z_low = fma(s, s, -z) + 2.0 * s * s_low
    # Taylor terms z**2 / 5 to z**12 / 25, the last below 2**-66
    far = fma(z, fma(z, fma(z, 1 / 25.0, 1 / 23.0), 1 / 21.0), 1 / 19.0)
    far = fma(z, fma(z, fma(z, far, 1 / 17.0), 1 / 15.0), 1 / 13.0)
    tail = z * z * fma(z, fma(z, fma(z, fma(z, far, 1 / 11.0), 1 / 9.0), 1 / 7.0), 0.2)
    third, third_low = 0.3333333333333333, 1.850371707708594e-17
    u = z * third
    u_low = fma(z, third, -u) + z * third_low + z_low * third
    q = u + tail
    q_low = (u - q) + tail + u_low
    cubic = s * q
    cubic_low = fma(s, q, -cubic) + s * q_low + s_low * q
    # n ln2 + 2 s + 2 cubic, largest first
    a = n * _LN2
    high = a + 2.0 * s
    low = where(n == 0.0, 0.0, 2.0 * s - (high - a))
    total = high + 2.0 * cubic
    low = low + (2.0 * cubic - (total - high)) + (2.0 * (s_low + cubic_low))
    # ln 2 below its first 32 bits, itself in two parts
    b = n * 1.90821492927058770002e-10
    b_low = fma(n, 1.90821492927058770002e-10, -b) + n * 1.1612227229362532e-26
    result = total + b
    return result, low + (b - (result - total)) + b_low


@physics
def pow(x, y):
    """x**y with the conventions of C99 for numbers: NaN for x < 0 unless y is whole; x**0 is 1."""
    ax = abs(x)
    usable = (ax > 0.0) & (ax < _INF)
    high, low = _log_pair(where(usable, ax, 1.0))
    y_used = maximum(-1e300, minimum(1e300, y))
    p = y_used * high
    p_low = where(abs(p) < 800.0, fma(y_used, high, -p) + y_used * low, 0.0)
    size = _exp_of_sum(p, p_low)
    grows = where(y > 0.0, _INF, 0.0)
    size = where(ax == 0.0, where(y > 0.0, 0.0, _INF), where(ax == _INF, grows, size))
    whole = rint(y) == y
    odd = whole & (abs(y) < 9007199254740992.0) & (rint(0.5 * y) != 0.5 * y)
    negative = sign_copied(1.0, x) < 0.0
    value = where(negative & odd, -size, size)
    value = where((x < 0.0) & usable & (rint(y) != y), _NAN, value)
    value = where((y == 0.0) | (x == 1.0), 1.0, value)
    return where((x != x) | (y != y), _NAN, value)
