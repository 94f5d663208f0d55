"""Short ways to fly the flexible satellite: inputs and results by column name, in declared units."""

from functools import lru_cache
from pathlib import Path

import numpy as np

import campaigns.flexible_satellite
from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import load_campaign
from mc_engine.flight.flight import fly, prepare
from tests.campaigns.model_flights import ModelFlights

SEED = 20221012
FLIGHTS = ModelFlights("campaigns.flexible_satellite", SEED, rows=200_000)
MODEL, NOMINAL = FLIGHTS.model, FLIGHTS.nominal
fly_cases, fly_one, history = FLIGHTS.cases, FLIGHTS.one, FLIGHTS.history
FOLDER = Path(campaigns.flexible_satellite.__file__).parent
AXES = "xyz"
END = ["q0", "q1", "q2", "q3", *(f"omega_{axis}_rad_s" for axis in AXES), *(f"eta_{i}" for i in (1, 2, 3, 4))]

PWPF = {"actuator": "pwpf", "step_s": 0.005}
TABLE_4 = PWPF | {
    "pwpf_gain": 7.6, "pwpf_time_constant_s": 0.62, "pwpf_u_off": 0.13, "pwpf_hysteresis": 0.26, "thrust_level": 1.1,
}  # fmt: skip
TABLE_8 = PWPF | {
    "pwpf_gain": 7.39, "pwpf_time_constant_s": 0.713, "pwpf_u_off": 0.117, "pwpf_hysteresis": 0.225,
    "thrust_level": 1.07,
}  # fmt: skip
# with the K_P that the print has lost
TABLE_9 = PWPF | {
    "pwpf_gain": 6.3, "pwpf_time_constant_s": 0.9, "pwpf_u_off": 0.06, "pwpf_hysteresis": 0.26, "thrust_level": 0.8,
    "kp": 5.2, "kd": 26.5, "ki": 0.001, "switching_rate_gain": 0.055, "switching_attitude_gain_1_s": 0.08,
}  # fmt: skip
# nothing acts from outside and nothing damps
ALONE = {"kp": 0.0, "kd": 0.0, "ki": 0.0, "disturbance_amplitude_n_m": 0.0, "orbit_rate_rad_s": 0.0}
ALONE |= {"modal_damping_factor": 0.0}

J = np.diag([100.0, 75.0, 50.0])
LAMBDA = np.array([0.7, 1.0, 1.8, 2.5])


def prepared(**inputs):
    """(kernel parameters by name, refusals) of as many cases as the longest input has values."""
    n_cases = max((np.size(value) for value in inputs.values()), default=1)
    ready = prepare(MODEL, NOMINAL | inputs, n_cases)
    return dict(zip(MODEL.kernel_parameters._fields, ready.parameters, strict=True)), ready.refusals


@lru_cache
def fly_campaign(name, n_cases):
    """Columns of the first cases of a campaign file of this folder, as its own runs have them."""
    campaign = load_campaign(FOLDER / name)
    ids = np.arange(n_cases)
    inputs = full_inputs(campaign, case_table(campaign, ids))
    return fly(campaign.model, inputs, ids, campaign.seed)
