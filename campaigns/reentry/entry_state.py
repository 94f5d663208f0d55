"""From the inputs of a case to its first state, over ground and in planet-fixed axes.  NumPy, SI, whole chunks."""

from collections import namedtuple
from types import SimpleNamespace

import numpy as np

from campaigns.reentry.inputs import ELLIPSOID, FLAT, HYPERBOLA, INERTIAL
from campaigns.reentry.planets import of_planets
from mc_engine.model import Refusals
from mc_engine.physics.frames import carried_along, local_axes, over_ellipsoid, radius_at_altitude, velocity_components

# The planet of each case; float64[n], SI.  flat: bool[n].
World = namedtuple("World", "mu radius polar_radius e2 rate flat")
# The entry of each case; float64[n], SI.
# position, velocity: [3, n], planet-fixed, over ground (flat: ahead, left, up);  speed, path: over ground
# The others are those of the planned entry, without errors.  place, ahead, right: unit vectors [3, n], to it, along its
# great circle, to its right;  altitude, radius, latitude: where;  heading, planned_speed, planned_path: over ground
Entry = namedtuple(
    "Entry",
    "position velocity speed path place ahead right altitude radius latitude heading planned_speed planned_path",
)


def world_of(i: SimpleNamespace, settings: SimpleNamespace) -> World:
    """The planet of each case as its settings ask for it, SI; one without an ellipsoid is its sphere."""
    radius = np.where(i.surface_radius > 0.0, i.surface_radius, of_planets(settings.planet, "radius"))
    e2 = np.where(settings.shape == ELLIPSOID, of_planets(settings.planet, "e2"), 0.0)
    rate = np.where(settings.rotating > 0.5, of_planets(settings.planet, "rate"), 0.0)
    mu = of_planets(settings.planet, "mu")
    return World(mu, radius, polar_radius=radius * np.sqrt(1.0 - e2), e2=e2, rate=rate, flat=settings.shape == FLAT)


def hyperbolic_arrival(excess_speed, periapsis, radius, mu, refusals: Refusals, asked):
    """(speed, flight-path angle) on the way in, at a radius, of an approach with this vacuum periapsis radius.

    asked : bool[n], the cases that come so; of them those whose periapsis lies above the radius join `refusals`.
    """
    speed = np.sqrt(excess_speed**2 + 2.0 * mu / radius)
    cosine = periapsis * np.sqrt(excess_speed**2 + 2.0 * mu / periapsis) / (radius * speed)
    refusals.add(asked & ~(np.abs(cosine) <= 1.0), "the vacuum periapsis lies above the entry altitude")
    return speed, -np.arccos(np.clip(cosine, -1.0, 1.0))


def over_ground(components, radius, latitude, world: World, frame):
    """North, east, up of the velocity over ground [m/s]; `frame` says in which frame the components are."""
    carried = carried_along(radius, latitude, world.rate)
    return components - np.where(frame == INERTIAL, carried, 0.0)


def _height(i: SimpleNamespace, latitude, world: World):
    """(radius, geodetic altitude) [m] of the planned entry, one of which is given."""
    radius = radius_at_altitude(i.entry_altitude, latitude, world.polar_radius, world.e2)
    radius = np.where(i.entry_radius > 0.0, i.entry_radius, radius)
    altitude = over_ellipsoid(radius, 1.0 / radius, np.sin(latitude) ** 2, world.polar_radius, world.e2)[0]
    return radius, np.where(i.entry_radius > 0.0, altitude, i.entry_altitude)


def entry_of(i: SimpleNamespace, settings: SimpleNamespace, world: World, refusals: Refusals) -> Entry:
    """The first state with its errors, SI, and the frame of the entry that was planned without them."""
    latitude, longitude = i.entry_latitude, i.entry_longitude
    radius, altitude = _height(i, latitude, world)
    comes = settings.arrival == HYPERBOLA
    speed, path = hyperbolic_arrival(
        i.excess_speed, world.radius + i.vacuum_periapsis, radius, world.mu, refusals, comes
    )
    speed, path = np.where(comes, speed, i.entry_speed), np.where(comes, path, i.entry_flight_path_angle)
    planned = over_ground(
        velocity_components(speed, path, i.entry_heading), radius, latitude, world, settings.speed_frame
    )
    level = np.hypot(planned[0], planned[1])
    planned_radius, planned_latitude = radius, latitude
    heading = np.where(level > 0.0, np.arctan2(planned[1], planned[0]), i.entry_heading)
    north, east, place = local_axes(latitude, longitude)
    ahead = np.cos(heading) * north + np.sin(heading) * east
    components = velocity_components(
        speed + i.entry_speed_error, path + i.entry_flight_path_angle_error, i.entry_heading + i.entry_heading_error
    )
    latitude, longitude = latitude + i.entry_latitude_error, longitude + i.entry_longitude_error
    radius = radius + i.entry_altitude_error
    components = over_ground(components, radius, latitude, world, settings.speed_frame)
    north, east, up = local_axes(latitude, longitude)
    velocity = components[0] * north + components[1] * east + components[2] * up
    position = radius * up
    # minus zero would fly to other bits than zero does
    return Entry(
        position=np.where(world.flat, _flat_place(radius - world.polar_radius), position) + 0.0,
        velocity=np.where(world.flat, _flat_velocity(components, heading), velocity) + 0.0,
        place=place,
        ahead=ahead,
        right=np.cross(ahead, place, axis=0),
        altitude=altitude,
        speed=np.sqrt((components**2).sum(axis=0)),
        path=np.arctan2(components[2], np.hypot(components[0], components[1])),
        heading=heading,
        radius=planned_radius,
        latitude=planned_latitude,
        planned_speed=np.sqrt((planned**2).sum(axis=0)),
        planned_path=np.arctan2(planned[2], level),
    )


def _flat_place(altitude):
    """Place [m] over the flat Earth: ahead, left and up of the entry point."""
    zero = np.zeros_like(altitude)
    return np.array([zero, zero, altitude])


def _flat_velocity(components, heading):
    """Velocity [m/s] ahead, left and up, from north, east and up."""
    north, east, up = components
    s, c = np.sin(heading), np.cos(heading)
    return np.array([north * c + east * s, north * s - east * c, up])
