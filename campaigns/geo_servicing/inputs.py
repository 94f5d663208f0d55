"""What can be set in a servicing campaign: parameters, which may differ from case to case, and settings."""

from campaigns.geo_servicing.plan_table import BURNS
from mc_engine.model import Parameter, Setting, choices, inputs
from mc_engine.physics.geopotential import LARGEST_DEGREE

BURN_NUMBERS = range(1, BURNS + 1)


def _angle(default: float, description: str, largest: float = 360.0) -> Parameter:
    return Parameter(default, description, -largest, largest)


def _burn(k: int) -> dict[str, Parameter]:
    return {
        f"burn_{k}_thrust_error_pct": Parameter(0.0, f"true less nominal thrust in phasing burn {k}", -50, 50),
        f"burn_{k}_out_of_plane_deg": _angle(0.0, f"tilt of the thrust to the normal in burn {k}", 45.0),
        f"burn_{k}_radial_deg": _angle(0.0, f"tilt of the thrust outward in burn {k}", 45.0),
    }


def _craft(name: str, words: str, radius: float, e: float, latitude: float) -> dict[str, Parameter]:
    return {
        f"{name}_pericentre_radius_km": Parameter(radius, f"pericentre radius of the {words}", low=1e4),
        f"{name}_eccentricity": Parameter(e, f"eccentricity of the {words}", 0.0, 0.9, unit=""),
        f"{name}_argument_of_latitude_deg": _angle(latitude, f"argument of latitude, {words}"),
        f"{name}_argument_of_pericentre_deg": _angle(0.0, f"argument of pericentre, {words}"),
        f"{name}_inclination_deg": Parameter(0.05, f"inclination of the {words}", 0.0, 90.0),
        f"{name}_node_deg": _angle(60.0, f"right ascension of the ascending node of the {words}"),
    }


def _planned(default: float, description: str, low: float, high: float, error: str, unit: str = "deg") -> Setting:
    """A planned number of the start, from which a case deviates by the parameter `error`."""
    return Setting(default, f"planned {description} at the start", low=low, high=high, dispersed_by=error, unit=unit)


