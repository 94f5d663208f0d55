"""Curves and surfaces: the points, what lies between and outside, against SciPy; files and their mistakes."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from read_numbers import compiled, every_way
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator, interp1d

from mc_engine.errors import ModelError
from mc_engine.physics import curves
from mc_engine.physics.curve_points import si_factor
from mc_engine.physics.curves import curve, surface, wind_profile

RNG = np.random.default_rng(11)
N = 100_000
SPACINGS = {
    "even": np.linspace(-2.0, 7.0, 37),
    "uneven": np.sort(RNG.uniform(0.0, 10.0, 300)),
    "three decades in each other": np.sort(np.concatenate([np.geomspace(1e-6, 1e3, 60), [500.0, 500.0001, 500.00011]])),
    "two points": np.array([3.0, 4.0]),
}
NAMES = list(SPACINGS)
VALUES = {name: RNG.normal(size=x.size) * 1e5 for name, x in SPACINGS.items()}


def inside(x):
    """Random arguments, the points, and their neighbours among the floats."""
    near = np.concatenate([x, np.nextafter(x[1:], -np.inf), np.nextafter(x[:-1], np.inf)])
    return np.concatenate([RNG.uniform(x[0], x[-1], N), near])


def close(found, wanted, scale):
    assert np.abs(found - wanted).max() <= 1e-12 * scale


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", curves.KINDS)
def test_a_curve_is_scipys_and_meets_its_points(name, kind):
    x, y = SPACINGS[name], VALUES[name]
    f, at = curve(x=x, y=y, kind=kind), inside(x)
    theirs = PchipInterpolator(x, y) if kind == "cubic" else interp1d(x, y, kind=kind)
    close(every_way(f, at), theirs(at), np.abs(y).max())
    assert f(x).tolist() == y.tolist()
    assert compiled(f, x).tolist() == y.tolist()


def test_some_of_these_spacings_need_the_bisection_and_some_do_not():
    levels = {name: curve(x=x, y=VALUES[name]).block.numbers[4] for name, x in SPACINGS.items()}
    assert levels["even"] == levels["two points"] == 0.0
    assert levels["three decades in each other"] >= 2.0


@pytest.mark.parametrize("kind", ["linear", "nearest"])
@pytest.mark.parametrize("sizes", [(2, 2), (12, 8), (40, 300)])
def test_a_surface_is_scipys_and_meets_its_points(sizes, kind):
    x, y = (np.sort(RNG.uniform(-1.0, 1.0, size)) for size in sizes)
    z = RNG.normal(size=sizes)
    f = surface(x=x, y=y, z=z, kind=kind)
    at = RNG.uniform(x[0], x[-1], N), RNG.uniform(y[0], y[-1], N)
    close(every_way(f, *at), RegularGridInterpolator((x, y), z, kind)(np.transpose(at)), np.abs(z).max())
    assert f(*np.meshgrid(x, y, indexing="ij")).tolist() == z.tolist()


def test_a_surface_may_hold_the_value_of_each_point_up_to_the_next():
    x, y = (np.sort(RNG.uniform(-1.0, 1.0, size)) for size in (12, 40))
    z = RNG.normal(size=(12, 40))
    f = surface(x=x, y=y, z=z, kind="previous")
    at = RNG.uniform(x[0], x[-1], N), RNG.uniform(y[0], y[-1], N)
    i, j = (np.searchsorted(points, places, "right") - 1 for points, places in zip((x, y), at, strict=True))
    assert every_way(f, *at).tolist() == z[i, j].tolist()
    assert f(*np.meshgrid(x, y, indexing="ij")).tolist() == z.tolist()
    assert f(*np.meshgrid(np.nextafter(x[1:], -1.0), y, indexing="ij")).tolist() == z[:-1].tolist()


def test_a_cubic_surface_is_scipys_cubic_along_x_through_its_cubics_along_y():
    x, y = (np.sort(RNG.uniform(-1.0, 1.0, size)) for size in (9, 14))
    z = RNG.normal(size=(9, 14))
    f = surface(x=x, y=y, z=z, kind="cubic")
    at_x, at_y = RNG.uniform(x[0], x[-1], N), RNG.uniform(y[0], y[-1], N)
    values = PchipInterpolator(y, z, axis=1)(at_y)
    slopes = PchipInterpolator(y, PchipInterpolator(x, z).derivative()(x), axis=1)(at_y)
    i, k = np.searchsorted(x, at_x, "right") - 1, np.arange(N)
    ends = (
        np.stack([x[i], x[i + 1]]),
        np.stack([values[i, k], values[i + 1, k]]),
        np.stack([slopes[i, k], slopes[i + 1, k]]),
    )
    close(every_way(f, at_x, at_y), hermite(at_x, *ends), np.abs(z).max())
    assert f(*np.meshgrid(x, y, indexing="ij")).tolist() == z.tolist()
    for j in (0, 5, 13):  # along the lines of the grid it is the curve through their points
        close(f(at_x, np.full(N, y[j])), PchipInterpolator(x, z[:, j])(at_x), np.abs(z).max())


def hermite(x, ends, values, slopes):
    """Hermite's cubic between two ends, by its basis."""
    h = ends[1] - ends[0]
    t = (x - ends[0]) / h
    low = values[0] * (1 + 2 * t) * (1 - t) ** 2 + h * slopes[0] * t * (1 - t) ** 2
    return low + values[1] * t**2 * (3 - 2 * t) + h * slopes[1] * t**2 * (t - 1)


