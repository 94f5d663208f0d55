"""Tables of a model: numbers that all cases of the same settings share, looked up in lanes."""

import numpy as np
import pytest
from flown_models import FOLDER, flown

from mc_engine.flight.flight import settings_of
from mc_engine.lanes import look_up
from mc_engine.model import load_model

SHELF = load_model("shelf.py", FOLDER)
PLACES = np.array([0.0, 7.0, 49.0, 3.0, 3.0, 20.0, 1.0, 48.0, 11.0, 30.0])
WIDTHS = [1, 8, pytest.param(16, marks=pytest.mark.slow)]


@pytest.mark.parametrize("width", WIDTHS)
def test_every_lane_finds_the_number_of_its_own_place(width):
    columns = flown(SHELF, place=PLACES, width=width)
    assert columns["end_x_m"].tolist() == pytest.approx((PLACES**2).tolist(), rel=1e-14)
    assert set(columns["first"]) == {1.0}
    assert set(columns["last"]) == {49.0**2}


def test_cases_of_other_settings_have_other_tables():
    scales = np.array([1.0, 2.0, 1.0, 3.0, 2.0, 1.0, 1.0, 2.0, 3.0, 1.0])
    columns = flown(SHELF, place=PLACES, scale=scales)
    assert columns["end_x_m"] == pytest.approx(scales * PLACES**2, rel=1e-14)
    assert columns["last"].tolist() == (scales * 49.0**2).tolist()


@pytest.mark.parametrize("width", WIDTHS)
def test_a_place_outside_is_the_nearest_one_inside_and_what_is_no_number_breaks_the_flight(width):
    columns = flown(SHELF, place=np.array([-5.0, 1e9, np.pi, -200.0, 1e300]), width=width)
    assert columns["end_x_m"].tolist() == pytest.approx([0.0, 2401.0, 9.0, 0.0, 2401.0])
    assert columns["status"].tolist() == ["ok", "ok", "ok", "not-finite", "ok"]


def test_interpreted_physics_reads_the_same_numbers():
    tables = settings_of(SHELF, np.array([2.0, 0.5])).tables
    assert look_up(tables, 7.0) == 98.0
    assert [look_up(tables, place) for place in (-1.0, np.inf, -np.inf, 7)] == [0.0, 4802.0, 0.0, 98.0]
    assert np.isnan(look_up(tables, np.nan))
    assert look_up(tables, np.array([0.0, 3.0])).tolist() == [0.0, 18.0]
    np.testing.assert_array_equal(look_up(tables, np.array([-1.0, np.nan, np.inf])), [0.0, np.nan, 4802.0])
