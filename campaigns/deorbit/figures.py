"""Figures of the de-orbit campaign's report: fuel and impulse over the burn errors, errors and force in time."""

from mc_engine.model.figures import HistoryFigure, MapFigure, ScatterFigure

FIGURES = (
    MapFigure("propellant_kg", "ve_pct", "oe_pct", "Correction propellant over the errors of the burn"),
    MapFigure("correction_impulse_m_s", "ve_pct", "oe_pct", "Correction impulse over the errors of the burn"),
    MapFigure("entry_flight_path_angle_deg", "ve_pct", "oe_pct", "Entry angle over the errors of the burn"),
    HistoryFigure(("a_error_km", "e_error", "omega_error_deg"), "Errors of the elements"),
    HistoryFigure(("position_error_m", "velocity_error_m_s"), "Errors of position and velocity"),
    HistoryFigure(("force_n", "force_radial_n", "force_transverse_n"), "Correction force"),
    HistoryFigure(("impulse_m_s",), "Impulse spent"),
    ScatterFigure("entry_speed_m_s", "entry_flight_path_angle_deg", "Entry state"),
)