def test_a_cubic_surface_has_no_edge_between_its_cells():
    x, y, z = np.array([0.0, 1.0, 3.0, 3.5]), np.array([0.0, 2.0, 2.5, 4.0]), RNG.normal(size=(4, 4))
    f, d = surface(x=x, y=y, z=z, kind="cubic"), 1e-6
    for at in RNG.uniform(0.1, 3.4, 20):
        before, behind = [(f(1.0 + s * d, at) - f(1.0, at)) / (s * d) for s in (-1, 1)]
        left, right = [(f(at, 2.5 + s * d) - f(at, 2.5)) / (s * d) for s in (-1, 1)]
        assert abs(before - behind) < 1e-4
        assert abs(left - right) < 1e-4


@given(
    steps=st.lists(st.tuples(st.floats(1e-3, 1e3), st.floats(-1e3, 1e3)), min_size=1, max_size=20),
    rising=st.booleans(),
)
def test_a_cubic_curve_is_smooth_and_as_monotone_as_its_points(steps, rising):
    dx, dy = np.array(steps).T
    x, y = np.concatenate([[0.0], np.cumsum(dx)]), np.concatenate([[0.0], np.cumsum(np.abs(dy) if rising else dy)])
    f = curve(x=x, y=y, kind="cubic")
    for i in range(x.size - 1):
        values = f(np.linspace(x[i], x[i + 1], 50))
        slack = 1e-12 * (1.0 + np.abs(y).max())
        assert (np.sign(y[i + 1] - y[i]) * np.diff(values) >= -slack).all()
        assert values.min() >= min(y[i], y[i + 1]) - slack
        assert values.max() <= max(y[i], y[i + 1]) + slack
    rows = f.block.numbers[-4 * x.size :].reshape(-1, 4)
    h = np.diff(x)
    arriving = rows[:-1, 1] + 2.0 * rows[:-1, 2] * h + 3.0 * rows[:-1, 3] * h * h
    least = np.finfo(float).tiny  # below the least normal number a rounding is not small beside what is rounded
    np.testing.assert_allclose(arriving[:-1], rows[1:-1, 1], rtol=1e-9, atol=1e-9 * np.abs(dy / dx).max() + least)


BEYOND = np.array([-1e300, -0.1, -5e-324, 0.0, 1.0, 2.0, np.nextafter(2.0, 3.0), 9.0, np.inf, -np.inf])


