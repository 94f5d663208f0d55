"""Inputs of an entry campaign: parameters, which may differ from case to case, and settings."""

from campaigns.reentry.planets import PLANETS
from campaigns.reentry.vehicles import VEHICLES
from mc_engine.model import Parameter, Setting

SHAPES = ("ellipsoid", "sphere", "flat")
GUIDANCE = ("none", "law1", "law2", "law2r", "law3", "law3r", "apollo")
PLANS = ("entry", "given")

PARAMETERS = (
    Parameter("entry_speed_m_s", "m/s", "speed at entry, in the frame speed_frame", 7800.0, low=0.0),
    Parameter("entry_flight_path_angle_deg", "deg", "flight-path angle at entry, negative down", -2.0, -90.0, 90.0),
    Parameter("entry_heading_deg", "deg", "heading at entry, from north, clockwise", 90.0, -360.0, 360.0),
    Parameter("entry_latitude_deg", "deg", "geocentric latitude of entry", 0.0, -90.0, 90.0),
    Parameter("entry_longitude_deg", "deg", "longitude of entry, east", 0.0, -360.0, 360.0),
    Parameter("entry_altitude_km", "km", "geodetic altitude of entry", 120.0, low=0.0),
    Parameter(
        "entry_radius_km", "km", "distance of entry from the planet's centre; 0 takes entry_altitude_km", 0.0, 0.0
    ),
    Parameter("excess_speed_m_s", "m/s", "hyperbolic excess speed of an arrival from far away", 3000.0, low=0.0),
    Parameter("vacuum_periapsis_km", "km", "altitude of the periapsis of that arrival, were there no air", 80.0),
    Parameter("entry_speed_error_m_s", "m/s", "error of the speed at entry", 0.0),
    Parameter("entry_flight_path_angle_error_deg", "deg", "error of the flight-path angle at entry", 0.0, -90.0, 90.0),
    Parameter("entry_heading_error_deg", "deg", "error of the heading at entry", 0.0, -360.0, 360.0),
    Parameter("entry_latitude_error_deg", "deg", "error of the latitude of entry", 0.0, -90.0, 90.0),
    Parameter("entry_longitude_error_deg", "deg", "error of the longitude of entry", 0.0, -360.0, 360.0),
    Parameter("entry_altitude_error_km", "km", "error of the altitude of entry", 0.0),
    Parameter("mass_kg", "kg", "mass", 5498.22, low=1e-6),
    Parameter("reference_area_m2", "m^2", "area that the coefficients belong to", 12.017, low=0.0),
    Parameter("drag_coefficient", "", "drag coefficient", 1.2569, low=0.0),
    Parameter("lift_coefficient", "", "lift coefficient, 0.30 of the drag coefficient", 0.37707),
    Parameter("trim_angle_deg", "deg", "trim angle of attack: turns drag and lift into axial force", 0.0, -90.0, 90.0),
    Parameter("nose_radius_m", "m", "radius of the nose, for the heating", 3.05, low=1e-6),
    Parameter("mass_factor", "", "true over planned mass", 1.0, low=1e-6),
    Parameter("cd_factor", "", "true over planned drag coefficient; the lift grows alike", 1.0, low=0.0),
    Parameter("ld_factor", "", "true over planned lift-to-drag ratio", 1.0),
    Parameter("nose_radius_factor", "", "true over planned nose radius", 1.0, low=1e-6),
    Parameter("heating_factor", "", "true over computed heat rate", 1.0, low=0.0),
    Parameter("density_factor", "", "true over standard density, at all altitudes", 1.0, low=0.0),
    Parameter("density_deviation", "", "slow density error, in sigmas of its profile over altitude", 0.0, -10.0, 10.0),
    Parameter(
        "weather_draw",
        "",
        "names the air of the day: another number, another air; 0 is the mean one",
        default=0.0,
        low=0.0,
        high=1.0,
        random_draw=True,
    ),
    Parameter("density_random_size", "", "size of the random density, in multiples of weather.py", 1.0, low=0.0),
    Parameter("wind_random_size", "", "size of the random winds, in multiples of weather.py", 1.0, low=0.0),
    Parameter("wind_mean_size", "", "size of the mean wind, in multiples of weather.py", 1.0),
    Parameter("bank_deg", "deg", "bank angle: 0 lift up, 90 to the right, 180 down", 60.0, -360.0, 360.0),
    Parameter("bank_error_deg", "deg", "error of every bank angle", 0.0, -360.0, 360.0),
    Parameter(
        "roll_flight_path_angle_deg", "deg", "climbing through this angle, roll to rolled_bank_deg", 90.0, -90, 90
    ),
    Parameter("rolled_bank_deg", "deg", "bank angle after that roll", 180.0, -360.0, 360.0),
    Parameter("roll_back_flight_path_angle_deg", "deg", "sinking through this angle, roll back", -90.0, -90.0, 90.0),
    Parameter("stop_altitude_km", "km", "geodetic altitude at which the flight ends on the way down", 10.0),
    Parameter(
        "exit_altitude_km", "km", "altitude at which a rising vehicle leaves; 0 takes that of entry", 0.0, low=0.0
    ),
    Parameter("stop_time_s", "s", "time at which the flight ends, wherever it is", 1e9, low=0.0),
    Parameter(
        "target_downrange_km",
        "km",
        "planned distance to the end; 0: of a law's reference path, without a law no target",
        0.0,
        low=0.0,
    ),
    Parameter("target_crossrange_km", "km", "planned distance to the right", 0.0),
    Parameter("corridor_load_g", "g", "limit of the load", 10.0, low=0.0),
    Parameter("corridor_heat_rate_w_m2", "W/m^2", "limit of the heat rate", 1e12, low=0.0),
    Parameter("corridor_heat_load_j_m2", "J/m^2", "limit of the heat load", 1e15, low=0.0),
    Parameter("corridor_dynamic_pressure_pa", "Pa", "limit of the dynamic pressure", 1e9, low=0.0),
    Parameter("bank_lag_s", "s", "time by which the bank follows a slow command late; 0 is at once", 0.0, low=0.0),
    Parameter("bank_rate_limit_deg_s", "deg/s", "largest rate of the bank", 20.0, low=1e-3),
    Parameter("reversal_floor_km", "km", "lateral miss at which the lift changes sides, at no speed", 1.0, low=0.0),
    Parameter(
        "reversal_width_km", "km", "what is added to it at the planned speed, falling with its square", 40.0, low=0.0
    ),
    Parameter("load_limit_g", "g", "load above which a law asks for all its lift upwards", 10.0, low=0.0),
    Parameter("nav_range_error_km", "km", "navigated less true range", 0.0),
    Parameter("nav_altitude_error_m", "m", "navigated less true altitude", 0.0),
    Parameter("nav_speed_error_m_s", "m/s", "navigated less true speed", 0.0),
    Parameter("nav_flight_path_angle_error_deg", "deg", "navigated less true flight-path angle", 0.0, -90.0, 90.0),
    Parameter("nav_climb_error_m_s", "m/s", "navigated less true altitude rate", 0.0),
    Parameter("accelerometer_bias_g", "g", "measured less true deceleration", 0.0),
    Parameter("accelerometer_scale_error", "", "error of the measured deceleration, in shares of it", 0.0),
    Parameter("accelerometer_misalignment_deg", "deg", "of the accelerometer's axis, towards the normal force", 0.0),
    Parameter("accelerometer_noise_g", "g", "1-sigma of a fresh error at every sample", 0.0, low=0.0),
    Parameter("surface_radius_km", "km", "equatorial radius; 0 takes that of the planet", 0.0, low=0.0),
)
SETTINGS = (
    Setting("planet", "", "planet", "earth", tuple(PLANETS)),
    Setting(
        "shape",
        "",
        "shape of the planet; one without an ellipsoid of its own, as Mars, is a sphere",
        "ellipsoid",
        SHAPES,
    ),
    Setting("planar", "", "no lift to the side: banking takes lift out of the vertical plane, and that is all", False),
    Setting("gravity", "", "gravity", "j2", ("j2", "point", "none")),
    Setting("rotating", "", "the planet turns", True),
    Setting("atmosphere", "", "density over altitude", "us76", ("us76", "exponential")),
    Setting("weather", "", "random density and winds over altitude, of each case", False),
    Setting("heating", "", "correlation of the heat rate", "sutton_graves", ("sutton_graves", "detra_kemp_riddell")),
    Setting("speed_frame", "", "frame of the speed at entry", "inertial", ("inertial", "relative")),
    Setting(
        "arrival", "", "whether the entry is given by its state or by a hyperbola", "state", ("state", "hyperbola")
    ),
    Setting("vehicle", "", "a vehicle of vehicles.py, or the one given here", "given", ("given", *VEHICLES)),
    Setting("on_exit", "", "what happens when the vehicle leaves the atmosphere", "stop", ("stop", "continue")),
    Setting("guidance", "", "guidance law", "none", GUIDANCE),
    Setting("guidance_period_s", "s", "time from one command of the law to the next", 1.0, low=0.01, high=100.0),
    Setting(
        "plan",
        "",
        "what distances and reference path count from: each case's own entry without errors, or plan_...",
        "entry",
        PLANS,
    ),
    Setting("plan_speed_m_s", "m/s", "planned speed at entry, in the frame speed_frame", 7800.0, low=1.0),
    Setting("plan_flight_path_angle_deg", "deg", "planned flight-path angle at entry", -2.0, low=-90.0, high=90.0),
    Setting("plan_heading_deg", "deg", "planned heading at entry, from north, clockwise", 90.0, low=-360.0, high=360.0),
    Setting("plan_latitude_deg", "deg", "planned geocentric latitude of entry", 0.0, low=-90.0, high=90.0),
    Setting("plan_longitude_deg", "deg", "planned longitude of entry", 0.0, low=-360.0, high=360.0),
    Setting("plan_altitude_km", "km", "planned geodetic altitude of entry", 120.0, low=1.0),
    Setting(
        "plan_radius_km",
        "km",
        "planned distance of entry from the planet's centre; 0 takes plan_altitude_km",
        0.0,
        low=0.0,
    ),
    Setting(
        "plan_ballistic_coefficient_kg_m2",
        "kg/m^2",
        "of the planned vehicle; one of vehicles.py brings its own",
        5498.22 / (12.017 * 1.2569),
        low=1e-3,
    ),
    Setting("plan_lift_to_drag", "", "of the planned vehicle; one of vehicles.py brings its own", 0.30, low=1e-3),
    Setting(
        "plan_trim_angle_deg",
        "deg",
        "of the planned vehicle; one of vehicles.py brings its own",
        0.0,
        low=-90.0,
        high=90.0,
    ),
    Setting("plan_bank_deg", "deg", "bank of the reference path", 60.0, low=0.0, high=165.0),
    Setting("plan_stop_altitude_km", "km", "altitude at which the reference path ends", 10.0, low=0.0),
    Setting("tolerance", "", "relative error of an integration step", 1e-8, low=1e-14, high=1e-3),
    Setting("time_limit_s", "s", "longest flight; a case that has not ended by then is no-stop", 20_000.0, low=1.0),
)
