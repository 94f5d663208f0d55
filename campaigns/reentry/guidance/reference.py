"""Design of the reference path and of its stored gains, once for all cases.  NumPy, SI, angles over ground.

The planned vehicle flies the planned entry in the standard atmosphere, its bank held and its side force averaged out
by reversals.  Along it the differences (altitude, flight-path angle, range) at equal speed are a linear system in
the speed lost, and a backward Riccati equation gives the gains of the vertical share of the lift.
"""

from collections import namedtuple
from functools import lru_cache
from itertools import count

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.reentry.air import sound_speed
from campaigns.reentry.guidance import reference_table as stored
from campaigns.reentry.guidance.plan import Plan
from campaigns.reentry.inputs import CHOICES
from campaigns.reentry.vehicles import apollo_shares
from mc_engine.errors import ModelError
from mc_engine.model import Refusals
from mc_engine.physics.aerodynamics import axial_coefficient
from mc_engine.physics.atmosphere import us76_logarithm, us76_of_array
from mc_engine.physics.constants import EQUATORIAL_RADIUS, J2_EARTH
from mc_engine.physics.frames import over_ellipsoid

MOST_PLANS = 16  # different plans among the cases prepared at once: a grid, but no random draws
MOST_EVALUATIONS = 15_000  # of the rates of one reference path; the planned entries of the campaigns take some 3000
_KILOMETRE, _DEGREE = 1e3, np.pi / 180.0
_SCALES = np.array([_KILOMETRE, _DEGREE, _KILOMETRE])

# Riccati weights in km, degrees, km: final S, running Q on the altitude, R on the vertical share of the lift
Weights = namedtuple("Weights", "final altitude control")
# with and without a term in the range
RANGE_SET = Weights((1.0 / 5.0**2, 1.0 / 3.0**2, 1.0 / 2.0**2), 0.0, 4e-4)
PROFILE_SET = Weights((1.0 / 5.0**2, 1.0 / 3.0**2, 0.0), 1e-11 * _KILOMETRE**2, 2e-3)

# The path at the times t [s]; float64[..., n], SI.  state: r, longitude, latitude, speed and path angle over ground,
# heading, range, speed lost since FELT (0 before);  climb: rate of the altitude;  drag: acceleration;  axial:
# deceleration along the body axis
Reference = namedtuple("Reference", "t state altitude climb drag axial")
R, LATITUDE, SPEED, PATH, ALONG, LOST = 0, 2, 3, 4, 6, 7  # rows of the state


def gravity(r, latitude, mu, j2=J2_EARTH):
    """(inward, northward) acceleration [m/s^2] by a point mass with J2."""
    q = j2 * (EQUATORIAL_RADIUS / r) ** 2
    s, c = np.sin(latitude), np.cos(latitude)
    return mu / r**2 * (1.0 - 1.5 * q * (3.0 * s * s - 1.0)), -3.0 * mu / r**2 * q * s * c


def rates(r, latitude, v, path, heading, drag, lift, bank, g_in, g_north, omega):
    """Rates (SI) of (r, longitude, latitude, v, path, heading); drag, lift, g_in, g_north are accelerations.

    The motion of `dynamics.rhs`, but singular in vertical flight, at rest and over the poles.  N. X. Vinh,
    A. Busemann, R. D. Culp, Hypersonic and Planetary Entry Flight Mechanics (1980), chapter 2, with the heading from
    north, clockwise (Vinh: from east, counter-clockwise).
    """
    s, c = np.sin(path), np.cos(path)
    sh, ch = np.sin(heading), np.cos(heading)
    sl, cl = np.sin(latitude), np.cos(latitude)
    turn = omega**2 * r
    # of V path' and V heading', without and with the turning of the planet
    up = lift * np.cos(bank) - g_in * c - g_north * s * ch + v * v * c / r
    up = up + 2.0 * omega * v * cl * sh + turn * cl * (c * cl + s * sl * ch)
    right = lift * np.sin(bank) / c - g_north * sh / c + v * v * c * sh * sl / (cl * r)
    right = right - 2.0 * omega * v * (s / c * cl * ch - sl) + turn * sl * cl * sh / c
    faster = -drag - g_in * s + g_north * c * ch + turn * cl * (s * cl - c * sl * ch)
    return v * s, v * c * sh / (r * cl), v * c * ch / r, faster, up / v, right / v


def height(plan: Plan, state):
    """(altitude [m], slope of the ellipsoid's radius by the squared sine of latitude)."""
    r = state[R]
    return over_ellipsoid(r, 1.0 / r, np.sin(state[LATITUDE]) ** 2, plan.polar_radius, plan.e2)