@pytest.mark.parametrize("kind", curves.KINDS)
def test_outside_a_curve_is_held_is_zero_or_ends_the_case(kind):
    x, y = [0.0, 1.0, 2.0], [3.0, 4.0, 7.0]
    is_outside = np.array([True, True, True, False, False, False, True, True, True, True])
    held = every_way(curve(x=x, y=y, kind=kind), BEYOND)
    assert held.tolist() == [3.0, 3.0, 3.0, 3.0, 4.0, 7.0, 7.0, 7.0, 7.0, 3.0]
    zero = every_way(curve(x=x, y=y, kind=kind, outside="zero"), BEYOND)
    assert zero.tolist() == np.where(is_outside, 0.0, held).tolist()
    ends = every_way(curve(x=x, y=y, kind=kind, outside="ends"), BEYOND)
    assert np.isnan(ends).tolist() == is_outside.tolist()
    assert ends[~is_outside].tolist() == held[~is_outside].tolist()


@pytest.mark.parametrize("kind", curves.KINDS)
@pytest.mark.parametrize("outside", curves.OUTSIDE)
@pytest.mark.parametrize("name", ["even", "three decades in each other"])
def test_what_is_not_a_number_gives_what_is_not_one(kind, outside, name):
    f = curve(x=SPACINGS[name], y=VALUES[name], kind=kind, outside=outside)
    at = np.where(np.arange(16) % 2, np.nan, 1.0)
    assert np.isnan(compiled(f, at)).tolist() == np.isnan(at).tolist()
    assert np.isnan(f(np.nan))
    assert np.isnan(f(at)).tolist() == np.isnan(at).tolist()


@pytest.mark.parametrize("kind", curves.KINDS)
@pytest.mark.parametrize("outside", curves.OUTSIDE)
def test_a_surface_has_the_same_edges(outside, kind):
    f = surface(x=[0.0, 1.0], y=[0.0, 2.0], z=[[1.0, 2.0], [3.0, 4.0]], outside=outside, kind=kind)
    x, y = np.array([0.5, -1.0, 0.5, np.nan, 0.5, np.nan, 9.0]), np.array([1.0, 1.0, 5.0, 1.0, np.nan, 5.0, np.nan])
    found = every_way(f, x, y)
    middle, held = (1.0, [1.0, 2.0]) if kind in ("nearest", "previous") else (2.5, [1.5, 3.0])
    beyond = {"held": held, "zero": [0.0, 0.0], "ends": [np.nan, np.nan]}[outside]
    np.testing.assert_array_equal(found, [middle, *beyond, np.nan, np.nan, np.nan, np.nan])


# ---- files


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "__file__", str(tmp_path / "model.py"))
    return tmp_path


def test_columns_of_a_csv_come_in_si_by_the_ends_of_their_names(folder):
    (folder / "thrust.csv").write_text("# engine 3\ntime_min, thrust_kn, mach\n0, 1.5, 0\n\n2, 3, 0.5\n")
    f = curve("thrust.csv", x="time_min", y="thrust_kn")
    assert f(np.array([0.0, 60.0, 120.0])).tolist() == [1500.0, 2250.0, 3000.0]
    assert curve("thrust.csv", x="time_min", y="mach", x_unit="h")(7200.0) == 0.5
    assert f.block.file == Path(folder / "thrust.csv")


def test_a_parquet_file_is_read_as_a_csv_is(folder):
    table = pa.table({"altitude_km": [0, 10], "wind_m_s": [5.0, 15.0], "station": ["a", "b"]})
    pq.write_table(table, folder / "wind.parquet")
    assert curve("wind.parquet", x="altitude_km", y="wind_m_s")(5e3) == 10.0


def test_the_rows_of_a_surface_come_in_any_order(folder):
    rows = [f"{m},{a},{m + 0.1 * a}" for a in (0, 5, 10) for m in (2, 0, 1)]
    (folder / "cd.csv").write_text("mach,alpha_deg,cd\n" + "\n".join(rows))
    f = surface("cd.csv", "mach", "alpha_deg", "cd")
    assert f(1.5, np.radians(7.5)) == pytest.approx(2.25, rel=1e-15)


