"""The injection model as the engine sees it: what each case starts from, the figures, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from campaigns.geo_injection import dynamics, outcome
from campaigns.geo_injection.aiming import nominal_impulse
from campaigns.geo_injection.design.coast import kepler
from campaigns.geo_injection.design.program import Program, Sequence, program_for, source_orbits
from campaigns.geo_injection.inputs import AXES, CHOICES, Inputs
from campaigns.geo_injection.program_table import table_of
from mc_engine.errors import ModelError
from mc_engine.model import AdaptiveStep, Refusals, declared_in, model, prepared
from mc_engine.model.figures import HistoryFigure, MapFigure, ProfileFigure, ScatterFigure
from mc_engine.physics.frames import WGS84_RADIUS
from mc_engine.studies.published import read_published

ALLOWED = dynamics.State(x=1e-3, y=1e-3, z=1e-3, vx=1e-6, vy=1e-6, vz=1e-6, mass=1e-6)  # error of a step


def sequence_of(o: Any) -> Sequence:
    """The sequence that settings by symbol (SI) ask for."""
    staged = bool(o.method == CHOICES.method.staged)
    burns, e = round(float(o.burns)), float(o.parking_eccentricity)
    final = float(o.final_inclination)
    initial = final if o.planar > 0.5 else float(o.initial_inclination)
    of_source = source_orbits(burns, abs(initial - final)) if staged else ()
    return Sequence(
        method="staged" if staged else "optimal",
        burns=burns,
        initial_inclination=initial,
        final_inclination=final,
        parking_radius=WGS84_RADIUS + float(o.parking_altitude),
        final_radius=float(o.final_radius),
        thrust=float(o.thrust),
        mass_flow=float(o.mass_flow),
        mass=float(o.initial_mass),
        between=tuple(_transfer(o, k, orbit) for k, orbit in enumerate(of_source, start=1)),
        parking_eccentricity=e,
        parking_perigee=float(o.parking_argument_of_perigee) if e > 0.0 else 0.0,  # a circle has none
    )


def _transfer(o: Any, k: int, of_source: tuple[float, float, float]) -> tuple[float, float, float]:
    """(semi-major axis, eccentricity, plane change so far) of the orbit after burn k: as set, or the source's."""
    parts = ("semi_major_axis", "eccentricity", "plane_change")
    a, e, change = (float(getattr(o, f"transfer_{k}_{part}")) for part in parts)
    if 0.0 < a < WGS84_RADIUS:
        raise ModelError(
            f"transfer_{k}_semi_major_axis_km is below the Earth's radius; an orbit lies above, and 0 is the source's"
        )
    return a or of_source[0], of_source[1] if e < 0.0 else e, of_source[2] if change < 0.0 else change


def tables(o: Any) -> np.ndarray:
    """The burn program of the settings, for the flight."""
    program = program_for(sequence_of(o))
    return table_of(program, nominal_impulse(program))