Inputs = inputs(
    epoch_error_days=Parameter(0.0, "delay of the true start after epoch_utc"),
    mass_error_kg=Parameter(0.0, "true less planned mass of the servicing module at the start"),
    area_factor=Parameter(1.0, "true over planned area towards the Sun", low=0.0, unit=""),
    reflectivity_factor=Parameter(1.0, "true over planned radiation pressure coefficient", low=0.0, unit=""),
    initial_longitude_error_deg=_angle(0.0, "true less planned longitude at the start", 180.0),
    initial_period_error_s=Parameter(0.0, "true less planned osculating period at the start"),
    initial_eccentricity_error=Parameter(0.0, "true less planned eccentricity at the start", -0.1, 0.1, unit=""),
    initial_inclination_error_deg=_angle(0.0, "true less planned inclination at the start", 90.0),
    initial_true_anomaly_error_deg=_angle(0.0, "true less planned anomaly at the start", 180.0),
    thrust_error_pct=Parameter(0.0, "true less nominal thrust, all burns", -50, 50),
    out_of_plane_deg=_angle(0.0, "tilt of the thrust to the normal, all burns", 45.0),
    radial_deg=_angle(0.0, "tilt of the thrust outward, all burns", 45.0),
    **{name: parameter for k in BURN_NUMBERS for name, parameter in _burn(k).items()},
    thrust_noise_pct=Parameter(0.0, "1-sigma of the thrust error of each inspection burn", low=0.0),
    pointing_noise_deg=Parameter(0.0, "1-sigma of the tilt about each of two axes of each inspection burn", low=0.0),
    nav_position_m=Parameter(10.0, "1-sigma of the position of a fix of the module along each axis", low=0.0),
    nav_velocity_m_s=Parameter(0.1, "1-sigma of the velocity of a fix of the module along each axis", low=0.0),
    target_nav_position_m=Parameter(
        0.0, "1-sigma of the position of a fix of the target; 0: fixes relative to the target", low=0.0
    ),
    target_nav_velocity_m_s=Parameter(
        0.0, "1-sigma of the velocity of a fix of the target; 0: fixes relative to it", low=0.0
    ),
    **_craft("module", "servicing module", 42150.26012, 0.000325, 54.99),
    **_craft("target", "target module", 42150.93311, 0.000315, 55.0),
    target_area_to_mass_factor=Parameter(1.0, "C_R·A/m of the target over that of the module", low=0.0, unit=""),
    standoff_m=Parameter(39.5, "nominal separation ahead or behind", low=0.0),
    around_low_m=Parameter(20.0, "fly-around: smallest desired range", low=0.0),
    around_high_m=Parameter(80.0, "fly-around: largest desired range", low=0.0),
    chi1=Parameter(0.85, "L22/L11 of the terminal matrix of the inspection law, rev²", low=0.0, unit=""),
    chi2=Parameter(0.0, "L12/L11 of the terminal matrix of the inspection law, rev", unit=""),
    control_weight=Parameter(0.0, "w/L11 of the inspection law", low=0.0, unit=""),
    coast_revolutions=Parameter(1.0, "coast that the inspection law assumes, m, in revolutions", low=0.5, unit=""),
    phase=Setting("phasing", "task", choices=("phasing", "inspection", "free")),
    epoch_utc=Setting(
        "2019-01-01T12:00:00",
        "planned start of the flight, UTC",
        low=33282,
        high=88068,
        date=True,
        dispersed_by="epoch_error_days",
    ),
    duration_days=Setting(10.0, "length of the flight", low=1e-3, high=3660.0),
    gravity_degree=Setting(
        4.0, "degree of the geopotential; 0 is a point", low=0, high=LARGEST_DEGREE, whole=True, unit=""
    ),
    gravity_order=Setting(4.0, "order of the geopotential", low=0, high=LARGEST_DEGREE, whole=True, unit=""),
    sun_and_moon=Setting(True, "attraction by Sun and Moon"),
    sunlight=Setting(True, "pressure of sunlight"),
    mass_kg=Setting(2500.0, "planned mass of the servicing module", low=1.0, dispersed_by="mass_error_kg"),
    thrust_n=Setting(1.0, "nominal thrust of the servicing module", low=1e-6, dispersed_by="thrust_error_pct"),
    isp_s=Setting(1600.0, "specific impulse of the servicing module", low=1.0),
    area_m2=Setting(50.0, "area of the servicing module towards the Sun", low=0.0, dispersed_by="area_factor"),
    reflectivity=Setting(
        1.3,
        "radiation pressure coefficient C_R of the servicing module",
        low=0.0,
        high=2.0,
        dispersed_by="reflectivity_factor",
        unit="",
    ),
    initial_longitude_deg=_planned(92.5, "east longitude", -360.0, 360.0, "initial_longitude_error_deg"),
    initial_period_s=_planned(85796.0, "osculating period", 3e4, 3e5, "initial_period_error_s", "s"),
    initial_eccentricity=_planned(0.0005, "eccentricity", 0.0, 0.5, "initial_eccentricity_error", ""),
    initial_inclination_deg=_planned(0.1, "inclination", 0.0, 90.0, "initial_inclination_error_deg"),
    initial_node_deg=Setting(0.0, "right ascension of the ascending node at the start", low=-360.0, high=360.0),
    initial_true_anomaly_deg=_planned(0.0, "anomaly", -360.0, 360.0, "initial_true_anomaly_error_deg"),
    target_longitude_deg=Setting(95.0, "required longitude, east", low=-360.0, high=360.0),
    schedule=Setting("designed", "the source's corrections, or the designed ones", choices=("published", "designed")),
    planned_corrections=Setting(
        3.0, "number of corrections of the designed schedule", low=2, high=BURNS, whole=True, unit=""
    ),
    aim=Setting("fuel", "what the designed schedule minimises", choices=("fuel", "time")),
    aim_drift_deg_rev=Setting(0.012, "actual drift that the designed schedule ends with", low=-1.0, high=1.0),
    first_coast_h=Setting(12.0, "least coast before the first correction of the phasing", low=0.0),
    least_coast_h=Setting(6.0, "least coast before every later one, and between those of the inspection", low=0.0),
    longest_transfer_days=Setting(10.0, "longest time that the designed schedule may take", low=0.1, high=1000.0),
    largest_last_deg_rev=Setting(0.0, "largest last correction; 0: by (3.31)", low=0.0, high=10.0),
    longitude_tolerance_deg=Setting(
        0.05, "tolerance of the final longitude, for the schedule and its gains", low=1e-6, high=10.0
    ),
    period_tolerance_s=Setting(
        5.0,
        "tolerance of the final period about that of aim_drift_deg_rev, for the schedule and its gains",
        low=1e-6,
        high=1e4,
    ),
    eccentricity_tolerance=Setting(
        4e-4, "tolerance of the final eccentricity, for the schedule", low=1e-7, high=0.1, unit=""
    ),
    feedback=Setting(True, "each correction is computed from the navigation state at ignition"),
    navigation=Setting("filtered", "what navigation knows", choices=("perfect", "raw", "filtered")),
    fix_period_s=Setting(3600.0, "time from one fix to the next", low=10.0, high=1e6),
    filter_noise_m_s2=Setting(1e-9, "1-sigma of the unmodelled acceleration that the filter assumes", low=0.0),
    assumed_thrust_pct=Setting(0.5, "1-sigma of the thrust error that laws and filter expect", low=0.0),
    assumed_pointing_deg=Setting(0.5, "1-sigma of the tilt that the filter expects", low=0.0),
    geometry=Setting("behind", "position of the module relative to the target", choices=("behind", "ahead", "around")),
    inspection_law=Setting(
        "single", "one correction at a time, or pairs that remove the relative ellipse", choices=("single", "pairs")
    ),
    observation_days=Setting(0.0, "time before the inspection first decides", low=0.0),
    settle_time_days=Setting(15.0, "time from which the inspection counts as settled", low=0.0),
    range_low_m=Setting(19.1, "least settled range that counts as steady", low=0.0),
    range_high_m=Setting(82.0, "largest settled range that counts as steady", low=0.0),
    tolerance=Setting(1e-11, "relative error of an integration step", low=1e-14, high=1e-6, unit=""),
)

CHOICES = choices(Inputs)