def test_what_is_wrong_with_a_file_is_said(folder):
    for text, message in [
        ("", "empty"),
        ("x,y\n1\n", "line 2: 1 number for 2 columns"),
        ("x;y\n1;2\n", 'line 2: "1;2" are not all numbers; write one for each column, with commas between'),
        ("x,y\n1,2\n2,b\n", 'line 3: "2,b"'),
        ("x,z\n1,2\n", 'no column "y"'),
        ("x,y\n1,2\n", "two or more points"),
        ("x,y\n1,2\n1,3\n", "must rise, but 1 follows 1"),
        ("x,y\n1,2\n2,nan\n", "infinite or missing"),
    ]:
        (folder / "points.csv").write_text(text)
        with pytest.raises(ModelError, match=message):
            curve("points.csv", x="x", y="y")


def test_what_is_wrong_with_a_call_is_said(folder):
    (folder / "cd.csv").write_text("mach,alpha,cd\n0,0,1\n0,1,1\n1,0,1\n")
    with pytest.raises(ModelError, match="no grid of 2 by 2"):
        surface("cd.csv", "mach", "alpha", "cd")
    with pytest.raises(ModelError, match="one of linear, cubic, nearest"):
        curve(x=[0, 1], y=[0, 1], kind="spline")
    with pytest.raises(ModelError, match="one of held, zero, ends"):
        curve(x=[0, 1], y=[0, 1], outside="nan")
    with pytest.raises(ModelError, match="there is no file"):
        curve(x="time_s", y="thrust_n")
    with pytest.raises(ModelError, match="rise"):
        surface(x=[0, 1], y=[1, 0], z=[[0, 0], [0, 0]])
    for points in (np.arange(2.0), [0.0, 1.0]):
        for wrong in (lambda p=points: surface(p, p, np.eye(2)), lambda p=points: curve(p, p)):
            with pytest.raises(ModelError, match=r"first argument is the name of a file, .* give points as x=..., y="):
                wrong()
    with pytest.raises(ModelError, match='"3" is not a unit'):
        curve(x=[0, 1], y=[0, 1], x_unit=3)
    with pytest.raises(FileNotFoundError):
        curve("missing.csv")


@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_points_that_lie_too_close_are_refused_by_one_sentence_without_a_warning_of_numpy(kind):  # an error in tests
    for x, sentence in [
        ([0.0, 5e-324, 1.0], "two points lie so close"),
        ([0.0, 1e-320, 2e-320], "all arguments lie within 2e-320"),
    ]:
        with pytest.raises(ModelError, match=sentence):
            curve(x=x, y=[0.0, 1.0, 2.0], kind=kind)
        for z in ([[0.0, 1.0], [2.0, 3.0], [4.0, 6.0]], np.transpose([[0.0, 1.0], [2.0, 3.0], [4.0, 6.0]])):
            axes = (x, [0.0, 1.0]) if len(z) == 3 else ([0.0, 1.0], x)
            with pytest.raises(ModelError, match=sentence):
                surface(x=axes[0], y=axes[1], z=z, kind=kind)


def test_a_cubic_curve_is_never_lost_at_its_own_points():
    with pytest.raises(ModelError, match="two points lie so close"):
        curve(x=[0.0, 1e-160, 1.0], y=[0.0, 1.0, 2.0], kind="cubic")  # whose slopes are finite, but not their changes
    assert curve(x=[0.0, 1e-90, 1.0], y=[0.0, 1.0, 2.0], kind="cubic")(0.0) == 0.0


def test_numbers_of_arrays_are_in_the_unit_that_is_said():
    assert curve(x=[0, 2], y=[0, 180], x_unit="km", y_unit="deg")(1000.0) == pytest.approx(0.5 * np.pi, rel=1e-15)
    tilted = surface(x=[0, 1], y=[0, 90], z=[[0, 1], [2, 3]], units={"y": "deg", "z": "km"})
    assert tilted(0.5, 0.25 * np.pi) == pytest.approx(1500.0, rel=1e-15)
    with pytest.raises(ModelError, match='units has "alpha"; its numbers are "x", "y", "z"'):
        surface(x=[0, 1], y=[0, 90], z=[[0, 1], [2, 3]], units={"alpha": "deg"})


