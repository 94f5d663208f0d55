"""What the report draws of the sounding rocket."""

from mc_engine.model import HistoryFigure, MapFigure, ProfileFigure, ScatterFigure

FIGURES = (
    MapFigure("apogee_km", "thrust_pct", "drag_pct", "Apogee over thrust and drag"),
    ScatterFigure("landing_distance_km", "apogee_km", "Landing and apogee"),
    ProfileFigure("speed_m_s", "altitude_km", "Altitude over speed"),
    HistoryFigure(("altitude_km", "pitch_deg", "nozzle_deg"), "Flight and control"),
)
