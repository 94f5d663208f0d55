"""Design of the reference path and of its stored gains, once for all cases.  NumPy, SI.

The planned vehicle flies the planned entry in the standard atmosphere, its bank held and its side force averaged out
by reversals.  Along it the differences (altitude, flight-path angle, range) at equal speed are a linear system in
the speed lost, and a backward Riccati equation gives the gains of the vertical share of the lift.
"""

from collections import namedtuple
from functools import lru_cache
from itertools import count

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.reentry.air import GAS_CONSTANT, sound_speed
from campaigns.reentry.guidance import reference_table as table
from campaigns.reentry.guidance.apollo_final_phase import influence_rows
from campaigns.reentry.guidance.plan import Plan
from campaigns.reentry.guidance.reference_table import FELT, LAST_SPEED, STEERED
from campaigns.reentry.guidance.vinh import gravity, rates
from campaigns.reentry.inputs import APOLLO, APOLLO_LAW, ELLIPSOID, J2, LAW2, NO_GRAVITY, US76
from campaigns.reentry.planets import PLANETS
from campaigns.reentry.vehicles import apollo_shares
from mc_engine.errors import ModelError
from mc_engine.model import Refusals
from mc_engine.physics.aerodynamics import axial_coefficient
from mc_engine.physics.atmosphere import us76_logarithm, us76_of_array
from mc_engine.physics.constants import J2_EARTH
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


# The path at the times t [s]; float64[n], SI.  speed, path: over ground; along: range; lost: speed lost since FELT, 0
# before; climb: rate of the altitude; drag: acceleration; axial: deceleration along the body axis
Reference = namedtuple("Reference", "t r latitude speed path heading along lost altitude climb drag axial")


class Planner:
    """Motion of the planned vehicle about the planned world."""

    def __init__(self, plan: Plan):
        """plan : SI numbers of one plan; the temperature [K] of an exponential atmosphere is g H0 / R."""
        self.plan = plan
        planet = list(PLANETS.values())[int(plan.planet)]
        e2 = planet.e2 if plan.shape == ELLIPSOID else 0.0
        self.radius, self.e2, self.mu, self.air = plan.ground, e2, planet.mu, planet.air
        self.polar_radius = plan.ground * np.sqrt(1.0 - e2)
        self.rate = planet.rate if plan.rotating > 0.5 else 0.0
        self.j2 = J2_EARTH if plan.gravity == J2 else 0.0
        self.free = plan.gravity == NO_GRAVITY
        self.temperature = planet.mu / plan.ground**2 * planet.air[1] / GAS_CONSTANT

    def height(self, r, latitude):
        """(altitude [m], slope of the ellipsoid's radius by the squared sine of latitude)."""
        return over_ellipsoid(r, 1.0 / r, np.sin(latitude) ** 2, self.polar_radius, self.e2)

    def forces(self, r, latitude, v):
        """(drag, whole lift), accelerations [m/s^2]."""
        h = self.height(r, latitude)[0]
        standard = self.plan.atmosphere == US76
        density = us76_of_array(h) if standard else self.air[0] * np.exp(-h / self.air[1])
        drag = 0.5 * density * v * v * self.plan.drag
        lift = drag * self.plan.lift_to_drag
        if self.plan.vehicle == APOLLO:
            of_drag, of_lift = apollo_shares(v / sound_speed(us76_logarithm(h)[2] if standard else self.temperature))
            drag, lift = of_drag * drag, of_lift * lift
        return drag, lift

    def axial(self, r, latitude, v):
        """Deceleration along the body axis [m/s^2]."""
        return axial_coefficient(*self.forces(r, latitude, v), np.cos(self.plan.trim), np.sin(self.plan.trim))

    def motion(self, r, latitude, v, path, heading, share):
        """Vinh's rates with a share of the lift in the vertical plane, the rate of the range, and the drag; SI."""
        drag, lift = self.forces(r, latitude, v)
        g_in, g_north = (0.0 * r, 0.0 * r) if self.free else gravity(r, latitude, self.mu, self.j2)
        six = rates(r, latitude, v, path, heading, drag, lift * share, 0.0, g_in, g_north, self.rate)
        return six, v * np.cos(path) * self.radius / r, drag

    def start(self) -> np.ndarray:
        """(r, longitude, latitude, v, path, heading, range, speed lost) of the planned entry."""
        p = self.plan
        return np.array([p.radius, 0.0, p.latitude, p.speed, p.path, p.heading, 0.0, 0.0])


