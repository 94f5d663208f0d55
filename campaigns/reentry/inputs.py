"""Inputs of an entry campaign: parameters, which may differ from case to case, and settings."""

from campaigns.reentry.planets import PLANETS
from campaigns.reentry.vehicles import VEHICLES
from mc_engine.model import Parameter, Setting, choices, inputs

GUIDANCE = ("none", "law1", "law2", "law2r", "law3", "law3r", "apollo")

Inputs = inputs(
    entry_speed_m_s=Parameter(7800.0, "speed at entry, in the frame speed_frame", low=0.0),
    entry_flight_path_angle_deg=Parameter(-2.0, "flight-path angle at entry, negative down", low=-90.0, high=90.0),
    entry_heading_deg=Parameter(90.0, "heading at entry, from north, clockwise", low=-360.0, high=360.0),
    entry_latitude_deg=Parameter(0.0, "geocentric latitude of entry", low=-90.0, high=90.0),
    entry_longitude_deg=Parameter(0.0, "longitude of entry, east", low=-360.0, high=360.0),
    entry_altitude_km=Parameter(120.0, "geodetic altitude of entry", low=0.0),
    entry_radius_km=Parameter(0.0, "distance of entry from the planet's centre; 0 takes entry_altitude_km", low=0.0),
    excess_speed_m_s=Parameter(3000.0, "hyperbolic excess speed of an arrival on a hyperbola", low=0.0),
    vacuum_periapsis_km=Parameter(80.0, "altitude of the vacuum periapsis of an arrival on a hyperbola"),
    entry_speed_error_m_s=Parameter(0.0, "error of the speed at entry"),
    entry_flight_path_angle_error_deg=Parameter(0.0, "error of the flight-path angle at entry", low=-90.0, high=90.0),
    entry_heading_error_deg=Parameter(0.0, "error of the heading at entry", low=-360.0, high=360.0),
    entry_latitude_error_deg=Parameter(0.0, "error of the latitude of entry", low=-90.0, high=90.0),
    entry_longitude_error_deg=Parameter(0.0, "error of the longitude of entry", low=-360.0, high=360.0),
    entry_altitude_error_km=Parameter(0.0, "error of the altitude of entry"),
    mass_kg=Parameter(5498.22, "mass", low=1e-6),
    reference_area_m2=Parameter(12.017, "reference area of the aerodynamic coefficients", low=0.0),
    drag_coefficient=Parameter(1.2569, "drag coefficient", low=0.0, unit=""),
    lift_coefficient=Parameter(0.37707, "lift coefficient, 0.30 of the drag coefficient", unit=""),
    trim_angle_deg=Parameter(0.0, "trim angle of attack: turns drag and lift into axial force", low=-90.0, high=90.0),
    nose_radius_m=Parameter(3.05, "radius of the nose, for the heating", low=1e-6),
    mass_factor=Parameter(1.0, "true over planned mass", low=1e-6, unit=""),
    cd_factor=Parameter(1.0, "true over planned drag coefficient; it scales the lift, too", low=0.0, unit=""),
    ld_factor=Parameter(1.0, "true over planned lift-to-drag ratio", unit=""),
    nose_radius_factor=Parameter(1.0, "true over planned nose radius", low=1e-6, unit=""),
    heating_factor=Parameter(1.0, "true over computed heat rate", low=0.0, unit=""),
    density_factor=Parameter(1.0, "true over standard density, at all altitudes", low=0.0, unit=""),
    density_deviation=Parameter(
        0.0, "density error at all altitudes, in sigmas of each altitude", low=-10.0, high=10.0, unit=""
    ),
    weather_draw=Parameter(
        0.0,
        "selects the random density and winds of the case; 0 selects the mean atmosphere",
        low=0.0,
        high=1.0,
        random_draw=True,
        unit="",
    ),
    density_random_size=Parameter(
        1.0, "size of the random density, over that of the standard model (weather.py)", low=0.0, unit=""
    ),
    wind_random_size=Parameter(
        1.0, "size of the random winds, over that of the standard model (weather.py)", low=0.0, unit=""
    ),
    wind_mean_size=Parameter(1.0, "size of the mean wind, over that of the standard model (weather.py)", unit=""),
    bank_deg=Parameter(60.0, "bank angle: 0 lift up, 90 to the right, 180 down", low=-360.0, high=360.0),
    bank_error_deg=Parameter(0.0, "error of every bank angle", low=-360.0, high=360.0),
    roll_flight_path_angle_deg=Parameter(
        90.0, "flight-path angle at which a climbing vehicle rolls to rolled_bank_deg", low=-90.0, high=90.0
    ),
    rolled_bank_deg=Parameter(180.0, "bank angle after the roll of a climbing vehicle", low=-360.0, high=360.0),
    roll_back_flight_path_angle_deg=Parameter(
        -90.0, "flight-path angle at which a descending vehicle rolls back", low=-90.0, high=90.0
    ),
    stop_altitude_km=Parameter(10.0, "geodetic altitude at which the flight ends on the way down"),
    exit_altitude_km=Parameter(
        0.0,
        "altitude at which a climbing vehicle leaves the air; one that did not sink below it does so at its entry "
        "altitude; 0 takes the planned entry altitude",
        low=0.0,
    ),
    stop_time_s=Parameter(1e9, "time at which the flight ends at the latest", low=1e-6),
    target_downrange_km=Parameter(
        0.0,
        "planned distance to the target along the track; 0: to the end of the reference path, or no target",
        low=0.0,
    ),
    target_crossrange_km=Parameter(0.0, "planned distance of the target to the right of the track"),
    corridor_load_g=Parameter(10.0, "limit of the load", low=0.0),
    corridor_heat_rate_w_m2=Parameter(1e12, "limit of the heat rate", low=0.0),
    corridor_heat_load_j_m2=Parameter(1e15, "limit of the heat load", low=0.0),
    corridor_dynamic_pressure_pa=Parameter(1e9, "limit of the dynamic pressure", low=0.0),
    bank_lag_s=Parameter(0.0, "time lag of the bank behind its command; 0: no lag", low=0.0),
    bank_rate_limit_deg_s=Parameter(20.0, "largest bank rate", low=1e-3),
    reversal_floor_km=Parameter(1.0, "lateral miss at which the bank is reversed, at zero speed", low=0.0),
    reversal_width_km=Parameter(
        40.0, "what is added to reversal_floor_km at entry; it falls with the square of the speed", low=0.0
    ),
    load_limit_g=Parameter(10.0, "load above which a guidance law commands full lift up", low=0.0),
    nav_range_error_km=Parameter(0.0, "navigated less true range"),
    nav_altitude_error_m=Parameter(0.0, "navigated less true altitude"),
    nav_speed_error_m_s=Parameter(0.0, "navigated less true speed"),
    nav_flight_path_angle_error_deg=Parameter(0.0, "navigated less true flight-path angle", low=-90.0, high=90.0),
    nav_climb_error_m_s=Parameter(0.0, "navigated less true altitude rate"),
    accelerometer_bias_g=Parameter(0.0, "measured less true deceleration"),
    accelerometer_scale_error=Parameter(0.0, "error of the measured deceleration, relative to it", unit=""),
    accelerometer_misalignment_deg=Parameter(0.0, "misalignment of the accelerometer's axis towards the normal force"),
    accelerometer_noise_g=Parameter(0.0, "1-sigma of the accelerometer's noise at every sample", low=0.0),
    surface_radius_km=Parameter(0.0, "equatorial radius; 0 takes that of the planet", low=0.0),
    planet=Setting("earth", "planet", choices=tuple(PLANETS)),
    shape=Setting(
        "ellipsoid",
        "shape of the planet; a planet without an ellipsoid of its own, such as Mars, is a sphere",
        choices=("ellipsoid", "sphere", "flat"),
    ),
    planar=Setting(False, "planar flight: banking reduces the vertical lift and gives no side force"),
    gravity=Setting("j2", "gravity", choices=("j2", "point", "none")),
    rotating=Setting(True, "the planet rotates"),
    atmosphere=Setting("us76", "density over altitude", choices=("us76", "exponential")),
    weather=Setting(False, "random density and winds over altitude in each case"),
    heating=Setting("sutton_graves", "correlation of the heat rate", choices=("sutton_graves", "detra_kemp_riddell")),
    speed_frame=Setting("inertial", "frame of the speed at entry", choices=("inertial", "relative")),
    arrival=Setting("state", "entry given by its state or by a hyperbola", choices=("state", "hyperbola")),
    vehicle=Setting("given", "a vehicle of vehicles.py, or the one given here", choices=("given", *VEHICLES)),
    on_exit=Setting("stop", "what happens when the vehicle leaves the atmosphere", choices=("stop", "continue")),
    guidance=Setting("none", "guidance law", choices=GUIDANCE),
    guidance_period_s=Setting(1.0, "time from one command of the law to the next", low=0.01, high=100.0),
    plan=Setting(
        "entry",
        "origin of distances and reference path: the planned entry of each case, or the values plan_...",
        choices=("entry", "given"),
    ),
    plan_speed_m_s=Setting(7800.0, "planned speed at entry, in the frame speed_frame", low=1.0),
    plan_flight_path_angle_deg=Setting(-2.0, "planned flight-path angle at entry", low=-90.0, high=90.0),
    plan_heading_deg=Setting(90.0, "planned heading at entry, from north, clockwise", low=-360.0, high=360.0),
    plan_latitude_deg=Setting(0.0, "planned geocentric latitude of entry", low=-90.0, high=90.0),
    plan_longitude_deg=Setting(0.0, "planned longitude of entry", low=-360.0, high=360.0),
    plan_altitude_km=Setting(120.0, "planned geodetic altitude of entry", low=1.0),
    plan_radius_km=Setting(0.0, "planned distance of entry from the centre; 0 takes plan_altitude_km", low=0.0),
    plan_ballistic_coefficient_kg_m2=Setting(
        5498.22 / (12.017 * 1.2569),
        "planned ballistic coefficient; a vehicle of vehicles.py has its own",
        low=1e-3,
        unit="kg/m^2",
    ),
    plan_lift_to_drag=Setting(
        0.30, "planned lift-to-drag ratio; a vehicle of vehicles.py has its own", low=1e-3, unit=""
    ),
    plan_trim_angle_deg=Setting(0.0, "planned trim angle; a vehicle of vehicles.py has its own", low=-90.0, high=90.0),
    plan_bank_deg=Setting(60.0, "bank angle of the reference path", low=0.0, high=165.0),
    plan_stop_altitude_km=Setting(10.0, "altitude at which the reference path ends", low=0.0),
    tolerance=Setting(1e-8, "relative error of an integration step", low=1e-14, high=1e-3, unit=""),
    time_limit_s=Setting(20_000.0, "longest flight; a case that has not ended by then is no-stop", low=1.0),
)

CHOICES = choices(Inputs)
