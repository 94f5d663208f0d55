"""Records in physics: some fields replaced, one of two chosen, records inside records, all with the same bits."""

from typing import NamedTuple

import numpy as np
import pytest
from compiled_physics import by_every_width
from flown_models import FOLDER, flown, same_bytes

from mc_engine.errors import ModelError
from mc_engine.lanes import merged, physics, replace, where
from mc_engine.model import load_model


class Pair(NamedTuple):
    a: float = 2.0
    b: float = 3.0


class Both(NamedTuple):
    pair: Pair = Pair()
    c: float = -1.0


class Single(NamedTuple):
    a: float = 1.0


@physics
def replaced(x, y):
    both = replace(Both(c=x), pair=replace(Pair(a=y), b=x * y))
    return both.pair.a, both.pair.b, both.c, replace(Both(), c=0.5).pair.b + 0.0 * x


@physics
def chosen(x, y):
    both = where(x > y, Both(pair=Pair(a=x), c=1.0), Both(pair=Pair(b=y)))
    plain = where(x > y, Pair(a=1.0), Pair())
    return both.pair.a, both.pair.b, both.c, plain.a


@physics
def made_of_others(x, y):
    both = merged(Both, Single(a=x), pair=Pair(a=y), c=-x)
    again = merged(Pair, Single(a=y), both, b=both.c)
    return both.pair.a, both.c, again.a, merged(Pair, again, b=1.0).b + 0.0 * x


@pytest.mark.parametrize("function", [replaced, chosen, made_of_others])
def test_kernels_of_every_width_make_records_as_python_does(function):
    x, y = np.random.default_rng(1).normal(size=(2, 50))
    x[3] = np.nan
    expected = [np.broadcast_to(value, x.shape) for value in function(x, y)]
    np.testing.assert_array_equal(by_every_width(function, 4, x, y), expected)
    np.testing.assert_array_equal([function(*pair) for pair in zip(x, y, strict=True)], np.transpose(expected))


@physics
def looped(x, y):
    total = 0.0
    for v in (1.0, x, y):
        total = total + v
    for u, v in ((x, 2), (1.0, y)):
        total = total * v - u
    for i, (u, v) in enumerate(zip((1, x), (y, x))):  # noqa: B905 -- kernels know no `strict`
        total = total + i * u * v
    return total, total


@physics
def looked_up(x, y):
    total, pair, mixed = 0.0, Pair(a=x), (2, y, 3.0)
    for i in range(2):
        total = total + pair[i] * mixed[i + 1] - mixed[i]
    for is_true in (x > 0.0, pair.b > 2.5):
        total = where(is_true, total, -total)
    return total, total


@pytest.mark.parametrize("function", [looped, looked_up])
def test_a_loop_over_plain_numbers_and_lanes_is_one_over_numbers(function):
    x, y = np.random.default_rng(1).normal(size=(2, 50))
    expected = function(x, y)
    np.testing.assert_array_equal(by_every_width(function, 2, x, y), expected)


def test_a_field_that_the_record_has_not_is_refused():
    with pytest.raises(ModelError, match=r'Pair\(...\) has no field "bb"; did you mean "b"?'):
        replace(Pair(), bb=1.0)


@pytest.mark.parametrize(
    ("records", "fields", "sentence"),
    [
        ((Single(),), {}, 'merged(Pair, ...): no record has the field "b"; give it by name'),
        ((Single(), Pair()), {}, 'merged(Pair, ...): 2 records have the field "a"; give it by name'),
        ((Pair(),), {"aa": 1.0}, 'Pair(...) has no field "aa"; did you mean "a"?'),
    ],
)
def test_a_field_that_is_not_in_exactly_one_record_is_refused(records, fields, sentence):
    with pytest.raises(ModelError) as error:
        merged(Pair, *records, **fields)
    assert str(error.value) == sentence


@pytest.mark.parametrize("other", [1.0, Both(), (2.0, 3.0)])
def test_records_of_two_classes_are_no_choice(other):
    for pair in ((Pair(), other), (other, Pair())):
        with pytest.raises(ModelError, match="named tuples of one class"):
            where(True, *pair)


@pytest.fixture(
    scope="module", params=["FixedStep(0.1, 2.0, control_every=5)", "AdaptiveStep(2.0, control_period=0.5)"]
)
def text(request):
    """The model with each kind of clock."""
    text = (FOLDER / "kept_records.py").read_text().replace("FixedStep(0.1, 2.0, control_every=5)", request.param)
    return text.replace("Event, FixedStep", "AdaptiveStep, Event, FixedStep")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(
            "FixedStep(0.1, 2.0, control_every=5)", marks=pytest.mark.slow
        ),  # as in model/test_declarations.py
        "AdaptiveStep(2.0, control_period=0.5)",
    ],
    indirect=True,
)
def test_a_discrete_state_may_hold_records(text, tmp_path):
    (tmp_path / "kept.py").write_text(text)
    model, lifts = load_model("kept.py", tmp_path), np.array([0.0, 3.0, 20.0])
    alone, lanes = (flown(model, width, lift_m_s2=lifts) for width in (1, 8))
    assert set(alone["status"]) == {"ok"}
    same_bytes(alone, lanes)
    fall = np.sqrt(2.0 * 10.0 / 9.0)  # s; the sample at 1 s is below 5 m only with the smaller lifts
    assert lanes["bounce_s"][0] == pytest.approx(fall, rel=1e-2)
    assert np.isnan(lanes["bounce_s"][2])
    assert lanes["sampled_m"][2] == pytest.approx(10.0 + 0.5 * 11.0 * lanes["last_s"][2] ** 2)
    assert lanes["last_s"] - lanes["earlier_s"] == pytest.approx(0.5)
    assert lanes["braked_m_s2"][2] == 0.0 != lanes["braked_m_s2"][0]


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (("last=Sample(height=s.x, time=t))", "last=s.x)"), "`control` gives "),
        (("return where(", "return replace(m, last=Sample(s.x > 0.0))\n    where("), 'a truth value for "height"'),
        (("brake=-0.1 * s.v", "brakes=-0.1 * s.v"), 'Memory(...) has no field "brakes"; did you mean "brake"?'),
        (("State(x=10.0, v=0.0)", "State(x=Sample(), v=0.0)"), "`initial` gives "),
    ],
)
def test_a_record_where_none_belongs_or_of_no_numbers_is_named(text, edit, sentence, tmp_path):
    (tmp_path / "kept.py").write_text(text.replace(*edit))
    with pytest.raises(ModelError) as error:
        flown(load_model("kept.py", tmp_path))
    assert sentence in str(error.value)