def fly_reference(planner: Planner, rows: int = 4000) -> Reference:
    """The reference from the planned entry down to plan_stop_altitude, at equal steps of time, SI."""

    begin = planner.start()
    if planner.height(begin[0], begin[2])[0] <= planner.plan.end:
        raise ModelError("the planned entry lies below plan_stop_altitude_km, where its reference path is to end")
    evaluated = count(1)

    def derivative(t, y):
        if next(evaluated) > MOST_EVALUATIONS:
            raise ModelError("the reference path of the planned entry cannot be integrated; check the plan_ parameters")
        r, _, latitude, v, path, heading, _, _ = y
        six, along, _ = planner.motion(r, latitude, v, path, heading, planner.plan.share)
        axial = planner.axial(r, latitude, v)
        return [*six, along, axial if axial > FELT else 0.0]

    def low(t, y):
        return planner.height(y[0], y[2])[0] - planner.plan.end

    low.terminal, low.direction = True, -1.0  # type: ignore[attr-defined]
    path = scipy.integrate.solve_ivp(
        derivative, (0.0, 5000.0), begin, "DOP853", rtol=1e-10, atol=1e-9, events=low, dense_output=True
    )
    if path.t_events[0].size == 0:
        raise ModelError(
            "the planned entry does not come down to plan_stop_altitude_km, so that there is no reference path"
        )
    t = np.linspace(0.0, path.t[-1], rows)
    r, _, latitude, v, angle, heading, along, lost = path.sol(t)
    six, _, drag = planner.motion(r, latitude, v, angle, heading, planner.plan.share)
    altitude, slope = planner.height(r, latitude)
    climb = six[0] - slope * np.sin(2.0 * latitude) * six[2]
    return Reference(
        t=t,
        r=r,
        latitude=latitude,
        speed=v,
        path=angle,
        heading=heading,
        along=along,
        lost=lost,
        altitude=altitude,
        climb=climb,
        drag=drag,
        axial=planner.axial(r, latitude, v),
    )


def steered_part(path: Reference) -> slice:
    """Where the laws command: from STEERED [m/s^2] down to LAST_SPEED [m/s]."""
    first = int(np.argmax(path.drag > STEERED))
    if path.drag[first] <= STEERED:
        raise ModelError("the planned entry never has 0.15 g of drag, so that no law could steer")
    last = int(np.argmax((path.speed < LAST_SPEED) & (path.t > path.t[first])))
    return slice(first, last + 1 if last else path.t.size)  # the last row is below, so that law 3 gets there


def linear_system(planner: Planner, path: Reference) -> tuple[np.ndarray, np.ndarray]:
    """(A [n, 3, 3], B [n, 3]) of x' = A x + B u by the speed lost; x: altitude [km], path angle [deg], range [km]."""

    def slopes(dh, dpath, dshare):
        six, along, _ = planner.motion(
            path.r + dh, path.latitude, path.speed, path.path + dpath, path.heading, planner.plan.share + dshare
        )
        return -np.array([six[0], six[4], along]) / six[3]

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


# index at which each case's reference path begins in the tables, and its range [m]; both 0 without one
StoredReferences = namedtuple("StoredReferences", "start range tables")


