"""Our values of published numbers on air, entries, guidance and the autopilot's lead design; `closed_forms` has others.

The records name these functions; each returns its value in the unit of the record.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from campaigns.reentry.autopilot.lead_compensator import crossover_of, margins_of, ratio_of_lead, stage
from campaigns.reentry.closed_forms import GROUND_DENSITY, SCALE_M, circular_speed, glide_angle_deg, steep_load_g
from campaigns.reentry.critical_trajectories import critical_periapses
from campaigns.reentry.guidance.reference_table import FLOWN
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
# standard deviations of independent normal draws; 3σ of the planar baseline: 15 m/s, 0.15°, density 30 % (constant
# factor), C_D and L/D 10 %, mass 2 %
PLANAR_SIGMA = {
    "entry_speed_error_m_s": 5.0,
    "entry_flight_path_angle_error_deg": 0.05,
    "density_factor": 0.1,
    "cd_factor": 0.1 / 3,
    "ld_factor": 0.1 / 3,
    "mass_factor": 0.02 / 3,
}
STARDUST_SIGMA = {
    "entry_speed_error_m_s": 5.0 / 3.0,
    "entry_flight_path_angle_error_deg": 0.08 / 3.0,
    "density_deviation": 1.0,
    "cd_factor": 0.05 / 3.0,
    "mass_factor": 0.01 / 3.0,
}


def off_nominal(sigma: dict[str, float], cases: int, seed: int = 2003) -> dict[str, Any]:
    """Normal draws of each dispersed input, factors about one and errors about zero, float64[cases]."""
    rng = np.random.default_rng(seed)
    return {name: rng.normal(1.0 if name.endswith("factor") else 0.0, size, cases) for name, size in sigma.items()}


def density_kg_m3(altitude_km: float) -> float:
    """Density [kg/m^3] at a geometric altitude: U.S. Standard Atmosphere, 1976."""
    return float(us76(1e3 * altitude_km))


def cases_without_failure(probability: float, confidence: float) -> int:
    """Fewest cases without a failure that show a probability with a confidence; binomial distribution."""
    return int(smallest_sample(probability, confidence))


def failure_probability(cases: int, confidence: float) -> float:
    """Upper bound of the failure probability after no failure: C. J. Clopper, E. S. Pearson, Biometrika 26 (1934)."""
    return 1.0 - float(lower_bound(cases, cases, confidence))


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


def stardust_mach_time_s(mach: float) -> float:
    """Time [s] after entry at which Stardust has slowed to a Mach number, constant hypersonic drag coefficient."""
    history = chosen_history(MODEL, STARDUST, rows=8001)
    fastest = int(np.argmax(history["mach"]))
    return float(np.interp(-mach, -history["mach"][fastest:], history["t_s"][fastest:]))


def stardust_excess_pct(model: str) -> float:
    """How much larger [%] than ours the load of Stardust is by a simpler model.

    "at rest": over a sphere, its inertial speed taken as relative;  "constant angle": NACA Rep. 1381, eq. (15)
    """
    if model == "at rest":
        load = chosen_case(MODEL, STARDUST | AT_REST | EXACT)["peak_load_g"]
    else:
        load = steep_load_g(12_900.0, 8.2)
    return 100.0 * (float(load) / float(chosen_case(MODEL, STARDUST | EXACT)["peak_load_g"]) - 1.0)


def stardust_load_three_sigma_g() -> float:
    """3σ [g] of the largest load under 3σ of 5 m/s, 0.08°, C_D 5 %, mass 1 %, and the slow density error."""
    return 3.0 * float(chosen_cases(MODEL, STARDUST | off_nominal(STARDUST_SIGMA, 2000))["peak_load_g"].std())


def equilibrium_glide() -> dict[str, Any]:
    """Inputs of an equilibrium glide, L/D 1, from 80 km and 0.95 of circular speed; the area [m^2] follows."""
    speed, radius = 0.95 * float(circular_speed(80.0)), WGS84_RADIUS + 80e3
    density = GROUND_DENSITY * np.exp(-80e3 / SCALE_M)
    # lift carries what the circular motion does not
    area = 2.0 * (MU_EARTH / radius**2 - speed**2 / radius) / (density * speed**2)
    vehicle = ballistic(1.0) | {"reference_area_m2": area, "lift_coefficient": 1.0, "bank_deg": 0.0}
    angle = glide_angle_deg(0.95, radius)
    start = {"entry_altitude_km": 80.0, "entry_speed_m_s": speed, "entry_flight_path_angle_deg": angle}
    return TEXTBOOK | vehicle | start | {"on_exit": "continue", "stop_altitude_km": 0.0}


def flown_glide_km() -> float:
    """Length [km] of an equilibrium glide at its altitude."""
    history = chosen_history(MODEL, equilibrium_glide(), rows=4001)
    along = history["speed_m_s"] * np.cos(np.radians(history["flight_path_angle_deg"]))
    return 1e-3 * float(np.trapezoid(along, history["t_s"]))


def periapsis_km(trajectory: str) -> float:
    """Vacuum periapsis [km] below which one pass of aerobraking ends in "capture" or in "entry"; eqs (17), (18)."""
    return float(getattr(critical_periapses(load_campaign("reentry/aerobraking").nominal), trajectory))


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


# ---- reconstructed guidance laws on the planar baseline: the same 1200 dispersed cases for each, ideal sensors


@lru_cache
def _flown(law: str) -> dict[str, np.ndarray]:
    """Columns of the dispersed cases under a guidance law, "none" for the open loop."""
    return chosen_cases(MODEL, PLANAR | off_nominal(PLANAR_SIGMA, 1200) | {"plan": "given", "guidance": law})


def range_spread_km(law: str) -> float:
    """Standard deviation [km] of the range."""
    return float(_flown(law)["downrange_km"].std())


def range_bias_km(law: str) -> float:
    """Distance [km] of the mean range from that of the nominal case."""
    nominal = chosen_case(MODEL, {**PLANAR, "plan": "given"})["downrange_km"]
    return abs(float(_flown(law)["downrange_km"].mean()) - float(nominal))


def spread_reduction_pct(law: str) -> float:
    """By how much [%] the spread of the range is smaller than in open loop."""
    return 100.0 * (1.0 - range_spread_km(law) / range_spread_km("none"))


def largest_load_g(law: str) -> float:
    """Largest load [g] of all cases."""
    return float(_flown(law)["peak_load_g"].max())


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
