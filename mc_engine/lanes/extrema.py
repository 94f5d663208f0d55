"""Running extrema of outputs along a flight, interpolated between the grid points.

Once an output is NaN, its extreme value is NaN.  Its last time above a level is a number if it is above it later.
"""

from mc_engine.lanes.functions import maximum, minimum, where
from mc_engine.lanes.physics_function import physics

# what flights with adaptive steps track as one; a corner is a peak that is taken at steps and events
EVENT, PEAK, CORNER, LAST = 0.0, 1.0, 2.0, 3.0
ALIKE = 4.0  # times as strongly; a Gauss curve with a deviation of two steps bends up to 2.6 times as strongly


@physics
def first_time(value, t):
    """The time of an extremum at its first value: t."""
    return t


@physics
def crest(v0, v1, v2, best):
    """Mask: the middle of three neighbouring values is the largest and may exceed the best so far, or it is NaN."""
    return not ((v1 < v0) | (v1 < v2) | (v1 + abs(v1 - v0) + abs(v1 - v2) <= best))


@physics
def smooth_where_bent_alike(smooth, v0, v1, v2, v3, v4, t0, t1, t2, t3, t4):
    """`smooth` where five values show no jump or corner, else 0.

    The curvature at the middle value must be at most ALIKE times the curvature on either side of it.  A side is not
    tested if its two outer values are at the same time, or nearly so at the end.
    """
    a, b, c, d = t1 - t0, t2 - t1, t3 - t2, t4 - t3
    before = ((v2 - v1) / b - (v1 - v0) / a) / (a + b)
    bend = ((v3 - v2) / c - (v2 - v1) / b) / (b + c)
    after = ((v4 - v3) / d - (v3 - v2) / c) / (c + d)
    alike = ((a <= 0.0) | (bend >= ALIKE * before)) & ((d <= 1e-3 * c) | (bend >= ALIKE * after))
    return where(alike, smooth, 0.0)


@physics
def _vertex(t0, t1, t2, v0, v1, v2):
    """Time from t1 to the vertex of the parabola through three points; 0 if they are on a straight line."""
    a, b = t1 - t0, t2 - t1
    left, right = (v1 - v0) * b, (v2 - v1) * a
    bend = left - right
    shift = 0.5 * (left * b + right * a) / where(bend == 0.0, 1.0, bend)
    return where(bend == 0.0, 0.0, shift)


@physics
def crest_time(when, best, v0, v1, v2, t0, t1, t2, smooth, mask):
    """Time of the best value so far, including the crest of the last three values where the mask holds."""
    value = crest_value(best, best, v0, v1, v2, t0, t1, t2, smooth, mask)
    when = where(value > best, t1 + smooth * _vertex(t0, t1, t2, v0, v1, v2), when)
    return where(value == value, when, value)


@physics
def crest_value(best, unused, v0, v1, v2, t0, t1, t2, smooth, mask):
    """Best value so far, including the crest of the last three values where the mask holds.

    smooth : 1.0 takes the crest of the parabola, 0.0 the middle value itself.
    """
    a, b = t1 - t0, t2 - t1
    usable = mask & (v1 >= v0) & (v1 >= v2) & (a > 0.0) & (b > 0.0)
    x = smooth * _vertex(t0, t1, t2, v0, v1, v2)
    # the parabola through the three points, about the middle one
    scale = where(usable, a * b * (a + b), 1.0)
    slope = ((v1 - v0) * b * b + (v2 - v1) * a * a) / scale
    bend = ((v2 - v1) * a - (v1 - v0) * b) / scale
    top = v1 + x * (slope + x * bend)
    return where(mask & (v1 != v1), v1, where(usable & (top > best), top, best))


@physics
def crest_start(v0, v1, v2, back, first, last):
    """Steps from the newest value to the vertex of the parabola through three neighbouring values of one motion.

    back : of the middle value, steps before the newest.  first, last : masks of lanes where it is an end of its motion;
    there the search starts half a step inwards.
    """
    bend = v0 - 2.0 * v1 + v2
    shift = where(bend < 0.0, 0.5 * (v0 - v2) / where(bend < 0.0, bend, -1.0), 0.0)
    return where(first, 0.5, where(last, -0.5, shift)) - back


@physics
def nearer_crest(x, slope, bend, low, high):
    """One step of Newton's method to the zero of a slope that falls, within bounds."""
    return minimum(maximum(x - where(bend < 0.0, slope / where(bend < 0.0, bend, -1.0), 0.0), low), high)


@physics
def is_top(v0, v1, v2):
    """Mask: the middle of three neighbouring values is the largest, or is NaN."""
    return not ((v1 < v0) | (v1 < v2))


@physics
def is_inside(x, value, v1, low, high, smooth):
    """Mask: a value between grid points is taken, not the neighbouring one at a grid point."""
    return (smooth > 0.0) & (x > low) & (x < high) & (value > v1)


@physics
def top(inside, value, v1):
    return where(inside, value, v1)


@physics
def top_time(inside, x, back, t, h):
    """Time [s] of x steps of h after t where the mask holds; else of the grid point `back` steps before t."""
    return t + where(inside, x, -back) * h


@physics
def fall_start(w1, w2, back, falling):
    """Steps from the newest value to the zero of the chord that begins at the value `back` steps before it."""
    return where(falling, w1 / where(falling & (w1 > w2), w1 - w2, 1.0), 0.5) - back


@physics
def nearer_zero(x, value, slope, back):
    """One step of Newton's method to the zero of a falling value, in the step that begins `back` steps before."""
    return minimum(maximum(x - where(slope < 0.0, value / where(slope < 0.0, slope, -1.0), 0.0), -back), 1.0 - back)


@physics
def later_fall(when, x, chord, smooth, t, h, mask):
    """Last time above zero, x steps of h [s] after t where the mask holds, `chord` steps if not smooth, if later."""
    time = t + where(smooth > 0.0, x, chord) * h
    return where(mask & (time > when), time, when)


@physics
def end_value(best, value, mask):
    """Best value so far, including the value at an event or at the end of the flight where the mask holds."""
    return where(mask & ((value > best) | (value != value)), value, best)


@physics
def end_time(when, best, value, t, mask, unused):
    """Time of the best value so far, including an event or the end of the flight where the mask holds."""
    return where(mask & (value > best), t, where(mask & (value != value), value, when))


@physics
def above(when, v1, t1, mask):
    """Last time at which the value was above zero at a step."""
    return where(mask & (v1 > 0.0), t1, where(mask & (v1 != v1), v1, when))


@physics
def falls(v0, v1, mask):
    """Mask: the value has come down to zero or below between two neighbours."""
    return mask & (v0 > 0.0) & (v1 <= 0.0)


@physics
def fall_time(when, v0, v1, t0, t1, mask):
    """Last time above zero, by linear interpolation where the value came down between two neighbours, if that is later:
    at an event between them it may have been above."""
    falling = falls(v0, v1, mask)
    return where(falling, maximum(when, t0 + (t1 - t0) * (v0 / where(falling, v0 - v1, 1.0))), when)
