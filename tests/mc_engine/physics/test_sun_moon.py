"""Sun and Moon against theories other than those that make the tables, and their pull against plain differences."""

import erfa
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mc_engine.physics.sun_moon import (
    COLUMNS,
    SPACING,
    ephemeris,
    ephemeris_table,
    node_before,
    sidereal_angle,
    sun_and_moon,
    terrestrial_time,
    third_body,
)

EPOCHS = (58484.5, 58828.0, 59580.25)  # 2019-01-01 12:00, 2019-12-11, 2022-01-01 06:00 UTC
MEAN_OBLIQUITY = np.radians(23.43929111)


def angle(a, b):
    """Angle [rad] between two directions."""
    return np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)


def series(mjd_tt):
    """Sun and Moon [m] by the low-precision series of Montenbruck, Gill, Satellite Orbits, section 3.3.2.

    Mean equinox of date; good to 0.06 degrees (Sun, as printed there) and about 0.1 degrees (Moon).
    """
    t = (mjd_tt - 51544.5) / 36525.0
    m = np.radians(357.5256 + 35999.049 * t)
    sun = np.radians(282.9374 + 1.7195 * t) + m + np.radians((6892.0 * np.sin(m) + 72.0 * np.sin(2 * m)) / 3600.0)
    sun_r = (149.619 - 2.499 * np.cos(m) - 0.021 * np.cos(2 * m)) * 1e9
    l0 = np.radians(218.31617 + 481267.88088 * t)
    moon_m, f = np.radians(134.96292 + 477198.86753 * t), np.radians(93.27283 + 483202.01873 * t)
    d = np.radians(297.85027 + 445267.11135 * t)
    terms = (
        (22640, moon_m), (769, 2 * moon_m), (-4586, moon_m - 2 * d), (2370, 2 * d), (-668, m), (-412, 2 * f),
        (-212, 2 * moon_m - 2 * d), (-206, moon_m + m - 2 * d), (192, moon_m + 2 * d), (-165, m - 2 * d),
        (148, moon_m - m), (-125, d), (-110, moon_m + m), (-55, 2 * f - 2 * d),
    )  # fmt: skip
    lon = l0 + np.radians(sum(size * np.sin(x) for size, x in terms) / 3600.0)
    inner = f + lon - l0 + np.radians((412 * np.sin(2 * f) + 541 * np.sin(m)) / 3600.0)
    lat_terms = (
        (18520, inner), (-526, f - 2 * d), (44, moon_m + f - 2 * d), (-31, -moon_m + f - 2 * d),
        (-25, -2 * moon_m + f), (-23, m + f - 2 * d), (21, -moon_m + f), (11, -m + f - 2 * d),
    )  # fmt: skip
    lat = np.radians(sum(size * np.sin(x) for size, x in lat_terms) / 3600.0)
    moon_r = 1e3 * (
        385000 - 20905 * np.cos(moon_m) - 3699 * np.cos(2 * d - moon_m) - 2956 * np.cos(2 * d)
        - 570 * np.cos(2 * moon_m) + 246 * np.cos(2 * moon_m - 2 * d) - 205 * np.cos(m - 2 * d)
        - 171 * np.cos(moon_m + 2 * d) - 152 * np.cos(moon_m + m - 2 * d)
    )  # fmt: skip
    return equatorial(sun, 0.0, sun_r), equatorial(lon, lat, moon_r)


def equatorial(longitude, latitude, r):
    ecliptic = [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)]
    c, s = np.cos(MEAN_OBLIQUITY), np.sin(MEAN_OBLIQUITY)
    return r * np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ ecliptic


@pytest.mark.parametrize("epoch", EPOCHS)
def test_sun_and_moon_are_where_the_low_precision_series_have_them(epoch):
    tt = float(terrestrial_time(epoch))
    (sun, moon), tenth_of_a_degree = sun_and_moon(tt)[0][0], np.radians(0.1)
    for body, other in zip((sun, moon), series(tt), strict=True):
        assert angle(body, other) < tenth_of_a_degree
        assert np.linalg.norm(body) == pytest.approx(np.linalg.norm(other), rel=1e-3)


