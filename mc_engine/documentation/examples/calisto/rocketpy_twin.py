"""The same rocket in RocketPy (extra `bench`) under the same campaign file; of model.py it has the names alone.

    mc-engine run rocketpy.toml --out rocketpy
    mc-engine run campaign.toml --out calisto
    mc-engine compare rocketpy calisto

Air and wind are handed to RocketPy as tables, so that both rockets fly in the same: its own standard air is linear in
altitude from layer to layer.  Its parachutes look at the flight a thousand times a second.
"""

import logging
import warnings
from pathlib import Path

import numpy as np
from model import Inputs, Metrics

from mc_engine import Simulator
from mc_engine.model import metrics
from mc_engine.physics.air import us76_air

HERE = Path(__file__).parent


def start():
    """What the cases share: RocketPy, its motor, the air, the wind [m; m/s north, east]."""
    import rocketpy

    logging.getLogger("rocketpy").setLevel(logging.ERROR)
    warnings.simplefilter("ignore")
    heights = np.arange(0.0, 12_001.0, 25.0)
    air = us76_air(heights)
    wind = np.loadtxt(HERE / "wind.csv", delimiter=",", skiprows=1)
    thrust = np.loadtxt(HERE / "thrust.csv", delimiter=",", skiprows=1)
    return rocketpy, heights, air, wind, thrust


def fly(inputs, case):
    """One flight: apogee above the ground, speeds, times and the landing place, in declared units."""
    rocketpy, heights, air, wind, thrust = case.shared
    environment = rocketpy.Environment(latitude=32.990254, longitude=-106.974998, elevation=1400.0)
    environment.set_atmospheric_model(
        "custom_atmosphere",
        pressure=np.column_stack([heights, air.pressure]),
        temperature=np.column_stack([heights, air.temperature]),
        wind_u=np.column_stack([wind[:, 0], inputs["wind_factor"] * wind[:, 2]]),
        wind_v=np.column_stack([wind[:, 0], inputs["wind_factor"] * wind[:, 1]]),
    )
    flight = rocketpy.Flight(
        rocket=_rocket(rocketpy, inputs, thrust),
        environment=environment,
        rail_length=5.2,
        inclination=inputs["inclination_deg"],
        heading=inputs["heading_deg"],
        rtol=1e-7,
        atol=6 * [1e-5] + 4 * [1e-7] + 3 * [1e-5],
        max_time_step=0.5,
        verbose=False,
    )
    return {
        "apogee_m": float(flight.apogee - 1400.0),
        "apogee_time_s": float(flight.apogee_time),
        "top_speed_m_s": float(flight.max_speed),
        "rail_speed_m_s": float(flight.out_of_rail_velocity),
        "flight_time_s": float(flight.t_final),
        "landing_east_m": float(flight.x_impact),
        "landing_north_m": float(flight.y_impact),
        "landing_speed_m_s": float(-flight.impact_velocity),
    }


def _rocket(rocketpy, inputs, thrust):
    motor = rocketpy.SolidMotor(
        thrust_source=np.column_stack([thrust[:, 0], inputs["thrust_factor"] * thrust[:, 1]]).tolist(),
        burn_time=3.9, dry_mass=1.815, dry_inertia=(0.125, 0.125, 0.002), nozzle_radius=0.033, throat_radius=0.011,
        grain_number=5, grain_density=1815.0, grain_outer_radius=0.033, grain_initial_inner_radius=0.015,
        grain_initial_height=0.12, grain_separation=0.005, grains_center_of_mass_position=0.397,
        center_of_dry_mass_position=0.317, nozzle_position=0.0,
        coordinate_system_orientation="nozzle_to_combustion_chamber",
    )  # fmt: skip
    points = np.loadtxt(HERE / "drag.csv", delimiter=",", skiprows=1) * [1.0, inputs["drag_factor"]]
    drag = rocketpy.Function(points.tolist(), interpolation="linear", extrapolation="constant")
    rocket = rocketpy.Rocket(
        radius=0.0635, mass=inputs["body_mass_kg"], inertia=(6.321, 6.321, 0.034), power_off_drag=drag,
        power_on_drag=drag, center_of_mass_without_motor=0.0, coordinate_system_orientation="tail_to_nose",
    )  # fmt: skip
    rocket.add_motor(motor, position=-1.255)
    rocket.set_rail_buttons(0.0818, -0.6182, 45.0)
    rocket.add_nose(length=0.55829, kind="vonKarman", position=1.278)
    rocket.add_trapezoidal_fins(n=4, root_chord=0.12, tip_chord=0.04, span=0.1, position=-1.04956)
    rocket.add_tail(top_radius=0.0635, bottom_radius=0.0435, length=0.06, position=-1.194656)
    for name, trigger in (("drogue", "apogee"), ("main", 800.0)):
        rocket.add_parachute(name, cd_s=inputs[f"{name}_area_m2"], trigger=trigger, sampling_rate=1000.0,
                             lag=inputs[f"{name}_lag_s"], noise=(0.0, 0.0, 0.0))  # fmt: skip
    return rocket


SIMULATOR = Simulator(
    title="Calisto in RocketPy",
    parameters=Inputs,
    metrics=metrics(**{metric.name: metric.description for metric in Metrics.declared}),
    fly=fly,
    start=start,
    time_limit_s=300.0,
    data=("thrust.csv", "drag.csv", "wind.csv"),
)
