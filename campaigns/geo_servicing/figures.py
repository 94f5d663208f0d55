"""Figures of the servicing campaigns' reports."""

from mc_engine.model.figures import HistoryFigure, ProfileFigure, ScatterFigure

FIGURES = (
    ProfileFigure("mean_longitude_deviation_deg", "drift_rate_deg_rev", "Phase portrait: longitude and drift"),
    HistoryFigure(("longitude_deviation_deg", "drift_rate_deg_rev", "eccentricity"), "Longitude, drift, eccentricity"),
    ProfileFigure("along_track_m", "radial_m", "Relative motion in the orbital plane, as the target sees it"),
    ProfileFigure("settled_along_track_m", "settled_radial_m", "The same after settling"),
    HistoryFigure(("range_m", "relative_drift_m", "relative_eccentricity"), "Range, relative drift, relative ellipse"),
    HistoryFigure(("along_track_m", "radial_m", "delta_v_m_s"), "Ahead of and above the target, velocity spent"),
    ScatterFigure("settled_min_range_m", "settled_max_range_m", "Smallest and largest range after settling"),
    ScatterFigure("daily_mean_longitude_deviation_deg", "actual_drift_rate_deg_rev", "Where the transfer ends"),
    ScatterFigure("drift_rate_deg_rev", "eccentricity", "Drift and eccentricity at the end of the transfer"),
)