@pytest.mark.parametrize("epoch", [EPOCHS[1], *(pytest.param(epoch, marks=pytest.mark.slow) for epoch in EPOCHS[::2])])
def test_the_full_theories_of_another_library_agree_to_arc_seconds(epoch):
    """VSOP2013 and ELP2000 of heyoka; both in the ecliptic or equator of J2000, turned by precession alone."""
    heyoka = pytest.importorskip("heyoka")
    tt = float(terrestrial_time(epoch))
    sun, moon = sun_and_moon(tt)[0][0]
    turn = erfa.pmat06(2_400_000.5, tt)
    time = heyoka.make_vars("t")
    centuries = (tt - 51544.5) / 36525.0
    elp = heyoka.cfunc(heyoka.model.elp2000_cartesian_fk5(time_expr=time, thresh=1e-7), [time])
    arc_second = np.radians(1.0 / 3600.0)
    assert angle(turn @ elp(np.array([centuries])), moon) < 12.0 * arc_second
    vsop = heyoka.cfunc(heyoka.model.vsop2013_cartesian_icrf(3, time_expr=time, thresh=1e-8)[:3], [time])
    barycentre = -turn @ vsop(np.array([centuries / 10.0])) * 149_597_870_700.0
    # that theory has the barycentre of Earth and Moon
    assert angle(barycentre + moon / 82.3, sun) < 3.0 * arc_second


def test_the_values_of_the_source_digest():
    """2019-01-01 12:00 UTC: sidereal time to a thousandth of a degree, Sun and Moon to a tenth."""
    assert np.degrees(sidereal_angle(58484.5)) == pytest.approx(280.8534, abs=1e-3)
    sun, moon = sun_and_moon(terrestrial_time(58484.5))[0][0]
    assert np.degrees(angle(sun, np.array([2.750, -13.259, -5.748]))) < 0.1
    assert np.degrees(angle(moon, np.array([-2.5508, -2.8094, -0.8567]))) < 0.1
    assert np.linalg.norm(moon) == pytest.approx(1e8 * np.hypot(np.hypot(2.5508, 2.8094), 0.8567), rel=1e-3)


@pytest.mark.parametrize("epoch", [33_300.0, 65_000.0])
def test_dates_before_utc_and_years_ahead_are_no_cause_for_warnings(epoch):
    """Warnings are errors in tests; the leap seconds of 2017 are the last that are known."""
    assert 0.0 < 86_400.0 * (float(terrestrial_time(epoch)) - epoch) < 69.2
    assert 0.0 <= float(sidereal_angle(epoch)) < 2.0 * np.pi


def test_a_date_beyond_the_calendar_is_refused():
    with pytest.raises(ValueError, match="no modified Julian date"):
        terrestrial_time(np.array([51544.0, -2.5e6]))


@pytest.mark.parametrize("epoch", EPOCHS)
def test_sidereal_time_is_that_of_the_older_series_and_turns_once_in_a_sidereal_day(epoch):
    assert sidereal_angle(epoch) == pytest.approx(erfa.gmst82(2_400_000.5, epoch), abs=np.radians(0.2 / 3600.0))
    later = sidereal_angle(epoch + 86_164.0905 / 86_400.0)
    assert np.angle(np.exp(1j * (later - sidereal_angle(epoch)))) == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("epoch", EPOCHS)
def test_the_table_gives_the_moon_to_fifty_metres_and_the_sun_to_two_kilometres_between_its_nodes(epoch):
    number, time = node_before(np.array([epoch]))
    table = ephemeris_table(int(number[0]), int(number[0]) + 40).ravel()
    tt = terrestrial_time(epoch)
    for days in np.linspace(0.0, 9.5, 77):
        found = np.array(ephemeris(time[0] + 86_400.0 * days, table, 0.0))
        sun, moon = sun_and_moon(tt + days)[0][0]
        assert np.linalg.norm(found[:3] - sun) < 2e3
        assert np.linalg.norm(found[3:] - moon) < 50.0


def test_a_date_reads_the_same_nodes_in_whatever_table_it_stands():
    number, _ = node_before(np.array([58484.5]))
    first = int(number[0])
    long = ephemeris_table(first - 3, first + 5)
    assert (long[3:] == ephemeris_table(first, first + 5)).all()
    assert long.shape == (9, COLUMNS)
    assert first * SPACING == pytest.approx(float(terrestrial_time(58484.5)), abs=SPACING)


@settings(max_examples=50, deadline=None)
@given(place=st.tuples(*[st.floats(1.0, 5e7)] * 3), body=st.tuples(*[st.floats(2e8, 1.5e11)] * 3))
def test_the_pull_of_a_third_body_is_the_difference_of_two_pulls(place, body):
    from mpmath import mp, mpf

    mp.dps = 40
    r, b = [mpf(x) for x in place], [mpf(x) for x in body]
    d3 = mp.sqrt(sum((x - y) ** 2 for x, y in zip(b, r, strict=True))) ** 3
    b3 = mp.sqrt(sum(x * x for x in b)) ** 3
    exact = [float(mpf(1e16) * ((y - x) / d3 - y / b3)) for x, y in zip(r, b, strict=True)]
    size = max(abs(x) for x in exact)
    assert third_body(*place, *body, 1e16) == pytest.approx(exact, rel=0.0, abs=1e-14 * size + 1e-300)
