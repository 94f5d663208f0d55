"""A sounding rocket in the vertical plane of its launcher, from the rail to the ground.

A rigid rocket with a swivelling nozzle burns, coasts to its apogee, and comes down on a
drogue and a main parachute.  Flat Earth at rest, air of one exponential layer, no
moments from the air: good for dispersions up to 100 km, not for loads of the ascent.
"""

from collections import namedtuple
from math import radians

from figures import FIGURES

from mc_engine.lanes import cos, exp, maximum, minimum, physics, sin, sqrt, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import (
    Event,
    FixedStep,
    Parameter,
    at_end,
    inputs,
    maximum_of,
    metrics,
    model,
    outputs,
    states,
    time_of_maximum,
)
from mc_engine.physics.atmosphere import exponential
from mc_engine.physics.constants import STANDARD_GRAVITY

# kg; m, m^2 and kg m^2 of the rocket
DRY_MASS, PROPELLANT = 200.0, 200.0
NOZZLE_ARM, BODY_DRAG_AREA, INERTIA = 1.5, 0.04, 600.0
DROGUE_AREA, MAIN_AREA, MAIN_ALTITUDE = 2.0, 30.0, 3000.0
MASS_FLOW, EXHAUST_SPEED = 10.0, 2250.0  # kg/s, m/s
RAIL = 6.0  # m
# Attitude to be held, rad; rad of the nozzle per rad, and per rad/s, of error; stop
HELD = radians(5.0)
PROPORTIONAL, DERIVATIVE, NOZZLE_STOP = 0.3, 0.11, 0.1
ATTITUDE_NOISE, RATE_NOISE = 0.002, 0.005  # rad, rad/s, one sigma of a sample

Inputs = inputs(
    launcher_deg=Parameter(5.0, "launcher's angle from the vertical", 0.0, 30.0),
    thrust_pct=Parameter(0.0, "error of the thrust, not of the flow", -50.0, 50.0),
    drag_pct=Parameter(0.0, "error of the body's drag area", -90.0, 200.0),
    wind_m_s=Parameter(0.0, "wind at the ground, downrange", -40.0, 40.0),
    misalignment_deg=Parameter(0.0, "of the thrust, from the nozzle", -3.0, 3.0),
)

State = states(
    downrange_km="distance along the ground",
    altitude_km="altitude",
    vx_m_s="speed downrange",
    vz_m_s="speed upwards",
    pitch_deg="body axis from the vertical",
    rate_deg_s="rate of the same",
    mass_kg="mass",
)
Memory = namedtuple("Memory", "nozzle burning drag_area")  # rad; 1 or 0; m^2
Outputs = outputs(
    altitude_km="altitude",
    downrange_km="distance along the ground",
    speed_m_s="speed over the ground",
    pressure_pa="dynamic pressure",
    pitch_deg="body axis from the vertical",
    nozzle_deg="angle of the nozzle",
)
Metrics = metrics(
    apogee_km=maximum_of("altitude_km", "greatest altitude"),
    apogee_time_s=time_of_maximum("altitude_km", "time from the rail to the apogee"),
    top_speed_m_s=maximum_of("speed_m_s", "greatest speed over the ground"),
    peak_pressure_pa=maximum_of("pressure_pa", "greatest dynamic pressure"),
    landing_distance_km=at_end("downrange_km", "landing point from the launcher"),
    landing_speed_m_s=at_end("speed_m_s", "speed at the ground, wind included"),
)


@physics
def thrust_of(p):
    """Thrust [N]: the mass flow is the nominal one."""
    return MASS_FLOW * EXHAUST_SPEED * (1.0 + p.thrust)


@physics
def initial(p):
    """At the rail's end: the speed is that of a constant acceleration along it."""
    mass = DRY_MASS + PROPELLANT
    along = thrust_of(p) / mass - STANDARD_GRAVITY * cos(p.launcher)
    speed = sqrt(2.0 * RAIL * along)
    s, c = sin(p.launcher), cos(p.launcher)
    return State(
        downrange=RAIL * s, altitude=RAIL * c, vx=speed * s, vz=speed * c,
        pitch=p.launcher, rate=0.0, mass=mass,
    )  # fmt: skip


