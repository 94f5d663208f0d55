"""Figures of the flexible satellite's report: attitude, rates, modes, torques and pulses in time, ends of the cases."""

from mc_engine.model.figures import HistoryFigure, ScatterFigure

FIGURES = (
    HistoryFigure(("q0", "q1", "q2", "q3"), "Attitude in the orbital frame"),
    HistoryFigure(("omega_x_rad_s", "omega_y_rad_s", "omega_z_rad_s", "rate_rad_s"), "Inertial body rates"),
    HistoryFigure(("eta_1", "eta_2", "eta_3", "eta_4"), "Displacement of the modes"),
    HistoryFigure(("command_x_n_m", "command_y_n_m", "command_z_n_m"), "Torques asked for"),
    HistoryFigure(("torque_x_n_m", "torque_y_n_m", "torque_z_n_m"), "Torques of the actuators"),
    HistoryFigure(("pulse_count_x", "pulse_count_y", "pulse_count_z"), "Pulses fired so far"),
    HistoryFigure(("attitude_error_deg", "control_effort_n_m_s"), "Attitude error and impulse spent"),
    ScatterFigure("q1", "q2", "Attitude at the end"),
    ScatterFigure("omega_x_rad_s", "omega_z_rad_s", "Rates at the end"),
    ScatterFigure("control_effort_n_m_s", "attitude_effort_s", "The two objectives of the tuning"),
)