def prepare(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case, SI; cases of one sequence are prepared together."""
    codes = np.column_stack(list(vars(settings).values()))
    states, durations = np.zeros((6, len(codes))), np.zeros((3, len(codes)))
    ignitions = np.full((3, len(codes)), 1e300)  # [s]; it stays for a burn that the sequence does not have
    # usually all cases have one sequence, and sorting their rows takes longer than flying the cases
    for row in codes[:1] if (codes == codes[:1]).all() else np.unique(codes, axis=0):
        same = (codes == row).all(axis=1)
        try:
            program = program_for(sequence_of(SimpleNamespace(**dict(zip(vars(settings), row, strict=True)))))
        except ModelError as error:
            refusals.add(same, str(error))
            continue
        states[:, same] = _first_states(SimpleNamespace(**{name: x[same] for name, x in vars(i).items()}), program)
        for k, burn in enumerate(program.burns):
            ignitions[k, same], durations[k, same] = burn.ignition_s, burn.duration_s
    ignitions += [i.ignition_delay_1, i.ignition_delay_2, i.ignition_delay_3]
    # the command comes half a nominal tail-off before the stored duration is over, and the tail-off spends half
    tail, lead, burns = settings.tail_off * i.tail_off_factor, 0.5 * settings.tail_off, durations > 0.0
    short = (burns & (durations <= lead)).any(axis=0)
    refusals.add(short, "a burn is no longer than half of tail_off_s: its shutdown would be due before its ignition")
    late = (ignitions[1:] < ignitions[:-1] + durations[:-1] - lead + tail).any(axis=0)
    refusals.add(late, "an ignition comes before the burn ahead of it has ended")
    mass, flow = settings.initial_mass * i.initial_mass_factor, settings.mass_flow * i.thrust_factor / i.isp_factor
    spent = flow * (durations.sum(axis=0) + (0.5 * tail - lead) * burns.sum(axis=0))
    by_time = settings.shutdown == CHOICES.shutdown.time
    refusals.add(by_time & (spent >= mass), "the burns would take more propellant than the whole craft weighs")
    rows = vars(i) | dict(zip(("x", "y", "z", "vx", "vy", "vz"), states, strict=True))
    for k in (1, 2, 3):
        rows[f"pitch_{k}"] = np.tan(i.pitch_error + rows[f"pitch_error_{k}"])
        rows[f"yaw_{k}"] = np.tan(i.yaw_error + rows[f"yaw_error_{k}"])
        rows[f"ignition_{k}"] = ignitions[k - 1] - i.ignition_delay_1  # after the first, as the kernel's clock
    return rows | {
        "mass": mass,
        "thrust": settings.thrust * i.thrust_factor,
        "flow": flow,
        "tail": tail,
    }


def _first_states(i: SimpleNamespace, program: Program) -> np.ndarray:
    """Place [m] and velocity [m/s], float64[6, n], inertial, at the actual first ignition.

    Errors count in the axes of the nominal state; from there the stage coasts to the actual ignition: (19)-(21).
    """
    r, v = np.reshape(program.start, (2, 3))
    normal = np.cross(r, v)
    radial, normal = r / np.linalg.norm(r), normal / np.linalg.norm(normal)
    axes = dict(zip(AXES, (radial, np.cross(normal, radial), normal), strict=True))
    # term by term: the order of NumPy's matrix product follows the number of cases
    place = r + sum(getattr(i, f"initial_position_{name}")[:, None] * axis for name, axis in axes.items())
    velocity = v + sum(getattr(i, f"initial_velocity_{name}")[:, None] * axis for name, axis in axes.items())
    radius, speed, time = program.sequence.parking_radius, program.sequence.speed_unit, program.sequence.time_unit
    moved = kepler(place / radius, velocity / speed, i.ignition_delay_1 / time)
    still = np.concatenate([place, velocity], axis=1).T
    return np.where(i.ignition_delay_1 == 0.0, still, np.concatenate([moved[0] * radius, moved[1] * speed], axis=1).T)


MODEL = model(
    name="geo_injection",
    title="Injection into the geostationary circle",
    source="M. Alavipour, A. A. Nikkhah, J. Roshanian, Optimal trajectory design of an upper stage for satellite "
    "injection into geostationary orbit using limited thrust (in Persian), Journal of Space Science and Technology, "
    "after 2016",
    inputs=Inputs,
    clock=AdaptiveStep("time_limit", "tolerance", ALLOWED, attempts=20_000, first_step=10.0),
    kernel_parameters=prepared(prepare, Inputs),
    prepare=prepare,
    tables=tables,
    **declared_in(dynamics, outcome),
    figures=(
        HistoryFigure(("radius_km", "speed_m_s", "radial_speed_m_s"), "Radius and speeds"),
        HistoryFigure(("flight_path_angle_deg", "thrust_right_ascension_deg", "thrust_declination_deg"), "Angles"),
        HistoryFigure(("mass_kg", "acceleration_m_s2"), "Mass and acceleration"),
        HistoryFigure(
            ("osculating_semi_major_axis_km", "osculating_eccentricity", "osculating_inclination_deg"),
            "Osculating orbit",
        ),
        ProfileFigure("x_km", "y_km", "The flight in the plane of the equator"),
        ScatterFigure("semi_major_axis_km", "eccentricity", "Injection: semi-major axis and eccentricity"),
        ScatterFigure("semi_major_axis_km", "inclination_deg", "Injection: semi-major axis and inclination"),
        ScatterFigure("eccentricity", "inclination_deg", "Injection: eccentricity and inclination"),
        ScatterFigure("longitude_drift_deg_day", "correction_dv_m_s", "Drift and correction of the injected orbit"),
        ScatterFigure("propellant_kg", "correction_dv_m_s", "Propellant and correction"),
        MapFigure("correction_dv_m_s", "thrust_factor", "isp_factor", "Correction over the engine's errors"),
    ),
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