def stored_references(plans: Plan, asked: np.ndarray, first: int, refusals: Refusals) -> StoredReferences:
    """The reference paths of the plans (float64[n] each), one for all cases of the same plan.

    asked : bool[n], cases with a law;  first : index at which the first reference begins.  Cases whose plan has no
    reference path join `refusals`.
    """
    columns = np.array([np.broadcast_to(column, asked.shape) for column in plans])
    start, along, tables = np.zeros(asked.size), np.zeros(asked.size), [np.empty(0)]
    asked = asked & ~refusals.mask
    if not asked.any():
        return StoredReferences(start, along, tables[0])
    distinct, which = np.unique(columns[:, asked], axis=1, return_inverse=True)
    # an error and not a refusal: what a case comes to must not depend on the cases it is prepared with
    if distinct.shape[1] > MOST_PLANS:
        raise ModelError(
            f"the cases plan more than {MOST_PLANS} different entries, vehicles or banks, and each would need a "
            'reference path of its own; disperse the errors and factors instead, or set plan = "given" with plan_...'
        )
    for k, numbers in enumerate(distinct.T):
        mine = np.flatnonzero(asked)[which.ravel() == k]
        reference = reference_table_of(Plan(*(float(number) for number in numbers)))
        if isinstance(reference, str):
            refusals.reason[mine] = reference
        else:
            start[mine], along[mine] = first + sum(stored.size for stored in tables), reference[table.RANGE]
            tables.append(reference)
    return StoredReferences(start, along, np.concatenate(tables))


@lru_cache(maxsize=64)
def reference_table_of(plan: Plan) -> np.ndarray | str:
    """What `reference_table` reads, designed for one plan; or the sentence that says why there is no reference."""
    try:
        return _designed(plan)
    except ModelError as error:
        return str(error)


def _designed(plan: Plan) -> np.ndarray:
    """The table of one plan; ModelError if its path does not come down, or never meets air enough."""
    out = np.zeros(table.LENGTH)
    planner = Planner(plan)
    path = fly_reference(planner)
    out[table.RANGE] = path.along[-1]
    _write_clock(out, path)
    if plan.law == APOLLO_LAW:
        speed, columns = influence_rows()
        out[table.FIRST_SPEED] = speed[0]
        out[table.SPEED_DENSITY] = _write_rows(out, table.SPEED_TABLE, speed[0] - speed, columns)
    else:
        _write_path(out, planner, path, PROFILE_SET if plan.law == LAW2 else RANGE_SET)
    return out


def _write_path(out: np.ndarray, planner: Planner, path: Reference, weights: Weights) -> None:
    """Path and gains over the speed [m/s], and over the speed lost [m/s], SI."""
    part = steered_part(path)
    steered = Reference(*(column[part] for column in path))
    lost = steered.speed[0] - steered.speed
    gains = riccati_gains(lost, *linear_system(planner, steered), weights)
    columns = [steered.altitude, steered.path, steered.along, steered.drag, steered.climb, *gains.T]
    out[table.FIRST_SPEED] = steered.speed[0]
    out[table.SPEED_DENSITY] = _write_rows(out, table.SPEED_TABLE, lost, columns)
    felt = (path.lost > 0.0) & (path.t <= steered.t[-1])
    over = [path.axial, np.log(path.axial), path.speed, np.gradient(path.along, path.t), path.along]
    # before the laws command, the gains are those of their first row
    stored = [np.interp(path.t[felt], steered.t, gain) for gain in gains.T]
    columns = [*(column[felt] for column in over), *stored]
    out[table.LOST_DENSITY] = _write_rows(out, table.LOST_TABLE, path.lost[felt], columns)


def _write_clock(out: np.ndarray, path: Reference) -> None:
    """The range by the clock until the air is felt: a parabola through the entry, with range and rate of its end.

    SI; derived here: s = along + rate (t - end) + bend (t - end)^2 with s(0) = 0.
    """
    k = max(2, int(np.argmax(path.lost > 0.0)))
    end, along = path.t[k], path.along[k]
    rate = np.gradient(path.along[: k + 1], path.t[: k + 1])[-1]
    out[table.CLOCK_TIME], out[table.CLOCK_RANGE], out[table.CLOCK_RATE] = end, along, rate
    out[table.CLOCK_BEND] = (rate * end - along) / end**2


def _write_rows(out: np.ndarray, start: int, lost: np.ndarray, columns: list[np.ndarray]) -> float:
    """Resample columns over a rising speed lost to the rows of a table; returns rows per unit of the logarithm."""
    top = np.log1p(lost[-1] / table.SPREAD)
    nodes = table.SPREAD * np.expm1(np.linspace(0.0, top, table.ROWS))
    rows = np.array([np.interp(nodes, lost, column) for column in columns]).T
    out[start : start + rows.size] = rows.ravel()
    return float((table.ROWS - 1) / top)
