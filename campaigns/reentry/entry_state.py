"""From the inputs of a case to its first state, over ground and in planet-fixed axes.  NumPy, SI, whole chunks."""

from collections import namedtuple
from types import SimpleNamespace

import numpy as np

from campaigns.reentry.air import GAS_CONSTANT
from campaigns.reentry.inputs import CHOICES
from campaigns.reentry.planets import of_planets
from mc_engine.model import Refusals
from mc_engine.physics import frames

# The planet of each case and its exponential atmosphere; float64[n], SI.  gravity: at the ground
World = namedtuple("World", "mu radius polar_radius e2 rate gravity log_density inverse_scale temperature")
# The first state of each case with its errors, and the entry as it was planned without them; float64[n], SI.
# position, velocity: [3, n], planet-fixed, over ground (flat: ahead, left, up);  altitude, speed, path: over ground
Entry = namedtuple("Entry", "position velocity altitude speed path planned")
# place, ahead, right: unit vectors [3, n], to the entry, along its great circle, to its right;  altitude, r, latitude:
# where;  speed, path, heading: over ground
Planned = namedtuple("Planned", "place ahead right altitude r latitude speed path heading")


def world_of(i: SimpleNamespace, settings: SimpleNamespace) -> World:
    """The planet of each case as its settings ask for it, SI; temperature: of the exponential atmosphere, g H0 / R."""
    radius = np.where(i.surface_radius > 0.0, i.surface_radius, of_planets(settings.planet, "radius"))
    e2 = np.where(settings.shape == CHOICES.shape.ellipsoid, of_planets(settings.planet, "e2"), 0.0)
    mu = of_planets(settings.planet, "mu")
    gravity = mu / radius**2
    density, scale = of_planets(settings.planet, "air").T
    return World(
        mu=mu,
        radius=radius,
        polar_radius=radius * np.sqrt(1.0 - e2),
        e2=e2,
        rate=np.where(settings.rotating > 0.5, of_planets(settings.planet, "rate"), 0.0),
        gravity=gravity,
        log_density=np.log(density),
        inverse_scale=1.0 / scale,
        temperature=gravity * scale / GAS_CONSTANT,
    )


def entry_of(i: SimpleNamespace, settings: SimpleNamespace, world: World, refusals: Refusals) -> Entry:
    """The first state with its errors, and the entry planned without them, given by its altitude or radius; SI."""

    def over_ground(speed, path, heading, radius, latitude):
        """North, east, up, size [m/s] and path angle [rad] of the velocity over ground, from those in speed_frame."""
        inertial = settings.speed_frame == CHOICES.speed_frame.inertial
        carried = np.where(inertial, frames.carried_along(radius, latitude, world.rate), 0.0)
        north, east, up = frames.velocity_components(speed, path, heading) - carried
        return north, east, up, np.sqrt(north**2 + east**2 + up**2), np.arctan2(up, np.hypot(north, east))

    def above_ground(radius, latitude):
        """Geodetic altitude [m] at a distance from the centre."""
        return frames.over_ellipsoid(radius, 1.0 / radius, np.sin(latitude) ** 2, world.polar_radius, world.e2)[0]

    radius = frames.radius_at_altitude(i.entry_altitude, i.entry_latitude, world.polar_radius, world.e2)
    radius = np.where(i.entry_radius > 0.0, i.entry_radius, radius)
    altitude = np.where(i.entry_radius > 0.0, above_ground(radius, i.entry_latitude), i.entry_altitude)
    in_frame, path_in_frame = _arrival(i, settings, world, radius, refusals)
    latitude, longitude = i.entry_latitude, i.entry_longitude
    north, east, _, speed, path = over_ground(in_frame, path_in_frame, i.entry_heading, radius, latitude)
    heading = np.where(np.hypot(north, east) > 0.0, np.arctan2(east, north), i.entry_heading)
    cosine, sine = np.cos(heading), np.sin(heading)
    to_north, to_east, place = frames.local_axes(latitude, longitude)
    ahead = cosine * to_north + sine * to_east
    right = np.cross(ahead, place, axis=0)
    planned = Planned(
        place=place, ahead=ahead, right=right, altitude=altitude, r=radius, latitude=latitude, speed=speed, path=path,
        heading=heading,
    )  # fmt: skip
    # the same with its errors
    latitude, longitude = latitude + i.entry_latitude_error, longitude + i.entry_longitude_error
    radius = radius + i.entry_altitude_error
    in_frame, path_in_frame = in_frame + i.entry_speed_error, path_in_frame + i.entry_flight_path_angle_error
    heading_in_frame = i.entry_heading + i.entry_heading_error
    north, east, up, speed, path = over_ground(in_frame, path_in_frame, heading_in_frame, radius, latitude)
    to_north, to_east, place = frames.local_axes(latitude, longitude)
    flat, zero = settings.shape == CHOICES.shape.flat, np.zeros_like(radius)
    flat_ahead, flat_right = frames.turned(north, east, cosine, sine)
    # minus zero would fly to other bits than zero does
    position = np.where(flat, [zero, zero, radius - world.polar_radius], radius * place) + 0.0
    velocity = np.where(flat, [flat_ahead, -flat_right, up], north * to_north + east * to_east + up * place) + 0.0
    return Entry(position, velocity, above_ground(radius, latitude), speed, path, planned)


def _arrival(i: SimpleNamespace, settings: SimpleNamespace, world: World, radius: np.ndarray, refusals: Refusals):
    """(speed, flight-path angle) of the planned entry in the frame speed_frame: those given, or of a hyperbola.

    Speed [m/s], angle [rad]; derived here from the conservation of energy and angular momentum, which are those of the
    excess speed and of the vacuum periapsis.  That lies below the radius, or the case joins `refusals`.
    """
    comes = settings.arrival == CHOICES.arrival.hyperbola
    periapsis = world.radius + i.vacuum_periapsis
    speed = np.sqrt(i.excess_speed**2 + 2.0 * world.mu / radius)
    cosine = periapsis * np.sqrt(i.excess_speed**2 + 2.0 * world.mu / periapsis) / (radius * speed)
    refusals.add(comes & ~(np.abs(cosine) <= 1.0), "the vacuum periapsis lies above the entry altitude")
    path = -np.arccos(np.clip(cosine, -1.0, 1.0))
    return np.where(comes, speed, i.entry_speed), np.where(comes, path, i.entry_flight_path_angle)