def motion(plan: Plan, state, share):
    """(Vinh's rates of the state but its last, with a share of the lift in the vertical plane; drag, axial), SI."""
    r, _, latitude, v, path, heading = state[:6]
    h = height(plan, state)[0]
    standard = plan.atmosphere == CHOICES.atmosphere.us76
    density = us76_of_array(h) if standard else np.exp(plan.log_density - plan.inverse_scale * h)
    drag = 0.5 * density * v * v * plan.drag
    lift = drag * plan.lift_to_drag
    if plan.vehicle == CHOICES.vehicle.apollo:
        temperature = us76_logarithm(h)[2] if standard else plan.temperature
        of_drag, of_lift = apollo_shares(v / sound_speed(temperature))
        drag, lift = of_drag * drag, of_lift * lift
    g_in, g_north = gravity(r, latitude, plan.mu, plan.j2)
    six = rates(r, latitude, v, path, heading, drag, lift * share, 0.0, g_in, g_north, plan.rate)
    axial = axial_coefficient(drag, lift, np.cos(plan.trim), np.sin(plan.trim))
    return (*six, v * np.cos(path) * plan.radius / r), drag, axial


def fly_reference(plan: Plan, rows: int = 4000) -> Reference:
    """The reference from the planned entry down to plan_stop_altitude, at equal steps of time.  SI, radians."""
    evaluated = count(1)

    def derivative(t, state):
        if next(evaluated) > MOST_EVALUATIONS:
            raise ModelError("the reference path of the planned entry cannot be integrated; check the plan_ parameters")
        seven, _, axial = motion(plan, state, plan.share)
        return [*seven, axial if axial > stored.FELT else 0.0]

    def low(t, state):
        return height(plan, state)[0] - plan.end

    low.terminal, low.direction = True, -1.0  # type: ignore[attr-defined]
    begin = [plan.r, 0.0, plan.latitude, plan.speed, plan.path, plan.heading, 0.0, 0.0]
    if low(0.0, begin) <= 0.0:
        raise ModelError("the planned entry lies below plan_stop_altitude_km, where its reference path is to end")
    path = scipy.integrate.solve_ivp(
        derivative, (0.0, 5000.0), begin, "DOP853", rtol=1e-10, atol=1e-9, events=low, dense_output=True
    )
    if path.t_events[0].size == 0:
        raise ModelError(
            "the planned entry does not come down to plan_stop_altitude_km, so that there is no reference path"
        )
    t = np.linspace(0.0, path.t[-1], rows)
    state = path.sol(t)
    seven, drag, axial = motion(plan, state, plan.share)
    altitude, slope = height(plan, state)
    climb = seven[R] - slope * np.sin(2.0 * state[LATITUDE]) * seven[LATITUDE]
    return Reference(t, state, altitude, climb, drag, axial)


def steered_part(path: Reference) -> Reference:
    """Where the laws command: from STEERED [m/s^2] down to LAST_SPEED [m/s]."""
    first = int(np.argmax(path.drag > stored.STEERED))
    if path.drag[first] <= stored.STEERED:
        raise ModelError("the planned entry never has 0.15 g of drag, so that no law could steer")
    last = int(np.argmax((path.state[SPEED] < stored.LAST_SPEED) & (path.t > path.t[first])))
    # the last row is below, so that law 3 gets there
    return Reference(*(column[..., first : last + 1 if last else path.t.size] for column in path))


def linear_system(plan: Plan, path: Reference) -> tuple[np.ndarray, np.ndarray]:
    """(A [n, 3, 3], B [n, 3]) of x' = A x + B u by the speed lost; x: altitude [km], path angle [deg], range [km]."""

    def slopes(dh, dpath, dshare):
        """Rates of altitude [s], path angle [rad s/m], range [s] by speed lost, off the path by [m], [rad], a share."""
        state = path.state.copy()
        state[R] += dh
        state[PATH] += dpath
        seven = np.array(motion(plan, state, plan.share + dshare)[0])
        return -seven[[R, PATH, ALONG]] / seven[SPEED]

    steps = ((10.0, 0.0, 0.0), (0.0, 1e-5, 0.0), (0.0, 0.0, 1e-4))
    columns = [(slopes(*d) - slopes(*(-x for x in d))) / (2.0 * max(d)) / _SCALES[:, None] for d in steps]
    a = np.zeros((path.t.size, 3, 3))
    a[:, :, 0], a[:, :, 1] = columns[0].T * _KILOMETRE, columns[1].T * _DEGREE
    return a, columns[2].T


def riccati_gains(lost: np.ndarray, a: np.ndarray, b: np.ndarray, weights: Weights) -> np.ndarray:
    """Gains [n, 3] on (altitude [m], path angle [rad], range [m]) over the speed lost [m/s], rising.

    Minimises the final and the running cost of the linear system; the equation goes backward from the end.
    """
    final, running = np.diag(weights.final), np.diag([weights.altitude, 0.0, 0.0])
    flat_a = a.reshape(-1, 9)

    def backward(x, p):
        """Right side of the matrix Riccati equation at x [m/s] from the end: A'P + PA - P B B'P / control + running."""
        at = lost[-1] - x
        m = np.array([np.interp(at, lost, column) for column in flat_a.T]).reshape(3, 3)
        v = np.array([np.interp(at, lost, column) for column in b.T])
        p = p.reshape(3, 3)
        return (m.T @ p + p @ m - np.outer(p @ v, v @ p) / weights.control + running).ravel()

    span = lost[-1] - lost[0]
    solution = scipy.integrate.solve_ivp(
        backward, (0.0, span), final.ravel(), "LSODA", rtol=1e-7, atol=1e-9, dense_output=True
    )
    p = solution.sol(lost[-1] - lost).T.reshape(-1, 3, 3)
    return np.einsum("ni,nij->nj", b, p) / weights.control / _SCALES


