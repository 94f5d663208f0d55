"""One quantity of the flights against another, with bands."""

import json

import numpy as np
import pandas as pd
import pytest
from figure_marks import FORMS, marks_of
from landing_run import descents, landing_run

from reports.contents import build
from reports.document.blocks import FigureBlock
from reports.drawing import paper, screen
from reports.drawing.marks import Band, Line
from reports.figures.histories import thinned
from reports.sections.profiles import first_descent, profile_bands


def profile(document):
    section = next(one for one in document.sections if one.anchor == "histories")
    return next(b for b in section.blocks if isinstance(b, FigureBlock) and b.drawing.form == FORMS["profile"])


def test_the_first_way_down_to_a_level_counts():
    y = np.array([100.0, 60.0, 80.0, 20.0])
    x = np.array([0.0, 4.0, 6.0, 12.0])
    levels = np.array([10.0, 20.0, 50.0, 60.0, 70.0, 100.0, 110.0])
    found = first_descent(x, y, levels)
    # 50 lies halfway down the last leg, after the climb; 70 is met before it
    assert found == pytest.approx([np.nan, 12.0, 9.0, 4.0, 3.0, 0.0, np.nan], nan_ok=True)


def test_a_flight_of_one_row_or_of_none_meets_no_level():
    levels = np.array([0.0, 1.0])
    assert np.isnan(first_descent(np.array([1.0]), np.array([1.0]), levels)).all()
    assert np.isnan(first_descent(np.array([np.nan, 1.0]), np.array([np.nan, np.nan]), levels)).all()


def test_the_band_is_the_quantile_of_the_speeds_at_each_altitude():
    (band,) = profile_bands(descents(41), list(range(41)), "speed_m_s", "altitude_km")
    place = int(np.argmin(np.abs(band.at - 90.0)))
    share = 1.0 - 0.9 * 0.4 * (120.0 - band.at[place]) / 60.0
    speeds = (7000.0 + 10.0 * np.arange(41)) * share
    for probability, curve in band.curves.items():
        assert curve[place] == pytest.approx(np.quantile(speeds, probability), rel=1e-9)


def test_the_report_says_how_many_flights_and_how_skips_are_counted():
    block = profile(build(landing_run(60), "run"))
    assert "over the first 25 saved cases" in block.caption
    assert "the first way down to a level counts" in block.caption
    assert any("25 saved cases" in mark.key for mark in block.drawing.key)
    json.dumps(screen.specifications(block.drawing), allow_nan=False)
    assert "<svg" in paper.svg(block.drawing)


def flights(n, path):
    """Histories of n flights: x, y = path(s, case), s from 0 to 1."""
    s = np.linspace(0.0, 1.0, 200)
    frames = []
    for case in range(n):
        x, y = path(s, case)
        frames.append(pd.DataFrame({"case_id": case, "t_s": 100.0 * s, "x_m": x, "y_m": y}))
    return pd.concat(frames, ignore_index=True)


def test_flights_that_climb_first_have_bands_of_the_way_up_and_of_the_way_down():
    """y = 4 s (1 - s) h, x = (1 + case / 100) s: at half the height of the lowest, s = (1 ± sqrt(1 - y / h)) / 2."""
    found = profile_bands(
        flights(31, lambda s, k: ((1.0 + 0.01 * k) * s, 4.0 * s * (1.0 - s))), range(31), "x_m", "y_m"
    )
    assert [band.rising for band in found] == [True, False]
    for band, sign in zip(found, (-1.0, 1.0), strict=True):
        place = int(np.argmin(np.abs(band.at - 0.5)))
        s = 0.5 * (1.0 + sign * np.sqrt(1.0 - band.at[place]))
        assert band.curves[0.5][place] == pytest.approx(1.15 * s, rel=1e-3)
        assert band.curves[0.95][place] == pytest.approx(np.quantile(1.0 + 0.01 * np.arange(31), 0.95) * s, rel=1e-3)


def test_an_ascent_has_a_band_of_the_way_up_alone():
    (band,) = profile_bands(flights(31, lambda s, k: (s + k, s**2)), range(31), "x_m", "y_m")
    assert band.rising
    assert band.curves[0.5] == pytest.approx(15.0 + np.sqrt(band.at), abs=0.02)


def test_percentiles_end_where_too_few_flights_come_to_a_level():
    """Flights that end at heights from 1 to 2: the band of 2.5 % to 97.5 % went on where only 20 of 60 still climb."""
    (band,) = profile_bands(flights(60, lambda s, k: (s + k, s * (1.0 + k / 59.0))), range(60), "x_m", "y_m")
    climbing = np.count_nonzero(1.0 + np.arange(60)[:, None] / 59.0 >= band.at - 1e-9, axis=0)
    assert sorted(band.curves) == [0.0, 0.025, 0.5, 0.975, 1.0]
    assert (
        np.isfinite(band.curves[0.025]).tolist()
        == np.isfinite(band.curves[0.975]).tolist()
        == (climbing >= 40).tolist()
    )
    assert np.isfinite([band.curves[p] for p in (0.0, 0.5, 1.0)]).all()
    assert climbing.min() == 20


def test_percentiles_that_no_level_supports_are_not_in_the_key():
    """All of 60 flights have a stretch of the heights of their own, which at most 30 share."""
    (band,) = profile_bands(flights(60, lambda s, k: (s + k, s + k / 30.0)), range(60), "x_m", "y_m")
    assert [words.key.split(" of ")[0] for words in band.bands(upright=True)] == ["smallest to largest"]


@pytest.mark.parametrize("turns", [1, 4])
def test_closed_curves_have_no_band(turns):
    def path(s, case):
        return (1.0 + case / 10) * np.cos(2 * np.pi * turns * s), (2.0 + case / 10) * np.sin(2 * np.pi * turns * s)

    found = profile_bands(flights(31, path), range(31), "x_m", "y_m")
    assert isinstance(found, str)
    assert "closed or oscillate" in found


def test_too_few_flights_have_lines_and_no_band():
    block = profile(build(landing_run(60, flights=5), "run"))
    assert not marks_of(block.drawing, Band)
    assert "Bands need 20 saved cases" in block.caption
    assert len(marks_of(block.drawing, Line)) == 6


def test_histories_without_the_quantity_or_without_numbers_are_said():
    for change in (lambda h: h.drop(columns="altitude_km"), lambda h: h.assign(altitude_km=np.nan)):
        run = landing_run(60)
        run.history = change(run.history)
        assert "Altitude against speed: not drawn;" in repr(build(run, "run").sections)


def test_thinning_goes_by_the_length_of_the_curve():
    t = np.r_[np.linspace(0.0, 1.0, 50), np.full(5000, 1.0)]  # fast at first, then at rest
    x, y = thinned(t, 2.0 * t, by_length=True)
    assert x.size <= 400
    assert np.diff(x).max() < 0.03
    assert (x[0], x[-1], y[-1]) == (0.0, 1.0, 2.0)
