"""Design of the reference path and of its stored gains, once for all cases.  NumPy, SI.

The planned vehicle flies the planned entry in the standard atmosphere, its bank held and its side force averaged out
by reversals.  Along it the differences (altitude, flight-path angle, range) at equal speed are a linear system in
the speed lost, and a backward Riccati equation gives the gains of the vertical share of the lift.
"""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from campaigns.reentry import reference_table as table
from campaigns.reentry.apollo_final_phase import influence_rows
from campaigns.reentry.entry_state import World, entry_of
from campaigns.reentry.inputs import GUIDANCE
from campaigns.reentry.planets import PLANETS
from campaigns.reentry.reference_table import FELT, LAST_SPEED, STEERED
from campaigns.reentry.vehicles import VEHICLES, Vehicle
from campaigns.reentry.vinh import gravity, rates
from mc_engine.errors import ModelError
from mc_engine.model import Refusals
from mc_engine.physics.atmosphere import us76_of_array
from mc_engine.physics.constants import J2_EARTH
from mc_engine.physics.frames import over_ellipsoid

ELLIPSOID, US76, J2 = 0.0, 0.0, 0.0  # codes of settings
_KILOMETRE, _DEGREE = 1e3, np.pi / 180.0
_SCALES = np.array([_KILOMETRE, _DEGREE, _KILOMETRE])


@dataclass(frozen=True)
class Weights:
    """Riccati weights in km, degrees, km: final S, running Q on the altitude, R on the vertical share of the lift."""

    final: tuple[float, float, float]
    altitude: float
    control: float


# with and without a term in the range
RANGE_SET = Weights((1.0 / 5.0**2, 1.0 / 3.0**2, 1.0 / 2.0**2), 0.0, 4e-4)
PROFILE_SET = Weights((1.0 / 5.0**2, 1.0 / 3.0**2, 0.0), 1e-11 * _KILOMETRE**2, 2e-3)
WITHOUT_RANGE = ("law2", "law3")


@dataclass(frozen=True)
class Reference:
    """The path at the times t [s]; float64[n], SI.  speed, path over ground; axial: deceleration along the body axis.

    drag : acceleration;  climb : rate of the altitude;  along : range;  lost : speed lost since FELT, 0 before
    """

    t: np.ndarray
    r: np.ndarray
    latitude: np.ndarray
    speed: np.ndarray
    path: np.ndarray
    heading: np.ndarray
    along: np.ndarray
    lost: np.ndarray
    altitude: np.ndarray
    climb: np.ndarray
    drag: np.ndarray
    axial: np.ndarray


class Planner:
    """Motion of the planned vehicle about the planned world; o: the settings by symbol."""

    def __init__(self, o: Any):
        self.o = o
        planet = list(PLANETS.values())[int(o.planet)]
        e2 = planet.e2 if o.shape == ELLIPSOID else 0.0
        self.radius, self.e2, self.mu, self.air = planet.radius, e2, planet.mu, planet.air
        self.polar_radius = planet.radius * np.sqrt(1.0 - e2)
        self.rate = planet.rate if o.rotating > 0.5 else 0.0
        self.j2 = J2_EARTH if o.gravity == J2 else 0.0
        vehicle = planned_vehicle(o)
        self.drag_area = vehicle.area * vehicle.drag_coefficient / vehicle.mass
        self.lift_to_drag = vehicle.lift_coefficient / vehicle.drag_coefficient
        trim = np.radians(vehicle.trim_angle)
        self.axial_to_drag = np.cos(trim) + self.lift_to_drag * np.sin(trim)
        self.share = np.cos(o.plan_bank)

    def height(self, r, latitude):
        """(altitude [m], slope of the ellipsoid's radius by the squared sine of latitude)."""
        return over_ellipsoid(r, 1.0 / r, np.sin(latitude) ** 2, self.polar_radius, self.e2)

    def drag(self, r, latitude, v):
        """Drag acceleration [m/s^2]."""
        h = self.height(r, latitude)[0]
        density = us76_of_array(h) if self.o.atmosphere == US76 else self.air[0] * np.exp(-h / self.air[1])
        return 0.5 * density * v * v * self.drag_area

    def motion(self, r, latitude, v, path, heading, share):
        """Vinh's rates with a share of the lift in the vertical plane, the rate of the range, and the drag."""
        drag = self.drag(r, latitude, v)
        g_in, g_north = gravity(r, latitude, self.mu, self.j2)
        lift = drag * self.lift_to_drag * share
        six = rates(r, latitude, v, path, heading, drag, lift, 0.0, g_in, g_north, self.rate)
        return six, v * np.cos(path) * self.radius / r, drag

    def start(self) -> np.ndarray:
        """(r, longitude, latitude, v, path, heading, range, speed lost) of the planned entry."""
        entry = entry_of(planned_inputs(self.o), _one_case(self.o), self._world(), Refusals.none(1))
        r = np.sqrt((entry.position[:, 0] ** 2).sum())
        return np.array(
            [r, 0.0, self.o.plan_latitude, entry.speed[0], entry.path[0], entry.heading[0], 0.0, 0.0], dtype=float
        )

    def _world(self) -> World:
        one = np.ones(1)
        return World(
            self.mu * one, self.radius * one, self.polar_radius * one, self.e2 * one, self.rate * one, one < 0.0
        )


def planned_vehicle(o: Any) -> Vehicle:
    """The vehicle that is named, or one of the planned ballistic coefficient and lift-to-drag ratio."""
    chosen = int(o.vehicle)
    if chosen > 0:
        return list(VEHICLES.values())[chosen - 1]
    trim = float(np.degrees(o.plan_trim_angle))
    return Vehicle(o.plan_ballistic_coefficient, 1.0, 1.0, o.plan_lift_to_drag, trim, 1.0, "settings of the campaign")


