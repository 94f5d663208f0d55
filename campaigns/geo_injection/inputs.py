"""Inputs of an injection campaign: parameters, which may differ from case to case, and settings."""

from collections.abc import Iterable
from typing import Any

from mc_engine.model import Parameter, Setting, choices, inputs

BURNS = ("1", "2", "3")
AXES = {"r": "radial", "t": "transverse", "n": "normal"}
_AIMED = "from which the last burn is aimed"


def _each(keys: Iterable[str], name: str, description: str, most: float, **unit: Any) -> dict[str, Parameter]:
    """Errors of one kind by column; {} in name and description is the key, a burn or an axis, and its word."""
    words = {key: description.format(AXES.get(key, key)) for key in keys}
    return {name.format(key): Parameter(0.0, word, -most, most, **unit) for key, word in words.items()}


def _transfer(k: int) -> dict[str, Setting]:
    after = f"staged: orbit after burn {k}"
    change = f"staged: plane change by the end of burn {k}; below 0: the source's"
    return {
        f"transfer_{k}_semi_major_axis_km": Setting(0.0, f"{after}; 0: the source's for this number of burns", low=0.0),
        f"transfer_{k}_eccentricity": Setting(-1.0, f"{after}; below 0: the source's", low=-1.0, high=0.99, unit=""),
        f"transfer_{k}_plane_change_deg": Setting(-1.0, change, low=-1.0, high=90.0),
    }


Inputs = inputs(
    thrust_factor=Parameter(1.0, "thrust over its nominal value; the mass flow follows", 0.1, 10.0, unit=""),
    isp_factor=Parameter(1.0, "specific impulse over its nominal value", 0.1, 10.0, unit=""),
    initial_mass_factor=Parameter(1.0, "mass at the first ignition over its nominal value", 0.1, 10.0, unit=""),
    **_each(BURNS, "ignition_delay_{}_s", "delay of ignition {} against its nominal time", 1e4, unit="s"),
    pitch_error_deg=Parameter(0.0, "pointing error towards Z x d, all burns", -80.0, 80.0),
    yaw_error_deg=Parameter(0.0, "pointing error towards the pole, across the thrust, all burns", -80.0, 80.0),
    **_each(BURNS, "pitch_error_{}_deg", "pitch error of burn {}, added to that of all", 80.0),
    **_each(BURNS, "yaw_error_{}_deg", "yaw error of burn {}, added to that of all", 80.0),
    **_each(AXES, "initial_position_{}_m", "{} error of the initial position", 1e6, unit="m"),
    **_each(AXES, "initial_velocity_{}_m_s", "{} error of the initial velocity", 1e3, unit="m/s"),
    tail_off_factor=Parameter(1.0, "duration of the tail-off over its nominal value", 0.0, 100.0, unit=""),
    accelerometer_scale_error=Parameter(0.0, "relative error of the sensed velocity", -0.5, 0.5, unit=""),
    **_each(AXES, "navigation_position_{}_m", "{} error of the navigated position " + _AIMED, 1e6, unit="m"),
    **_each(AXES, "navigation_velocity_{}_m_s", "{} error of the navigated velocity " + _AIMED, 1e3, unit="m/s"),
    burns=Setting(2.0, "number of burns", low=2.0, high=3.0, whole=True, unit=""),
    initial_inclination_deg=Setting(28.5, "inclination of the parking orbit", low=0.0, high=90.0),
    final_inclination_deg=Setting(
        0.0, "inclination of the final orbit, its node that of the parking orbit", low=0.0, high=90.0
    ),
    planar=Setting(False, "the parking orbit lies in the plane of the final one"),
    parking_altitude_km=Setting(
        200.0, "altitude of the parking orbit's perigee over 6378.137 km", low=100.0, high=20000.0
    ),
    parking_eccentricity=Setting(0.0, "eccentricity of the parking orbit; 0 is a circle", low=0.0, high=0.9, unit=""),
    parking_argument_of_perigee_deg=Setting(
        0.0, "argument of the parking orbit's perigee, from its ascending node", low=-360.0, high=360.0
    ),
    # radii and mass are those of the source's eq. (12)
    final_radius_km=Setting(42164.137, "radius of the final circle", low=10000.0, high=400000.0),
    # thrust and flow are not printed, they follow from tables 2 to 8
    thrust_n=Setting(20000.0, "nominal thrust", low=1.0, dispersed_by="thrust_factor"),
    mass_flow_kg_s=Setting(6.14, "nominal mass flow", low=1e-6, dispersed_by="isp_factor"),
    initial_mass_kg=Setting(22170.0, "nominal mass at the first ignition", low=1.0, dispersed_by="initial_mass_factor"),
    method=Setting("optimal", "how the burn program is designed", choices=("optimal", "staged")),
    **_transfer(1),
    **_transfer(2),
    shutdown=Setting("time", "what ends a burn", choices=("time", "sensed_velocity")),
    tail_off_s=Setting(0.0, "time in which the thrust falls linearly to zero after the command", low=0.0, high=60.0),
    guidance=Setting(
        "open_loop", "the stored program, or its last burn aimed again", choices=("open_loop", "re_aimed")
    ),
    propellant_limit_kg=Setting(16775.0, "propellant on board, for the margin; the total of table 2", low=0.0),
    tolerance=Setting(1e-10, "error of an integration step relative to the state", low=1e-14, high=1e-4, unit=""),
    time_limit_s=Setting(1e6, "a flight that lasts longer ends without a result", low=1.0),
)

CHOICES = choices(Inputs)
