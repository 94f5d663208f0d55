"""The de-orbit model as the engine sees it: design of each case, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from campaigns.deorbit import dynamics, outcome
from campaigns.deorbit.inputs import CHOICES, Inputs
from campaigns.deorbit.path_design import design_path, first_deviation, path_axes
from mc_engine.model import FixedStep, Refusals, declared_in, model, prepared
from mc_engine.model.figures import HistoryFigure, MapFigure, ScatterFigure
from mc_engine.physics.constants import STANDARD_GRAVITY
from mc_engine.studies.published import read_published


def prepare(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case: desired path, erroneous burn, first errors.

    i : inputs, float64[n] by symbol, SI;  settings : codes, float64[n], by symbol.  Refused cases join `refusals`.
    """
    refusals.add(i.modulator_on <= i.modulator_off, "modulator_on_n must be above modulator_off_n")
    path = design_path(i, settings.burn_point == CHOICES.burn_point.ascending, refusals)
    refusals.add(
        i.initial_semi_major_axis <= i.target_radius,
        "the initial orbit is not above the entry interface to come down to",
    )
    refusals.add(i.gain * settings.step > 0.3, "gain_1_s times step_s is above 0.3: the step is too long for the law")
    refusals.add(
        (settings.control == CHOICES.control.pulsed) & (i.modulator_time_constant < settings.step),
        "modulator_time_constant_s is below step_s: the step is too long for the modulator",
    )
    to_perigee, ahead = path_axes(path.omega, i.inclination)
    f_desired, deviation = first_deviation(path, i, to_perigee, ahead)
    return {
        **vars(i),
        **path._asdict(),
        **_by_axis("deviation_", deviation[0]),
        **_by_axis("deviation_v", deviation[1]),
        **_by_axis("p", to_perigee),
        **_by_axis("q", ahead),
        "f_desired": f_desired,
        "exhaust": i.isp * STANDARD_GRAVITY,
        "thrust_factor": 1.0 + i.thrust_bias,
        # above zero in the cases that navigate with any error at all; no unit, since metres and m/s are added
        "misled": sum(np.abs(error) for name, error in vars(i).items() if name.startswith("navigation_")),
    }


def _by_axis(name: str, vector: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{name}{axis}": row for axis, row in zip("xyz", vector, strict=True)}


MODEL = model(
    name="deorbit",
    title="Correction of a de-orbit burn by feedback linearization",
    source="S. Divsalar, R. Nadafi, M. Kabganian, Design of a trajectory-correction algorithm for a spacecraft in a "
    "de-orbit manoeuvre by the feedback-linearization method (in Persian), Electronics Industries Quarterly 7(1), 2016",
    inputs=Inputs,
    clock=FixedStep("step", "time_limit", "steps_per_fix"),
    kernel_parameters=prepared(prepare, Inputs),
    prepare=prepare,
    **declared_in(dynamics, outcome),
    figures=(
        MapFigure("propellant_kg", "ve_pct", "oe_pct", "Correction propellant over the errors of the burn"),
        MapFigure("correction_impulse_m_s", "ve_pct", "oe_pct", "Correction impulse over the errors of the burn"),
        MapFigure("entry_flight_path_angle_deg", "ve_pct", "oe_pct", "Entry angle over the errors of the burn"),
        HistoryFigure(("a_error_km", "e_error", "omega_error_deg"), "Errors of the elements"),
        HistoryFigure(("position_error_m", "velocity_error_m_s"), "Errors of position and velocity"),
        HistoryFigure(("force_n", "force_radial_n", "force_transverse_n"), "Correction force"),
        HistoryFigure(("impulse_m_s",), "Impulse spent"),
        ScatterFigure("entry_speed_m_s", "entry_flight_path_angle_deg", "Entry state"),
    ),
    published=read_published(Path(__file__).with_name("published.toml")),
)
