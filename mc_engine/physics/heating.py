"""Convective heat flux at the stagnation point of a blunt nose, in W/m^2.

Cold wall, continuum flow.  Above about 11 km/s at Earth radiation is no longer small and must be added.
The `coefficient` of each correlation contains everything that is constant during a flight.
"""

from mc_engine.lanes import physics, pow, sqrt

# K. Sutton, R. A. Graves, NASA TR R-376 (1971), in SI: kg^0.5 / m
SUTTON_GRAVES = {"earth": 1.7415e-4, "mars": 1.9027e-4, "venus": 1.9027e-4}
DKR_EXPONENT = 3.15


@physics
def sutton_graves(density, speed, coefficient):
    """Heat flux [W/m^2]: q = k sqrt(rho / R_n) V^3 with coefficient = k / sqrt(R_n); NASA TR R-376 (1971)."""
    return coefficient * sqrt(density) * (speed * speed * speed)


@physics
def detra_kemp_riddell(density, speed, coefficient):
    """Heat flux [W/m^2]: coefficient sqrt(rho) V^3.15; Detra, Kemp, Riddell, Jet Propulsion 27 (1957) 1256-1257."""
    return coefficient * sqrt(density) * pow(speed, DKR_EXPONENT)


def detra_kemp_riddell_coefficient(nose_radius):
    """Coefficient for a nose radius [m] at Earth: 17 600 Btu/(ft^2 s) for 1 ft, sea-level density and 26 000 ft/s."""
    return 1.1035e8 / (1.225**0.5 * 7924.8**DKR_EXPONENT) / nose_radius**0.5
