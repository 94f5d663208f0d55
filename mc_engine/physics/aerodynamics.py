"""Lift and axial force of a vehicle at its trim angle of attack.

Coefficients that go by the Mach number are curves, see `mc_engine.physics.curves`.
"""

from mc_engine.lanes import maximum, physics, sqrt, where

FADING = 0.01  # rad from the vertical


@physics
def lift_direction(vx, vy, vz, ux, uy, uz, speed, cos_bank, sin_bank):
    """Unit vector of the lift, across the velocity v.

    u : unit vector up;  speed : length of v.  At bank 0 the lift is in the vertical plane and points up, at 90 degrees
    it is level and points to the right of the flight.  In vertical flight that has no meaning: within 0.01 rad of the
    vertical the vector becomes shorter, down to nothing.
    """
    rx, ry, rz = vy * uz - vz * uy, vz * ux - vx * uz, vx * uy - vy * ux  # to the right, as long as the level speed
    level = maximum(sqrt(rx * rx + ry * ry + rz * rz), FADING * speed)
    still = speed <= 0.0
    side = sin_bank / where(still, 1.0, level)
    ahead = cos_bank / where(still, 1.0, level * speed)
    return (
        ahead * (ry * vz - rz * vy) + side * rx,
        ahead * (rz * vx - rx * vz) + side * ry,
        ahead * (rx * vy - ry * vx) + side * rz,
    )


@physics
def axial_coefficient(drag_coefficient, lift_coefficient, cos_trim, sin_trim):
    """Force coefficient along the body axis at the trim angle of attack: C_D cos + C_L sin."""
    return drag_coefficient * cos_trim + lift_coefficient * sin_trim
