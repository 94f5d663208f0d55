"""Constants of the Earth, of the Solar System and of measurement.  SI."""

# Gravitational parameter [m^3/s^2], equatorial radius [m] and second zonal harmonic: EGM96
# (Lemoine et al., NASA/TP-1998-206861); mu as in IERS Conventions (2010), table 1.1.
MU_EARTH = 3.986004418e14
EQUATORIAL_RADIUS = 6378136.3
J2_EARTH = 1.08262668e-3

# Astronomical unit [m]: IAU 2012 resolution B2.
AU = 149_597_870_700.0

# Rotation rate of the Earth [rad/s]: IERS Conventions (2010), table 1.2.
EARTH_RATE = 7.292115e-5

# Standard acceleration of free fall [m/s^2]: 3rd CGPM (1901).
STANDARD_GRAVITY = 9.80665
