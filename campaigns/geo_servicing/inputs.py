"""What can be set in a servicing campaign: parameters, which may differ from case to case, and settings."""

from campaigns.geo_servicing.plan_table import BURNS
from mc_engine.model import Parameter, Setting
from mc_engine.physics.geopotential import LARGEST_DEGREE

PHASES = ("phasing", "inspection", "free")
SCHEDULES = ("published", "designed")
AIMS = ("fuel", "time")
NAVIGATION = ("perfect", "raw", "filtered")
INSPECTION_LAWS = ("single", "pairs")
GEOMETRIES = ("behind", "ahead", "around")


def _burn(k: int) -> tuple[Parameter, ...]:
    return (
        Parameter(f"burn_{k}_thrust_error_pct", "%", f"true less nominal thrust in phasing burn {k}", 0.0, -50, 50),
        Parameter(f"burn_{k}_out_of_plane_deg", "deg", f"tilt of the thrust to the normal in burn {k}", 0.0, -45, 45),
        Parameter(f"burn_{k}_radial_deg", "deg", f"tilt of the thrust outward in burn {k}", 0.0, -45, 45),
    )


def _craft(name: str, words: str, radius: float, e: float, latitude: float) -> tuple[Parameter, ...]:
    return (
        Parameter(f"{name}_pericentre_radius_km", "km", f"pericentre radius of the {words}", radius, low=1e4),
        Parameter(f"{name}_eccentricity", "", f"eccentricity of the {words}", e, 0.0, 0.9),
        Parameter(f"{name}_argument_of_latitude_deg", "deg", f"argument of latitude, {words}", latitude, -360, 360),
        Parameter(f"{name}_argument_of_pericentre_deg", "deg", f"argument of pericentre, {words}", 0.0, -360, 360),
        Parameter(f"{name}_inclination_deg", "deg", f"inclination of the {words}", 0.05, 0.0, 90.0),
        Parameter(f"{name}_node_deg", "deg", f"right ascension of the ascending node of the {words}", 60.0, -360, 360),
    )


