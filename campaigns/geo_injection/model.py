"""The injection model as the engine sees it: inputs, settings, what each case starts from, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from campaigns.geo_injection import dynamics, figures, outcome
from campaigns.geo_injection.aiming import nominal_aim
from campaigns.geo_injection.design.coast import kepler
from campaigns.geo_injection.design.program import Program
from campaigns.geo_injection.design.programs import program_for
from campaigns.geo_injection.design.sequence import Sequence, source_orbits
from campaigns.geo_injection.inputs import METHODS, PARAMETERS, SETTINGS
from campaigns.geo_injection.program_table import table_of
from mc_engine.errors import ModelError
from mc_engine.model import AdaptiveStep, Event, Field, Model, Refusals
from mc_engine.physics.frames import WGS84_RADIUS
from mc_engine.studies.published import read_published

SOURCE = (
    "M. Alavipour, A. A. Nikkhah, J. Roshanian, Optimal trajectory design of an upper stage for satellite injection "
    "into geostationary orbit using limited thrust (in Persian), Journal of Space Science and Technology, after 2016"
)
STATES = (
    *(Field(f"{axis}_m", "m", f"inertial place, {axis}") for axis in "xyz"),
    *(Field(f"v{axis}_m_s", "m/s", f"inertial velocity, {axis}") for axis in "xyz"),
    Field("mass_kg", "kg", "mass"),
)


def sequence_of(o: Any) -> Sequence:
    """The sequence that settings by symbol (SI) ask for."""
    burns = round(float(o.burns))
    final = float(o.final_inclination)
    initial = final if o.planar > 0.5 else float(o.initial_inclination)
    method = METHODS[int(o.method)]
    between: tuple[tuple[float, float, float], ...] = ()
    if method == "staged":
        of_source = source_orbits(burns, abs(initial - final))
        between = tuple(_transfer(o, k, row) for k, row in enumerate(of_source, start=1))
    radius = WGS84_RADIUS + float(o.parking_altitude)
    e = float(o.parking_eccentricity)
    perigee = float(o.parking_argument_of_perigee) if e > 0.0 else 0.0  # a circle has none
    return Sequence(
        method=method,
        burns=burns,
        initial_inclination=initial,
        final_inclination=final,
        parking_radius=radius,
        final_radius=float(o.final_radius),
        thrust=float(o.thrust),
        mass_flow=float(o.mass_flow),
        mass=float(o.initial_mass),
        between=between,
        parking_eccentricity=e,
        parking_perigee=perigee,
    )


def _transfer(o: Any, k: int, of_source: tuple[float, float, float]) -> tuple[float, float, float]:
    """(semi-major axis, eccentricity, plane change so far) of the orbit after burn k: as set, or the source's."""
    a, e = float(getattr(o, f"transfer_{k}_semi_major_axis")), float(getattr(o, f"transfer_{k}_eccentricity"))
    change = float(getattr(o, f"transfer_{k}_plane_change"))
    if 0.0 < a < WGS84_RADIUS:
        raise ModelError(
            f"transfer_{k}_semi_major_axis_km is below the Earth's radius; an orbit lies above, and 0 is the source's"
        )
    return a or of_source[0], of_source[1] if e < 0.0 else e, of_source[2] if change < 0.0 else change


def tables(o: Any) -> np.ndarray:
    """The burn program of the settings, for the flight."""
    program = program_for(sequence_of(o))
    return table_of(program, nominal_aim(program))


