"""Our values of published numbers on air, single entries and the autopilot's lead design; `closed_forms` has others.

The records name these functions; each returns its value in the unit of the record.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from campaigns.reentry.autopilot.lead_compensator import crossover_of, margins_of, ratio_of_lead, stage
from campaigns.reentry.closed_forms import GROUND_DENSITY, SCALE_M, circular_speed, glide_angle_deg, steep_load_g
from campaigns.reentry.critical_trajectories import critical_periapses
from campaigns.reentry.guidance.apollo_final_phase import FLOWN
from campaigns.reentry.model import MODEL
from mc_engine import load_campaign
from mc_engine.flight.flight import chosen_case, chosen_cases, chosen_history
from mc_engine.physics.atmosphere import us76
from mc_engine.physics.constants import MU_EARTH, STANDARD_GRAVITY
from mc_engine.physics.frames import WGS84_RADIUS
from mc_engine.statistics.binomial import lower_bound, smallest_sample

EXACT: dict[str, Any] = {"tolerance": 1e-12}  # of an integration step, where a flight is compared with a closed form
AT_REST: dict[str, Any] = {"shape": "sphere", "gravity": "point", "rotating": False}
# a spherical Earth that does not turn, motion in the plane of the equator; with the textbook atmosphere
PLANAR: dict[str, Any] = AT_REST | {"speed_frame": "relative", "planar": True}
TEXTBOOK: dict[str, Any] = PLANAR | {"atmosphere": "exponential"}
# P. N. Desai, G. D. Qualls, AIAA 2008-1198; the latitude, so that it comes down in Utah, is ours
STARDUST: dict[str, Any] = {
    "vehicle": "sample_return",
    "entry_radius_km": 6503.14,
    "entry_speed_m_s": 12_900.0,
    "entry_flight_path_angle_deg": -8.2,
    "entry_heading_deg": 103.0,
    "entry_latitude_deg": 42.3,
    "stop_altitude_km": 20.0,
}


# ---- air and numbers of cases


def density_kg_m3(altitude_km: float) -> float:
    """Density [kg/m^3] at a geometric altitude: U.S. Standard Atmosphere, 1976."""
    return float(us76(1e3 * altitude_km))


def cases_without_failure(probability: float, confidence: float) -> int:
    """Fewest cases without a failure that show a probability with a confidence; binomial distribution."""
    return int(smallest_sample(probability, confidence))


def failure_probability(cases: int, confidence: float) -> float:
    """Upper bound of the failure probability after no failure: C. J. Clopper, E. S. Pearson, Biometrika 26 (1934)."""
    return 1.0 - float(lower_bound(cases, cases, confidence))


# ---- ballistic entries


def ballistic(b: Any) -> dict[str, Any]:
    """A vehicle without lift of ballistic coefficient b [kg/m^2]."""
    return {"mass_kg": b, "reference_area_m2": 1.0, "drag_coefficient": 1.0, "lift_coefficient": 0.0}


def load_from_orbit_g(which: str) -> float:
    """The "min" or "max" of the largest loads [g] of entries at circular speed and −2°, 50 to 1000 kg/m^2.

    Each starts where rho / B is that of 100 kg/m^2 at 120 km: eq. (5) of the source has then one solution for all.
    """
    b = np.array([50.0, 100.0, 200.0, 400.0, 1000.0])
    altitude_km = 120.0 - 1e-3 * SCALE_M * np.log(b / 100.0)
    start = {"entry_altitude_km": altitude_km, "entry_speed_m_s": circular_speed(altitude_km), "stop_altitude_km": 5.0}
    return float(getattr(chosen_cases(MODEL, TEXTBOOK | ballistic(b) | start | EXACT)["peak_load_g"], which)())


def excess_of_gravity_pct(which: str) -> float:
    """The "min" or "max" excess [%] of largest loads of entries at 6.5 km/s from 150 km over those without gravity.

    −30 to −60° and 100 to 3000 kg/m^2: H. J. Allen, A. J. Eggers, NACA Rep. 1381 (1958), eq. (15).
    """
    angles, masses = np.meshgrid(-np.arange(30.0, 61.0, 5.0), [100.0, 300.0, 1000.0, 3000.0])
    angle_deg, b = angles.ravel(), masses.ravel()
    start = {"entry_speed_m_s": 6500.0, "entry_altitude_km": 150.0, "stop_altitude_km": 0.0}
    start |= {"entry_flight_path_angle_deg": angle_deg}
    loads = chosen_cases(MODEL, TEXTBOOK | ballistic(b) | start | EXACT)["peak_load_g"]
    return float(getattr(100.0 * (loads / steep_load_g(6500.0, angle_deg) - 1.0), which)())


# ---- Stardust


def stardust_mach_time_s(mach: float) -> float:
    """Time [s] after entry at which Stardust has slowed to a Mach number, constant hypersonic drag coefficient."""
    history = chosen_history(MODEL, STARDUST, rows=8001)
    fastest = int(np.argmax(history["mach"]))
    return float(np.interp(-mach, -history["mach"][fastest:], history["t_s"][fastest:]))


def stardust_at_rest_excess_pct() -> float:
    """How much larger [%] the load of Stardust is over a sphere at rest, its inertial speed taken as relative."""
    at_rest = chosen_case(MODEL, STARDUST | AT_REST | EXACT)["peak_load_g"]
    return 100.0 * (float(at_rest) / _stardust_load_g() - 1.0)


def stardust_constant_angle_excess_pct() -> float:
    """How much larger [%] its load is by NACA Rep. 1381, eq. (15), at a constant angle."""
    return 100.0 * (steep_load_g(12_900.0, 8.2) / _stardust_load_g() - 1.0)


@lru_cache
def _stardust_load_g() -> float:
    return float(chosen_case(MODEL, STARDUST | EXACT)["peak_load_g"])


def stardust_load_three_sigma_g() -> float:
    """3σ [g] of the largest load under 3σ of 5 m/s, 0.08°, C_D 5 %, mass 1 %, and the slow density error."""
    n, rng = 2000, np.random.default_rng(2003)
    flown = chosen_cases(
        MODEL,
        {
            **STARDUST,
            "entry_speed_error_m_s": rng.normal(0.0, 5.0 / 3.0, n),
            "entry_flight_path_angle_error_deg": rng.normal(0.0, 0.08 / 3.0, n),
            "density_deviation": rng.normal(0.0, 1.0, n),
            "cd_factor": rng.normal(1.0, 0.05 / 3.0, n),
            "mass_factor": rng.normal(1.0, 0.01 / 3.0, n),
        },
    )
    return 3.0 * float(flown["peak_load_g"].std())


# ---- glide, aerobraking


def equilibrium_glide() -> dict[str, Any]:
    """Inputs of an equilibrium glide, L/D 1, from 80 km and 0.95 of circular speed; the area [m^2] follows."""
    speed, radius = 0.95 * float(circular_speed(80.0)), WGS84_RADIUS + 80e3
    density = GROUND_DENSITY * np.exp(-80e3 / SCALE_M)
    return TEXTBOOK | {
        "mass_kg": 1.0,
        # lift carries what the circular motion does not
        "reference_area_m2": 2.0 * (MU_EARTH / radius**2 - speed**2 / radius) / (density * speed**2),
        "lift_coefficient": 1.0,
        "drag_coefficient": 1.0,
        "bank_deg": 0.0,
        "entry_altitude_km": 80.0,
        "entry_speed_m_s": speed,
        "entry_flight_path_angle_deg": glide_angle_deg(0.95, radius),
        "on_exit": "continue",
        "stop_altitude_km": 0.0,
    }


def flown_glide_km() -> float:
    """Length [km] of an equilibrium glide at its altitude."""
    history = chosen_history(MODEL, equilibrium_glide(), rows=4001)
    along = history["speed_m_s"] * np.cos(np.radians(history["flight_path_angle_deg"]))
    return 1e-3 * float(np.trapezoid(along, history["t_s"]))


def periapsis_km(trajectory: str) -> float:
    """Vacuum periapsis [km] below which one pass of aerobraking ends in "capture" or in "entry"; eqs (17), (18)."""
    return float(getattr(critical_periapses(load_campaign("reentry/aerobraking").nominal), trajectory))


# ---- Apollo final phase


def apollo_range_to_go_km(speed_m_s: float) -> float:
    """Range [km] from a speed on that drag and climb of the printed table leave, linear between its rows.

    ds/dV = -V cos γ / (D + g sin γ), from the table's last range on: R. Morth, MIT R-532 (1966).
    """
    rows = np.array(FLOWN)
    v = np.linspace(rows[0, 0], rows[-1, 0], 20_001)
    drag, climb = (np.interp(v, rows[:, 0], rows[:, column]) for column in (2, 1))
    slope = np.sqrt(v * v - climb * climb) / (drag + STANDARD_GRAVITY * climb / v)
    distance = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(v))])
    return float(rows[0, 3] + np.interp(speed_m_s, v, distance) / 1e3)


# ---- lead design


def ogata_plant(w: Any) -> Any:
    """4 / (s (s + 2)) at a frequency [rad/s]."""
    return 4.0 / (1j * w * (1j * w + 2.0))


def ogata_lead(number: str) -> float:
    """A number of Ogata's design with his roundings: static gain 10, lead 38°, α to two digits, crossover to a rad/s.

    "zero", "pole" [rad/s] and "gain" of the compensator; "phase" margin [deg] and "crossover" [rad/s] with it, and the
    "bare phase" margin [deg] without.

    K. Ogata, Modern Control Engineering, lead compensation: zero ω√α, pole ω/√α, gain K/α.
    """
    alpha = round(float(ratio_of_lead(np.radians(38.0))), 2)
    w = float(round(crossover_of(lambda x: 10.0 * ogata_plant(x), float(np.sqrt(alpha)))))
    lead, bare = stage(10.0, alpha, w), margins_of(lambda x: 10.0 * ogata_plant(x))
    phase, crossover = lead.margins(ogata_plant)
    margins = {"phase": np.degrees(phase), "crossover": crossover, "bare phase": np.degrees(bare.phase)}
    return float((lead._asdict() | margins)[number])
