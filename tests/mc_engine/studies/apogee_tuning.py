"""A tuning of the smallest model with a front in closed form: a high apogee against a low speed after the burn."""

import numpy as np

from mc_engine import load_campaign
from mc_engine.campaign.search import SHIPPED
from mc_engine.physics.constants import EQUATORIAL_RADIUS, MU_EARTH

HEAD = """
[campaign]
model = "model.py"
cases = {cases}
design = "mc"
seed = 5

[dispersion.magnitude_error_pct]
dist = "uniform"
half_range = 10.0

[tuning]
population = 12
generations = 6
"""
CHOICE = """
[tuning.parameter.altitude_km]
lower = 200.0
upper = 600.0

[tuning.parameter.burn_dv_m_s]
lower = 50.0
upper = 200.0

[tuning.objective.apogee]
metric = "apogee_altitude_km"
goal = "maximise"

[tuning.objective.speed]
metric = "top_speed_m_s"
"""


def apogee_campaign(more="", cases=10, choice=CHOICE):
    """The campaign with further tables."""
    return load_campaign("apogee.toml", text=HEAD.format(cases=cases) + choice + more, directory=SHIPPED / "minimal")


def apogee_and_speed(altitude_km, dv_m_s):
    """Apogee altitude [km] and speed after the burn [m/s] by vis-viva."""
    r = EQUATORIAL_RADIUS + 1e3 * np.asarray(altitude_km)
    speed = np.sqrt(MU_EARTH / r) + dv_m_s
    apogee = 2.0 / (2.0 / r - speed**2 / MU_EARTH) - r
    return (apogee - EQUATORIAL_RADIUS) / 1e3, speed