@physics
def start(p):
    """The nozzle straight, the engine burning, no parachute."""
    drag_area = BODY_DRAG_AREA * (1.0 + p.drag)
    return Memory(nozzle=0.0, burning=1.0, drag_area=drag_area)


@physics
def air(s, p):
    """(density [kg/m^3], velocity through the air [m/s]); the wind fades in 8 km."""
    rho = exponential(s.altitude, 1.225, 0.0, 7200.0)
    return rho, s.vx - p.wind * exp(s.altitude * (-1.0 / 8000.0)), s.vz


@physics
def rhs(s, m, p):
    """Thrust along the nozzle, which turns the body; drag against the air; gravity."""
    rho, ux, uz = air(s, p)
    drag = 0.5 * rho * m.drag_area * sqrt(ux * ux + uz * uz)
    force = m.burning * thrust_of(p)
    swivel = m.nozzle + p.misalignment
    towards = s.pitch - swivel
    turn = force * (NOZZLE_ARM / INERTIA) * sin(swivel)
    return State(
        downrange=s.vx,
        altitude=s.vz,
        vx=(force * sin(towards) - drag * ux) / s.mass,
        vz=(force * cos(towards) - drag * uz) / s.mass - STANDARD_GRAVITY,
        pitch=m.burning * s.rate,
        rate=turn,
        mass=-m.burning * MASS_FLOW,
    )


@physics
def control(s, m, draws):
    """Turn the nozzle against errors of attitude and rate; every sample has noise."""
    n1, n2 = normal_pair(draws, 0)
    error = s.pitch + ATTITUDE_NOISE * n1 - HELD
    nozzle = -PROPORTIONAL * error - DERIVATIVE * (s.rate + RATE_NOISE * n2)
    nozzle = minimum(maximum(nozzle, -NOZZLE_STOP), NOZZLE_STOP)
    return Memory(nozzle=nozzle, burning=m.burning, drag_area=m.drag_area)


@physics
def propellant(s):  # propellant left [kg]
    return s.mass - DRY_MASS


@physics
def climb(s):  # speed upwards [m/s]
    return s.vz


@physics
def above_main(s):  # altitude above that of the main parachute [m]
    return s.altitude - MAIN_ALTITUDE


@physics
def altitude(s):  # altitude [m]
    return s.altitude


@physics
def switch(s, m, hit):
    """Burn-out stops the engine; the drogue opens at the apogee, the main one lower."""
    burning = where(hit.burn_out > 0.5, 0.0, m.burning)
    area = where(hit.apogee > 0.5, DROGUE_AREA, m.drag_area)
    area = where(hit.main > 0.5, MAIN_AREA, area)
    return s, Memory(nozzle=m.nozzle, burning=burning, drag_area=area)


@physics
def observe(s, m, p):
    """What histories show, and what extremes are taken of."""
    rho, ux, uz = air(s, p)
    pressure = 0.5 * rho * (ux * ux + uz * uz)
    return Outputs(
        altitude=s.altitude, downrange=s.downrange,
        speed=sqrt(s.vx * s.vx + s.vz * s.vz), pressure=pressure,
        pitch=s.pitch, nozzle=m.burning * m.nozzle,
    )  # fmt: skip


MODEL = model(
    name="sounding_rocket",
    title="Sounding rocket from rail to ground",
    inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(step=0.05, until=2000.0),
    initial=initial, start=start, rhs=rhs, control=control,
    switch=switch, observe=observe,
    events={
        "burn_out": Event(propellant, "falling", "switch"),
        "apogee": Event(climb, "falling", "switch"),
        "main": Event(above_main, "falling", "switch"),
        "ground": Event(altitude, "falling", "stop"),
    },
    figures=FIGURES,
)  # fmt: skip
