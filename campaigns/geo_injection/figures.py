"""Figures of an injection's report: the sequence in time and in the plane, clouds of the injection errors."""

from mc_engine.model.figures import HistoryFigure, MapFigure, ProfileFigure, ScatterFigure

FIGURES = (
    HistoryFigure(("radius_km", "speed_m_s", "radial_speed_m_s"), "Radius and speeds"),
    HistoryFigure(("flight_path_angle_deg", "thrust_right_ascension_deg", "thrust_declination_deg"), "Angles"),
    HistoryFigure(("mass_kg", "acceleration_m_s2"), "Mass and acceleration"),
    HistoryFigure(
        ("osculating_semi_major_axis_km", "osculating_eccentricity", "osculating_inclination_deg"), "Osculating orbit"
    ),
    ProfileFigure("x_km", "y_km", "The flight in the plane of the equator"),
    ScatterFigure("semi_major_axis_km", "eccentricity", "Injection: semi-major axis and eccentricity"),
    ScatterFigure("semi_major_axis_km", "inclination_deg", "Injection: semi-major axis and inclination"),
    ScatterFigure("eccentricity", "inclination_deg", "Injection: eccentricity and inclination"),
    ScatterFigure("longitude_drift_deg_day", "correction_dv_m_s", "Drift and correction of the injected orbit"),
    ScatterFigure("propellant_kg", "correction_dv_m_s", "Propellant and correction"),
    MapFigure("correction_dv_m_s", "thrust_factor", "isp_factor", "Correction over the engine's errors"),
)