def test_what_is_no_row_of_numbers_is_refused_with_one_sentence():
    for x, y, sentence in [
        ([0.0], [1.0], "1 argument, 1 value; give two or more points"),
        ([-1e308, 1e308], [0.0, 1.0], "the arguments are too large"),
        (1.0, 2.0, "x must be numbers, one row of them"),
        (["0", "1"], [0.0, 1.0], "x must be numbers, one row of them"),
        (np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[s]"), [0.0, 1.0], "x must be numbers"),
        ([[0.0, 1.0]], [0.0, 1.0], "x must be numbers, one row of them"),
        ([0.0, 1.0], [0.0, 1j], "y must be numbers, one row of them"),
    ]:
        with pytest.raises(ModelError, match=sentence):
            curve(x=x, y=y)


def test_a_file_that_is_no_table_is_refused_with_one_sentence(folder):
    for name, content, sentence in [
        ("twice.csv", b"x,y,y\n0,1,5\n1,2,5\n", 'twice.csv has two columns "y"'),
        ("latin.csv", b"x,y\n0,\xb51\n1,2\n", "latin.csv is no text in UTF-8"),
        ("text.parquet", b"x,y\n0,1\n", "text.parquet is no Parquet file"),
    ]:
        (folder / name).write_bytes(content)
        with pytest.raises(ModelError, match=sentence):
            curve(name)


@pytest.mark.parametrize(
    ("name", "factor"),
    [("time_s", 1.0), ("v_km_s", 1e3), ("alpha_deg", np.pi / 180.0), ("cd", 1.0), ("wind_m_s", 1.0), ("q_n_m", 1.0)],
)
def test_the_longest_unit_at_the_end_of_a_name_counts(name, factor):
    assert si_factor(name) == factor
    with pytest.raises(ModelError, match="did you mean"):
        si_factor(name, "m/ss")


def test_a_column_whose_unit_is_not_known_is_no_plain_number(folder):
    for name, sentence in [
        ("thrust_kN", 'did you mean "thrust_kn"'),
        ("thrust_lbf", '"thrust_lbf" ends in no unit'),
        ("F [N]", '"F \\[N\\]" ends in no unit'),
        ("rate_1_km", '"rate_1_km" may end in the unit 1/km or km'),
    ]:
        (folder / "points.csv").write_text(f"time_s,{name}\n0,1\n1,2\n")
        with pytest.raises(ModelError, match=f"points.csv: .*{sentence}"):
            curve("points.csv", x="time_s", y=name)
        assert curve("points.csv", x="time_s", y=name, y_unit="kN")(1.0) == 2000.0


def test_the_argument_that_says_a_unit_is_named_as_the_function_has_it(folder):
    (folder / "points.csv").write_text("time_sec,alpha_x,cd\n0,0,1\n0,1,2\n1,0,1\n1,1,2\n")
    with pytest.raises(ModelError, match=r'; say x_unit="" for a plain number'):
        curve("points.csv", x="time_sec", y="cd")
    with pytest.raises(ModelError, match=r'; say y_unit="" for a plain number'):
        curve("points.csv", x="cd", y="time_sec")
    with pytest.raises(ModelError, match=r'; say units=\{"alpha_x": ""\} for a plain number'):
        surface("points.csv", "time_sec", "alpha_x", "cd", units={"time_sec": "s"})
    with pytest.raises(ModelError, match="; say its unit at its end, or one word, for a plain number"):
        wind_profile("points.csv", "time_sec", "alpha_x", "cd")


@pytest.mark.parametrize(
    ("columns", "wrong", "ends", "quantity"),
    [(("h_km", "from_deg", "wind_kn"), "wind_kn", "kN", "speed"), (("t_s", "from_deg", "v_m_s"), "t_s", "s", "length"),
     (("h_km", "v_m_s", "w_m_s"), "v_m_s", "m/s", "angle")],
)  # fmt: skip
def test_a_wind_column_in_a_unit_of_another_quantity_is_rejected(columns, wrong, ends, quantity, tmp_path):
    path = tmp_path / "wind.csv"
    path.write_text(f"{','.join(columns)}\n0,10,5\n9,20,8\n")
    with pytest.raises(ModelError, match=f'"{wrong}" ends in {ends}, no unit of {quantity}'):
        wind_profile(str(path), columns[0], speed=columns[2], coming_from=columns[1])
