"""Figures of the entry campaigns' reports; a map is drawn where the run disperses its two inputs."""

from mc_engine.model.figures import (
    CorridorFigure,
    FootprintFigure,
    HistoryFigure,
    MapFigure,
    ProfileFigure,
    ScatterFigure,
)

HIGHEST_LANDING_KM = 35.0  # a flight that ends higher has left the atmosphere again, or ran out of time

FIGURES = (
    CorridorFigure(
        "relative_speed_m_s",
        "relative_flight_path_angle_deg",
        (
            "peak_load_g",
            "peak_axial_load_g",
            "peak_dynamic_pressure_pa",
            "peak_heat_rate_w_m2",
            "heat_load_j_m2",
            "exits",
            "min_altitude_km",
        ),
        "Entry corridor: speed and flight-path angle at entry, over ground",
    ),
    FootprintFigure(
        "final_latitude_deg",
        "final_longitude_deg",
        "Where the flights end",
        ends_below=("final_altitude_km", HIGHEST_LANDING_KM),
        planet="planet",
        target=("target_latitude_deg", "target_longitude_deg"),
    ),
    ProfileFigure("speed_m_s", "altitude_km", "Altitude against speed"),
    MapFigure("exit_speed_m_s", "vacuum_periapsis_km", "density_factor", "Speed that a pass leaves"),
    MapFigure(
        "peak_load_g",
        "entry_flight_path_angle_error_deg",
        "entry_speed_error_m_s",
        "Largest load over the entry errors",
    ),
    MapFigure("miss_km", "ve_pct", "oe_pct", "Landing miss over the errors of the de-orbit burn", upstream=True),
    HistoryFigure(("altitude_km", "speed_m_s", "flight_path_angle_deg"), "Altitude, speed and flight-path angle"),
    HistoryFigure(("load_g", "heat_rate_w_m2", "dynamic_pressure_pa"), "Load, heat rate and dynamic pressure"),
    HistoryFigure(("downrange_km", "crossrange_km", "bank_deg"), "Distances over ground and bank"),
    ScatterFigure("downrange_km", "crossrange_km", "Where the flight ends"),
    ScatterFigure("peak_load_altitude_km", "peak_load_g", "Largest load and its altitude"),
    ScatterFigure("heat_load_j_m2", "peak_heat_rate_w_m2", "Largest heat rate and heat load"),
)
