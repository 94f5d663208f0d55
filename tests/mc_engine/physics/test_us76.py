"""The 1976 standard atmosphere and the exponential ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.physics.air import us76_air
from mc_engine.physics.atmosphere import EXPONENTIALS, US76_TOP, exponential, us76, us76_logarithm

# NOAA-S/T 76-1562: geometric altitude [m], density [kg/m^3]; the standard's own digits, hence 1e-4
BELOW_86_KM = [(0.0, 1.2250), (30e3, 1.84102e-2), (50e3, 1.0269e-3), (71.5e3, 6.7036e-5), (80e3, 1.8458e-5)]
BELOW_86_KM += [(86e3, 6.9578e-6)]
ALOFT = [
    (90e3, 3.416e-6),
    (100e3, 5.604e-7),
    (110e3, 9.708e-8),
    (120e3, 2.222e-8),
    (150e3, 2.076e-9),
    (200e3, 2.541e-10),
]
# table I between and beyond the altitudes that the densities go through
BETWEEN = [(140e3, 3.831e-9, 1.08), (160e3, 1.233e-9, 1.15), (170e3, 7.815e-10, 1.15), (180e3, 5.194e-10, 1.15)]
BETWEEN += [(300e3, 1.916e-11, 0.20), (400e3, 2.803e-12, 0.021)]
# geopotential bases of the layers, as geometric altitudes [m]
BASES = [6_356_766.0 * b / (6_356_766.0 - b) for b in (11e3, 20e3, 32e3, 47e3, 51e3, 71e3)]


@pytest.mark.parametrize(("h", "density"), BELOW_86_KM)
def test_density_is_the_printed_one_to_86_km(h, density):
    assert us76(h) == pytest.approx(density, rel=1e-4)


@pytest.mark.parametrize(("h", "density"), ALOFT)
def test_density_goes_through_the_table_above(h, density):
    assert us76(h) == pytest.approx(density, rel=1e-12)


@pytest.mark.parametrize(("h", "density", "ratio"), BETWEEN)
def test_density_between_and_beyond_the_table_is_off_by_what_the_docstring_says(h, density, ratio):
    """Straight lines of the logarithm miss its bend: too dense between the points, too thin beyond the last."""
    assert us76(h) / density == pytest.approx(ratio, rel=0.06)


# table I of the standard: geometric altitude [m], molecular-scale temperature [K]
@pytest.mark.parametrize(
    ("h", "kelvin"), [(0.0, 288.150), (20e3, 216.650), (50e3, 270.650), (80e3, 198.639), (86e3, 186.946)]
)
def test_temperature_is_the_printed_one(h, kelvin):
    assert us76_logarithm(h)[2] == pytest.approx(kelvin, abs=0.0006)


@pytest.mark.parametrize("h", [*BASES, US76_TOP, 90e3, 115e3, 150e3])
def test_density_has_no_step_where_layers_meet(h):
    assert us76(h * (1.0 - 1e-12)) == pytest.approx(us76(h * (1.0 + 1e-12)), rel=1e-9)


@given(h=st.floats(0.0, 190e3))
def test_the_slope_is_the_derivative_of_the_logarithm(h):
    near = [
        abs(h - corner) for corner in (*BASES, US76_TOP, 90e3, 95e3, 100e3, 105e3, 110e3, 115e3, 120e3, 130e3, 150e3)
    ]
    if min(near) > 2.0:
        chord = (us76_logarithm(h + 1.0)[0] - us76_logarithm(h - 1.0)[0]) / 2.0
        assert us76_logarithm(h)[1] == pytest.approx(chord, rel=1e-6)


@pytest.mark.parametrize(("planet", "scale"), [("earth", 7200.0), ("mars", 11_100.0), ("venus", 15_900.0)])
def test_an_exponential_atmosphere_thins_e_fold_over_its_scale_height(planet, scale):
    ground, height = EXPONENTIALS[planet]
    assert height == scale
    assert exponential(scale, ground, 0.0, height) == pytest.approx(ground / np.e, rel=1e-14)


@pytest.mark.parametrize("h", [8e6, 36e6, 400e6])
def test_products_of_the_thinnest_air_keep_all_their_bits(h):
    # with fewer bits, below 2.2e-308, an instruction takes Intel's processors fifty times as long
    for density in (exponential(h, 7.248e-11, 250e3, 45_546.0), us76(h), us76_air(h).pressure):
        assert 1e-290 < density < 1e-50
