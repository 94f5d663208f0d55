"""Inputs of a de-orbit campaign: parameters, which may differ from case to case, and settings."""

from mc_engine.model import Parameter, Setting, choices, inputs

Inputs = inputs(
    ve_pct=Parameter(0.0, "VE: error of the burn's magnitude", low=-100.0),
    oe_pct=Parameter(0.0, "OE: error of the burn's angle alpha, in percent of alpha itself"),
    out_of_plane_error_deg=Parameter(0.0, "burn direction out of the orbital plane", -90.0, 90.0),
    burn_delay_s=Parameter(0.0, "burn later than planned, on the same orbit"),
    initial_mass_kg=Parameter(100.0, "mass before the correction", low=1e-3),
    isp_s=Parameter(246.0, "specific impulse of the correction thrusters", low=1e-3),
    gain_1_s=Parameter(0.0175, "gain k of the law, critical damping", low=0.0, unit="1/s"),
    thrust_limit_n=Parameter(30.0, "capacity of the thrusters: limit when clipped, level when pulsed", low=1e-6),
    thrust_bias_pct=Parameter(0.0, "true over commanded thrust, less 1", low=-100.0),
    navigation_radial_position_error_m=Parameter(0.0, "constant position error, along the desired radius"),
    navigation_transverse_position_error_m=Parameter(0.0, "constant position error, along the desired motion"),
    navigation_normal_position_error_m=Parameter(0.0, "constant position error, along the orbit normal"),
    navigation_radial_velocity_error_m_s=Parameter(0.0, "constant velocity error, along the desired radius"),
    navigation_transverse_velocity_error_m_s=Parameter(0.0, "constant velocity error, along the desired motion"),
    navigation_normal_velocity_error_m_s=Parameter(0.0, "constant velocity error, along the orbit normal"),
    navigation_position_noise_m=Parameter(0.0, "1-sigma of the noise of each position component", low=0.0),
    navigation_velocity_noise_m_s=Parameter(0.0, "1-sigma of the noise of each velocity component", low=0.0),
    target_speed_m_s=Parameter(7800.0, "desired inertial speed at entry", low=1.0),
    target_flight_path_angle_deg=Parameter(2.0, "desired flight-path angle at entry, below the horizon", 0, 89),
    target_radius_km=Parameter(6491.0, "desired radius of entry", low=1.0),
    target_latitude_argument_deg=Parameter(60.0, "desired argument of latitude at entry"),
    initial_semi_major_axis_km=Parameter(6639.0, "radius of the circular initial orbit", low=1.0),
    inclination_deg=Parameter(55.5, "inclination of the orbit", 0.0, 180.0),
    ballistic_coefficient_kg_m2=Parameter(100.0, "mass over drag area, for drag", low=1e-6, unit="kg/m^2"),
    greenwich_angle_deg=Parameter(0.0, "right ascension of Greenwich, from the node, at the nominal burn"),
    modulator_input_gain=Parameter(3.0, "modulator gain on the command", low=0.0, unit=""),
    modulator_feedback_gain=Parameter(1.0, "modulator gain on the thruster's output", low=0.0, unit=""),
    modulator_time_constant_s=Parameter(57.62, "time constant of the modulator's lag", low=1e-6),
    modulator_on_n=Parameter(3.97, "lag output that switches the thruster on", low=0.0),
    modulator_off_n=Parameter(2.34, "lag output that switches the thruster off", low=0.0),
    control=Setting(
        "continuous", "how the commanded force is flown", choices=("continuous", "clipped", "pulsed", "off")
    ),
    pulse_feed=Setting("continuous", "what feeds the modulator", choices=("continuous", "closed_loop")),
    j2=Setting(False, "oblateness disturbs the flight"),
    j2_feedforward=Setting(False, "the control law accounts for the oblateness"),
    drag=Setting(False, "drag disturbs the flight"),
    mass_model=Setting("constant", "mass that turns force into acceleration", choices=("constant", "burning")),
    burn_point=Setting("descending", "crossing of orbit and path", choices=("descending", "ascending")),
    step_s=Setting(1.0, "integration step", low=1e-3, high=60.0),
    steps_per_fix=Setting(1.0, "integration steps between navigation fixes", low=1.0, high=1e6, whole=True, unit=""),
    time_limit_s=Setting(3000.0, "longest flight; a case that has not entered by then ends as no-stop", low=1.0),
)

CHOICES = choices(Inputs)