def prepare(inputs: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case.

    inputs : float64[n] by symbol, SI;  settings : codes, float64[n], by symbol.  Refused cases join `refusals`.
    """
    rows: dict[str, np.ndarray] = {}
    codes = np.stack([getattr(settings, setting.symbol) for setting in SETTINGS], axis=1)
    for row in np.unique(codes, axis=0):
        same = (codes == row).all(axis=1)
        chosen = SimpleNamespace(**{setting.symbol: row[k] for k, setting in enumerate(SETTINGS)})
        try:
            program = program_for(sequence_of(chosen))
        except ModelError as error:
            refusals.add(same, str(error))
            continue
        part = SimpleNamespace(**{name: column[same] for name, column in vars(inputs).items()})
        columns, late = _rows(part, chosen, program)
        for name, column in columns.items():
            rows.setdefault(name, np.zeros(same.size))[same] = column
        mask = np.zeros(same.size, dtype=bool)
        mask[same] = late
        refusals.add(mask, "an ignition comes before the burn ahead of it has ended")
    return rows or {name: np.zeros(codes.shape[0]) for name in dynamics.Parameters._fields}


def _rows(i: SimpleNamespace, o: SimpleNamespace, program: Program) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """(kernel parameters, where ignitions overlap burns) of the cases of one sequence."""
    sequence = program.sequence
    place, velocity = _first_states(i, program)
    rows = {name: place[:, k] for k, name in enumerate("xyz")}
    rows |= {name: velocity[:, k] for k, name in enumerate(("vx", "vy", "vz"))}
    rows |= {
        "mass": sequence.mass * i.initial_mass_factor,
        "thrust": sequence.thrust * i.thrust_factor,
        "flow": sequence.mass_flow * i.thrust_factor / i.isp_factor,
        "tail": o.tail_off * i.tail_off_factor,
        "accelerometer": i.accelerometer_scale_error,
    }
    for axis in "rtn":
        rows[f"known_{axis}"] = getattr(i, f"navigation_position_{axis}")
        rows[f"known_v{axis}"] = getattr(i, f"navigation_velocity_{axis}")
    late = np.zeros(i.thrust_factor.size, dtype=bool)
    for k in (1, 2, 3):
        delay = getattr(i, f"ignition_delay_{k}")
        rows[f"delay_{k}"] = delay
        rows[f"pitch_{k}"] = np.tan(i.pitch_error + getattr(i, f"pitch_error_{k}"))
        rows[f"yaw_{k}"] = np.tan(i.yaw_error + getattr(i, f"yaw_error_{k}"))
        if k > 1:
            row = program.burns[min(k, len(program.burns)) - 1]
            rows[f"ignition_{k}"] = row.ignition + delay - i.ignition_delay_1
        if 1 < k <= len(program.burns):
            before = program.burns[k - 2]
            end = before.ignition + getattr(i, f"ignition_delay_{k - 1}") + before.duration
            late |= row.ignition + delay < end + rows["tail"]
    return rows, late


def _first_states(i: SimpleNamespace, program: Program) -> tuple[np.ndarray, np.ndarray]:
    """Places [m] and velocities [m/s], [n, 3], inertial, at the actual first ignition.

    Errors count in the radial, transverse and normal axes of the nominal state at its time; from there the stage
    coasts (19)-(21), forward or backward, to the actual ignition.
    """
    r, v = program.start[:3], program.start[3:]
    normal = np.cross(r, v)
    radial, normal = r / np.linalg.norm(r), normal / np.linalg.norm(normal)
    axes = np.stack([radial, np.cross(normal, radial), normal])
    place = r + np.stack([getattr(i, f"initial_position_{axis}") for axis in "rtn"], axis=1) @ axes
    velocity = v + np.stack([getattr(i, f"initial_velocity_{axis}") for axis in "rtn"], axis=1) @ axes
    sequence = program.sequence
    scales = sequence.parking_radius, sequence.speed_unit
    moved = kepler(place / scales[0], velocity / scales[1], i.ignition_delay_1 / sequence.time_unit)
    still = (i.ignition_delay_1 == 0.0)[:, None]
    return np.where(still, place, moved[0] * scales[0]), np.where(still, velocity, moved[1] * scales[1])


MODEL = Model(
    name="geo_injection",
    title="Injection into the geostationary circle",
    source=SOURCE,
    parameters=PARAMETERS,
    settings=SETTINGS,
    states=STATES,
    quantities=outcome.QUANTITIES,
    metrics=outcome.METRICS,
    clock=AdaptiveStep(
        "time_limit", "tolerance", (1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6, 1e-6), attempts=20_000, first_step=10.0
    ),
    kernel_parameters=dynamics.Parameters,
    prepare=prepare,
    initial=dynamics.initial,
    start=dynamics.start,
    tables=tables,
    rhs=dynamics.rhs,
    events=dynamics.events,
    switch=dynamics.switch,
    event_list=(
        Event("ignite", "rising", "switch"),
        Event("next_segment", "rising", "switch"),
        Event("shut_down", "rising", "switch"),
        Event("burn_out", "rising", "switch", rare=True),
        Event("injected", "rising", "stop"),
    ),
    observe=outcome.observe,
    evaluate=outcome.evaluate,
    figures=figures.FIGURES,
    data=(
        "programs/three_burns_28_5.toml",
        "programs/three_burns_28_5_staged.toml",
        "programs/three_burns_planar.toml",
        "programs/two_burns_28_5.toml",
        "programs/two_burns_28_5_staged.toml",
        "programs/two_burns_55.toml",
        "programs/two_burns_planar.toml",
    ),
    published=read_published(Path(__file__).with_name("published.toml")),
)