def stored_references(
    plans: Plan, asked: np.ndarray, first: int, refusals: Refusals
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(index of each case's reference path in the tables, its range [m], both 0 without one; the tables), SI.

    plans : of float64[n]; cases of the same one share a path, and those whose plan has none join `refusals`
    asked : bool[n], cases with a law;  first : index at which the first path begins
    """
    columns = np.array([np.broadcast_to(column, asked.shape) for column in plans])
    start, along, tables = np.zeros(asked.size), np.zeros(asked.size), [np.empty(0)]
    asked = asked & ~refusals.mask
    if not asked.any():
        return start, along, tables[0]
    distinct, which = np.unique(columns[:, asked], axis=1, return_inverse=True)
    # an error and not a refusal: what a case comes to must not depend on the cases it is prepared with
    if distinct.shape[1] > MOST_PLANS:
        raise ModelError(
            f"the cases plan more than {MOST_PLANS} different entries, vehicles or banks, and each would need a "
            'reference path of its own; disperse the errors and factors instead, or set plan = "given" with plan_...'
        )
    for k, numbers in enumerate(distinct.T):
        mine = np.zeros(asked.size, dtype=bool)
        mine[asked] = which.ravel() == k
        reference = reference_table_of(Plan(*(float(number) for number in numbers)))
        if isinstance(reference, str):
            refusals.add(mine, reference)
        else:
            start[mine] = first + sum(table.size for table in tables)
            along[mine] = stored.Header(*reference[: len(stored.Header._fields)]).range
            tables.append(reference)
    return start, along, np.concatenate(tables)


@lru_cache(maxsize=64)
def reference_table_of(plan: Plan) -> np.ndarray | str:
    """What `reference_table` reads, designed for one plan; or the sentence that says why there is no reference."""
    try:
        path = fly_reference(plan)
        if plan.law == CHOICES.guidance.apollo:
            speed, columns, by_loss = *stored.influence_rows(), None
        else:
            weights = PROFILE_SET if plan.law == CHOICES.guidance.law2 else RANGE_SET
            speed, columns, by_loss = _path_and_gains(plan, path, weights)
    except ModelError as error:
        return str(error)
    speed_density, speed_rows = _resampled(speed[0] - speed, columns)
    lost_density, lost_rows = _resampled(*by_loss) if by_loss else (0.0, np.empty(0))
    header = stored.Header(
        first_speed=speed[0],
        speed_density=speed_density,
        lost_density=lost_density,
        range=path.state[ALONG, -1],
        **_clock(path),
    )
    return np.concatenate([header, speed_rows, lost_rows])


def _path_and_gains(plan: Plan, path: Reference, weights: Weights):
    """(speed [m/s], columns over it, (speed lost [m/s], columns over that)), SI."""
    part = steered_part(path)
    _, _, _, first, angle, _, along, _ = part.state
    gains = riccati_gains(first[0] - first, *linear_system(plan, part), weights).T
    felt = (path.state[LOST] > 0.0) & (path.t <= part.t[-1])
    if felt.sum() < 2:
        raise ModelError("on the planned entry the accelerometer along the axis feels no drag; check trim_angle_deg")
    _, _, _, speed, _, _, whole, lost = path.state
    over = [path.axial, np.log(path.axial), speed, np.gradient(whole, path.t), whole]
    # before the laws command, the gains are those of their first row
    held = [np.interp(path.t[felt], part.t, gain) for gain in gains]
    by_loss = lost[felt], [*(column[felt] for column in over), *held]
    return first, [part.altitude, angle, along, part.drag, part.climb, *gains], by_loss


def _clock(path: Reference) -> dict[str, float]:
    """The range by the clock until the air is felt: a parabola through the entry, with range and rate of its end.

    SI; derived here: s = range + rate (t - end) + bend (t - end)^2 with s(0) = 0.
    """
    k = max(2, int(np.argmax(path.state[LOST] > 0.0)))
    t, along = path.t[: k + 1], path.state[ALONG, : k + 1]
    end, rate = t[k], np.gradient(along, t)[-1]
    bend = (rate * end - along[k]) / end**2
    return {"clock_time": end, "clock_range": along[k], "clock_rate": rate, "clock_bend": bend}


def _resampled(lost: np.ndarray, columns: list[np.ndarray]) -> tuple[float, np.ndarray]:
    """(rows per unit of the logarithm, the rows of a table) of columns over a rising speed lost."""
    top = np.log1p(lost[-1] / stored.SPREAD)
    nodes = stored.SPREAD * np.expm1(np.linspace(0.0, top, stored.ROWS))
    return float((stored.ROWS - 1) / top), np.ravel([np.interp(nodes, lost, column) for column in columns], order="F")
