"""Records in tables, and records in the discrete state."""

from collections import namedtuple

import numpy as np
import pytest
from flown_models import FOLDER, flown, same_bytes

from mc_engine.errors import ModelError
from mc_engine.flight.flight import fly, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.lanes import look_up, look_up_record
from mc_engine.model import load_model

DELAYS = np.array([0.0, 0.25, 1.0, 3.5, 7.75, 0.1])


@pytest.fixture(
    scope="module", params=["FixedStep(0.5, 10.0)", pytest.param("AdaptiveStep(10.0)", marks=pytest.mark.slow)]
)
def model(request, tmp_path_factory):
    """The legs with each kind of clock."""
    folder = tmp_path_factory.mktemp("legs")
    text = (FOLDER / "legs.py").read_text().replace("FixedStep(0.5, 10.0)", request.param)
    (folder / "legs.py").write_text(text.replace("Event, FixedStep", "AdaptiveStep, Event, FixedStep"))
    return load_model("legs.py", folder)


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_each_case_flies_the_legs_of_the_table_at_its_own_times(model, scale):
    first = np.minimum(2.0 * scale + DELAYS, 10.0)
    second = np.clip(10.0 - first, 0.0, scale)
    third = 10.0 - first - second
    columns = flown(model, 8, delay_s=DELAYS, scale=scale)
    assert set(columns["status"]) == {"ok"}
    np.testing.assert_allclose(
        columns["last_x_m"], scale * (first - 3.0 * second + 0.5 * third), rtol=1e-12, atol=1e-12
    )
    np.testing.assert_array_equal(columns["legs_flown_m"], (second > 0.0) * 1.0 + (third > 0.0))


def test_a_case_has_the_same_bits_alone_in_lanes_and_interpreted(model):
    alone, lanes = (flown(model, width, delay_s=DELAYS) for width in (1, 8))
    same_bytes(alone, lanes)
    _, _, _, metrics = fly_interpreted(InterpretedFlight(model), {"delay_s": DELAYS[1], "scale": 1.0}, 1, 1)
    assert [row[0] for row in metrics] == [alone[metric.name][1] for metric in model.metrics]


def test_a_record_in_a_table_is_its_numbers_one_by_one():
    tables, pair = np.arange(20.0) ** 2, namedtuple("Pair", "first second")
    for place in (0, 3.0, np.array([1.0, 18.0])):
        found = look_up_record(tables, place, pair)
        np.testing.assert_array_equal(found.first, look_up(tables, place))
        np.testing.assert_array_equal(found.second, look_up(tables, place + 1))


@pytest.mark.parametrize(
    ("written", "sentence"),
    [
        ("leg=1.0", "`switch` gives float; it must give the named tuple of `start`, Leg(speed, duration)"),
        ("leg=State(x=1.0)", "`switch` gives State(x); it must give the named tuple of `start`, Leg(speed, duration)"),
        ('leg=Leg(speed="fast", duration=1.0)', "`switch` gives 'fast' for \"speed\"; it must give one number"),
    ],
)
def test_another_record_in_the_discrete_state_is_named(tmp_path, written, sentence):
    text = (FOLDER / "legs.py").read_text()
    (tmp_path / "legs.py").write_text(text.replace("leg=Leg(speed=leg.speed, duration=leg.duration)", written))
    with pytest.raises(ModelError) as error:
        fly(load_model("legs.py", tmp_path), {"delay_s": 0.0, "scale": 1.0}, np.arange(2), 1)
    assert sentence in str(error.value)
