"""Inputs of an injection campaign: parameters, which may differ from case to case, and settings."""

from mc_engine.model import Parameter, Setting

METHODS = ("optimal", "staged")
SHUTDOWNS = ("time", "sensed_velocity")
GUIDANCE = ("open_loop", "re_aimed")
AXES = (("r", "radial"), ("t", "transverse"), ("n", "normal"))

PARAMETERS = (
    Parameter("thrust_factor", "", "thrust over its nominal value; the mass flow follows", 1.0, low=0.1, high=10.0),
    Parameter("isp_factor", "", "specific impulse over its nominal value", 1.0, low=0.1, high=10.0),
    Parameter("initial_mass_factor", "", "mass at the first ignition over its nominal value", 1.0, low=0.1, high=10.0),
    *(
        Parameter(f"ignition_delay_{k}_s", "s", f"delay of ignition {k} against its nominal time", 0.0, -1e4, 1e4)
        for k in (1, 2, 3)
    ),
    Parameter("pitch_error_deg", "deg", "pointing error towards Z x d, all burns", 0.0, -80.0, 80.0),
    Parameter(
        "yaw_error_deg", "deg", "pointing error towards the pole, across the thrust, all burns", 0.0, -80.0, 80.0
    ),
    *(
        Parameter(f"{name}_error_{k}_deg", "deg", f"{name} error of burn {k}, added to that of all", 0.0, -80.0, 80.0)
        for name in ("pitch", "yaw")
        for k in (1, 2, 3)
    ),
    *(
        Parameter(f"initial_position_{axis}_m", "m", f"{word} error of the first place", 0.0, -1e6, 1e6)
        for axis, word in AXES
    ),
    *(
        Parameter(f"initial_velocity_{axis}_m_s", "m/s", f"{word} error of the first velocity", 0.0, -1e3, 1e3)
        for axis, word in AXES
    ),
    Parameter("tail_off_factor", "", "duration of the tail-off over its nominal value", 1.0, low=0.0, high=100.0),
    Parameter("accelerometer_scale_error", "", "relative error of the sensed velocity", 0.0, -0.5, 0.5),
    *(
        Parameter(
            f"navigation_position_{axis}_m",
            "m",
            f"{word} error of the place that the last burn is aimed from",
            0.0,
            -1e6,
            1e6,
        )
        for axis, word in AXES
    ),
    *(
        Parameter(
            f"navigation_velocity_{axis}_m_s",
            "m/s",
            f"{word} error of the velocity that the last burn is aimed from",
            0.0,
            -1e3,
            1e3,
        )
        for axis, word in AXES
    ),
)

SETTINGS = (
    Setting("burns", "", "number of burns", 2.0, low=2.0, high=3.0, whole=True),
    Setting("initial_inclination_deg", "deg", "inclination of the parking orbit", 28.5, low=0.0, high=90.0),
    Setting(
        "final_inclination_deg",
        "deg",
        "inclination of the final orbit, its node that of the parking orbit",
        0.0,
        low=0.0,
        high=90.0,
    ),
    Setting("planar", "", "the parking orbit lies in the plane of the final one", False),
    Setting(
        "parking_altitude_km",
        "km",
        "altitude of the parking orbit's perigee over 6378.137 km",
        200.0,
        low=100.0,
        high=20000.0,
    ),
    Setting("parking_eccentricity", "", "eccentricity of the parking orbit; 0 is a circle", 0.0, low=0.0, high=0.9),
    Setting(
        "parking_argument_of_perigee_deg",
        "deg",
        "argument of the parking orbit's perigee, from its ascending node",
        0.0,
        low=-360.0,
        high=360.0,
    ),
    Setting("final_radius_km", "km", "radius of the final circle", 42164.137, low=10000.0, high=400000.0),
    Setting("thrust_n", "N", "nominal thrust", 20000.0, low=1.0, dispersed_by="thrust_factor"),
    Setting("mass_flow_kg_s", "kg/s", "nominal mass flow", 6.14, low=1e-6, dispersed_by="isp_factor"),
    Setting(
        "initial_mass_kg",
        "kg",
        "nominal mass at the first ignition",
        22170.0,
        low=1.0,
        dispersed_by="initial_mass_factor",
    ),
    Setting("method", "", "how the burn program is designed", "optimal", choices=METHODS),
    *(
        setting
        for k in (1, 2)
        for setting in (
            Setting(
                f"transfer_{k}_semi_major_axis_km",
                "km",
                f"staged: orbit after burn {k}; 0: the source's for this number of burns",
                0.0,
                low=0.0,
            ),
            Setting(
                f"transfer_{k}_eccentricity",
                "",
                f"staged: orbit after burn {k}; below 0: the source's",
                -1.0,
                low=-1.0,
                high=0.99,
            ),
            Setting(
                f"transfer_{k}_plane_change_deg",
                "deg",
                f"staged: plane change by the end of burn {k}; below 0: the source's",
                -1.0,
                low=-1.0,
                high=90.0,
            ),
        )
    ),
    Setting("shutdown", "", "what ends a burn", "time", choices=SHUTDOWNS),
    Setting(
        "tail_off_s",
        "s",
        "time in which the thrust falls to zero after the command, along a line",
        0.0,
        low=0.0,
        high=60.0,
    ),
    Setting("guidance", "", "the stored program, or its last burn aimed again", "open_loop", choices=GUIDANCE),
    Setting("propellant_limit_kg", "kg", "propellant on board, for the margin; the total of table 2", 16775.0, low=0.0),
    Setting("tolerance", "", "error of an integration step over the state's size", 1e-10, low=1e-14, high=1e-4),
    Setting("time_limit_s", "s", "a flight that lasts longer ends without a result", 1e6, low=1.0),
)