def planned_inputs(o: Any) -> SimpleNamespace:
    """The entry inputs of the plan, without errors; float64[n] by symbol."""
    names = ("speed", "flight_path_angle", "heading", "latitude", "longitude", "altitude", "radius")
    given = {f"entry_{name}": np.atleast_1d(np.asarray(getattr(o, f"plan_{name}"), dtype=float)) for name in names}
    zero = np.zeros_like(given["entry_speed"])
    errors = {f"entry_{name}_error": zero for name in names if name != "radius"}
    return SimpleNamespace(**given, **errors, excess_speed=zero, vacuum_periapsis=zero)


def _one_case(o: Any) -> SimpleNamespace:
    return SimpleNamespace(arrival=np.zeros(1), speed_frame=np.atleast_1d(o.speed_frame))


def fly_reference(planner: Planner, rows: int = 4000) -> Reference:
    """The reference from the planned entry down to plan_stop_altitude, at equal steps of time."""

    def derivative(t, y):
        r, _, latitude, v, path, heading, _, _ = y
        six, along, drag = planner.motion(r, latitude, v, path, heading, planner.share)
        axial = drag * planner.axial_to_drag
        return [*six, along, axial if axial > FELT else 0.0]

    def low(t, y):
        return planner.height(y[0], y[2])[0] - planner.o.plan_stop_altitude

    low.terminal, low.direction = True, -1.0  # type: ignore[attr-defined]
    path = solve_ivp(
        derivative, (0.0, 5000.0), planner.start(), "DOP853", rtol=1e-10, atol=1e-9, events=low, dense_output=True
    )
    if path.t_events[0].size == 0:
        raise ModelError("the planned entry does not come down to plan_stop_altitude_km, so there is no reference path")
    t = np.linspace(0.0, path.t[-1], rows)
    r, _, latitude, v, angle, heading, along, lost = path.sol(t)
    six, _, drag = planner.motion(r, latitude, v, angle, heading, planner.share)
    altitude, slope = planner.height(r, latitude)
    climb = six[0] - slope * np.sin(2.0 * latitude) * six[2]
    return Reference(
        t, r, latitude, v, angle, heading, along, lost, altitude, climb, drag, drag * planner.axial_to_drag
    )


def steered_part(path: Reference) -> slice:
    """Where the laws command: from STEERED down to LAST_SPEED."""
    first = int(np.argmax(path.drag > STEERED))
    if path.drag[first] <= STEERED:
        raise ModelError("the planned entry never has 0.15 g of drag, so that no law could steer")
    last = int(np.argmax((path.speed < LAST_SPEED) & (path.t > path.t[first])))
    return slice(first, last + 1 if last else path.t.size)  # the last row is below, so that law 3 gets there


def linear_system(planner: Planner, path: Reference) -> tuple[np.ndarray, np.ndarray]:
    """(A [n, 3, 3], B [n, 3]) of x' = A x + B u by the speed lost; x: altitude [km], path angle [deg], range [km]."""

    def slopes(dh, dpath, dshare):
        six, along, _ = planner.motion(
            path.r + dh, path.latitude, path.speed, path.path + dpath, path.heading, planner.share + dshare
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
    found = solve_ivp(backward, (0.0, span), final.ravel(), "LSODA", rtol=1e-7, atol=1e-9, dense_output=True)
    p = found.sol(lost[-1] - lost).T.reshape(-1, 3, 3)
    return np.einsum("ni,nij->nj", b, p) / weights.control / _SCALES


def reference_tables(o: Any) -> np.ndarray:
    """What `reference_table` reads: designed for the settings o, or nothing where no law is asked for."""
    law = GUIDANCE[int(o.guidance)]
    if law == "none":
        return np.empty(0)
    out = np.zeros(table.LENGTH)
    planner = Planner(o)
    path = fly_reference(planner)
    out[table.RANGE] = path.along[-1]
    _write_clock(out, path)
    if law == "apollo":
        speed, columns = influence_rows()
        out[table.FIRST_SPEED] = speed[0]
        out[table.SPEED_DENSITY] = _write_rows(out, table.SPEED_TABLE, speed[0] - speed, columns)
    else:
        _write_path(out, planner, path, PROFILE_SET if law in WITHOUT_RANGE else RANGE_SET)
    return out


def _write_path(out: np.ndarray, planner: Planner, path: Reference, weights: Weights) -> None:
    """Path and gains over the speed, and over the speed lost."""
    part = steered_part(path)
    steered = Reference(**{name: value[part] for name, value in vars(path).items()})
    lost = steered.speed[0] - steered.speed
    gains = riccati_gains(lost, *linear_system(planner, steered), weights)
    columns = [steered.altitude, steered.path, steered.along, steered.drag, steered.climb, *gains.T]
    out[table.FIRST_SPEED] = steered.speed[0]
    out[table.SPEED_DENSITY] = _write_rows(out, table.SPEED_TABLE, lost, columns)
    felt = (path.lost > 0.0) & (path.t <= steered.t[-1])
    over = [path.axial, np.log(path.axial), path.speed, np.gradient(path.along, path.t), path.along]
    # before the laws command, the gains are those of their first row
    stored = [np.interp(path.t[felt], steered.t, gain) for gain in gains.T]
    columns = [*(one[felt] for one in over), *stored]
    out[table.LOST_DENSITY] = _write_rows(out, table.LOST_TABLE, path.lost[felt], columns)


def _write_clock(out: np.ndarray, path: Reference) -> None:
    """The range by the clock until the air is felt: a parabola through the entry, with range and rate of its end."""
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