PARAMETERS = (
    Parameter("epoch_error_days", "day", "true start later than epoch_utc by", 0.0),
    Parameter("mass_error_kg", "kg", "true less planned mass of the servicing module at the start", 0.0),
    Parameter("area_factor", "", "true over planned area towards the Sun", 1.0, low=0.0),
    Parameter("reflectivity_factor", "", "true over planned radiation pressure coefficient", 1.0, low=0.0),
    Parameter("initial_longitude_error_deg", "deg", "true less planned longitude at the start", 0.0, -180, 180),
    Parameter("initial_period_error_s", "s", "true less planned osculating period at the start", 0.0),
    Parameter("initial_eccentricity_error", "", "true less planned eccentricity at the start", 0.0, -0.1, 0.1),
    Parameter("initial_inclination_error_deg", "deg", "true less planned inclination at the start", 0.0, -90, 90),
    Parameter("initial_true_anomaly_error_deg", "deg", "true less planned anomaly at the start", 0.0, -180, 180),
    Parameter("thrust_error_pct", "%", "true less nominal thrust, all burns", 0.0, -50, 50),
    Parameter("out_of_plane_deg", "deg", "tilt of the thrust to the normal, all burns", 0.0, -45, 45),
    Parameter("radial_deg", "deg", "tilt of the thrust outward, all burns", 0.0, -45, 45),
    *(parameter for k in range(1, BURNS + 1) for parameter in _burn(k)),
    Parameter("thrust_noise_pct", "%", "1-sigma of a fresh thrust error at every inspection burn", 0.0, low=0.0),
    Parameter("pointing_noise_deg", "deg", "1-sigma of a fresh tilt each way at every inspection burn", 0.0, 0.0),
    Parameter("nav_position_m", "m", "1-sigma of a fix of the module along each axis", 10.0, low=0.0),
    Parameter("nav_velocity_m_s", "m/s", "1-sigma of a fix of the module along each axis", 0.1, low=0.0),
    Parameter("target_nav_position_m", "m", "the same of the target; 0: fixes are relative to it", 0.0, low=0.0),
    Parameter("target_nav_velocity_m_s", "m/s", "the same of the target; 0: fixes are relative to it", 0.0, low=0.0),
    *_craft("module", "servicing module", 42150.26012, 0.000325, 54.99),
    *_craft("target", "target module", 42150.93311, 0.000315, 55.0),
    Parameter("target_area_to_mass_factor", "", "C_R A/m of the target over that of the module", 1.0, low=0.0),
    Parameter("standoff_m", "m", "nominal separation ahead or behind", 39.5, low=0.0),
    Parameter("around_low_m", "m", "fly-around: least range wanted", 20.0, low=0.0),
    Parameter("around_high_m", "m", "fly-around: largest range wanted", 80.0, low=0.0),
    Parameter("chi1", "", "L22/L11 of the terminal matrix of the inspection law, rev^2", 0.85, low=0.0),
    Parameter("chi2", "", "L12/L11 of it, rev", 0.0),
    Parameter("control_weight", "", "w/L11 of the inspection law", 0.0, low=0.0),
    Parameter("coast_revolutions", "", "coast that the inspection law works with, m", 1.0, low=0.5),
)
SETTINGS = (
    Setting("phase", "", "task", "phasing", PHASES),
    Setting(
        "epoch_utc",
        "",
        "planned start of the flight, UTC",
        "2019-01-01T12:00:00",
        (),
        33282,
        88068,
        date=True,
        dispersed_by="epoch_error_days",
    ),
    Setting("duration_days", "day", "length of the flight", 10.0, (), 1e-3, 3660.0),
    Setting("gravity_degree", "", "degree of the geopotential; 0 is a point", 4.0, (), 0, LARGEST_DEGREE, True),
    Setting("gravity_order", "", "order of the geopotential", 4.0, (), 0, LARGEST_DEGREE, True),
    Setting("sun_and_moon", "", "attraction by Sun and Moon", True),
    Setting("sunlight", "", "pressure of sunlight", True),
    Setting("mass_kg", "kg", "planned mass of the servicing module", 2500.0, (), 1.0, dispersed_by="mass_error_kg"),
    Setting("thrust_n", "N", "its nominal thrust", 1.0, (), 1e-6, dispersed_by="thrust_error_pct"),
    Setting("isp_s", "s", "its specific impulse", 1600.0, (), 1.0),
    Setting("area_m2", "m^2", "its area towards the Sun", 50.0, (), 0.0, dispersed_by="area_factor"),
    Setting(
        "reflectivity",
        "",
        "its radiation pressure coefficient C_R",
        1.3,
        (),
        0.0,
        2.0,
        dispersed_by="reflectivity_factor",
    ),
    Setting(
        "initial_longitude_deg",
        "deg",
        "planned longitude at the start, east",
        92.5,
        (),
        -360.0,
        360.0,
        dispersed_by="initial_longitude_error_deg",
    ),
    Setting(
        "initial_period_s",
        "s",
        "planned osculating period at the start",
        85796.0,
        (),
        3e4,
        3e5,
        dispersed_by="initial_period_error_s",
    ),
    Setting(
        "initial_eccentricity",
        "",
        "planned eccentricity at the start",
        0.0005,
        (),
        0.0,
        0.5,
        dispersed_by="initial_eccentricity_error",
    ),
    Setting(
        "initial_inclination_deg",
        "deg",
        "planned inclination at the start",
        0.1,
        (),
        0.0,
        90.0,
        dispersed_by="initial_inclination_error_deg",
    ),
    Setting("initial_node_deg", "deg", "right ascension of the ascending node at the start", 0.0, (), -360.0, 360.0),
    Setting(
        "initial_true_anomaly_deg",
        "deg",
        "planned anomaly at the start",
        0.0,
        (),
        -360.0,
        360.0,
        dispersed_by="initial_true_anomaly_error_deg",
    ),
    Setting("target_longitude_deg", "deg", "required longitude, east", 95.0, (), -360.0, 360.0),
    Setting("schedule", "", "the source's corrections, or the designed ones", "designed", SCHEDULES),
    Setting("planned_corrections", "", "number of corrections of the designed schedule", 3.0, (), 2, BURNS, True),
    Setting("aim", "", "what the designed schedule spares", "fuel", AIMS),
    Setting("aim_drift_deg_rev", "deg/rev", "actual drift that the designed schedule ends with", 0.012, (), -1.0, 1.0),
    Setting("first_coast_h", "h", "least coast before the first correction of the phasing", 12.0, (), 0.0),
    Setting(
        "least_coast_h", "h", "least coast before every later one, and between those of the inspection", 6.0, (), 0.0
    ),
    Setting("longest_transfer_days", "day", "longest time that the designed schedule may take", 10.0, (), 0.1, 1000.0),
    Setting("largest_last_deg_rev", "deg/rev", "largest last correction; 0: by (3.31)", 0.0, (), 0.0, 10.0),
    Setting("longitude_tolerance_deg", "deg", "of the end, for the schedule and its gains", 0.05, (), 1e-6, 10.0),
    Setting("period_tolerance_s", "s", "of the end, for the schedule and its gains", 5.0, (), 1e-6, 1e4),
    Setting("eccentricity_tolerance", "", "of the end, for the schedule", 4e-4, (), 1e-7, 0.1),
    Setting("feedback", "", "corrections answer what navigation tells at ignition", True),
    Setting("navigation", "", "what navigation knows", "filtered", NAVIGATION),
    Setting("fix_period_s", "s", "time from one fix to the next", 3600.0, (), 10.0, 1e6),
    Setting("filter_noise_m_s2", "m/s^2", "1-sigma of the acceleration that the filter does not know", 1e-9, (), 0.0),
    Setting("assumed_thrust_pct", "%", "1-sigma of the thrust error that laws and filter expect", 0.5, (), 0.0),
    Setting("assumed_pointing_deg", "deg", "1-sigma of the tilt that the filter expects", 0.5, (), 0.0),
    Setting("geometry", "", "place of the module beside the target", "behind", GEOMETRIES),
    Setting(
        "inspection_law",
        "",
        "one correction at a time, or pairs that take the relative ellipse away",
        "single",
        INSPECTION_LAWS,
    ),
    Setting("observation_days", "day", "time before the inspection first decides", 0.0, (), 0.0),
    Setting("settle_time_days", "day", "when the inspection counts as settled", 15.0, (), 0.0),
    Setting("range_low_m", "m", "least settled range that counts as steady", 19.1, (), 0.0),
    Setting("range_high_m", "m", "largest settled range that counts as steady", 82.0, (), 0.0),
    Setting("tolerance", "", "relative error of an integration step", 1e-11, (), 1e-14, 1e-6),
)
