"""The loop on a fixed grid: order, sampled control, noise, broken cases, and its twin in plain Python."""

import numpy as np
import pytest
from flown_models import FOLDER, OSCILLATOR, RAIL, flown, inputs_of, same_bytes
from plain_steps import ahead, twin

from mc_engine.flight.flight import fly_history
from mc_engine.lanes.functions import fma
from mc_engine.lanes.kernel_cache import Kernel
from mc_engine.model import load_model

PUSHED = load_model("pushed_spring.py", FOLDER)
RANDOM = np.random.default_rng(3)
MIXED = {
    "rate_rad_s": RANDOM.uniform(0.5, 2.0, 37),
    "x0_km": RANDOM.normal(size=37),
    "v0_m_s": 1e3 * RANDOM.normal(size=37),
    "gain_1_s": RANDOM.uniform(0.0, 0.5, 37),
    "noise_m_s2": np.where(np.arange(37) % 3 == 0, 0.0, 100.0),
    "until_s": 7.3,
    "every": 3.0,
}


def test_the_error_falls_by_sixteen_when_the_step_is_halved():
    coarse, fine = (abs(flown(OSCILLATOR, step_s=step)["end_x_km"][0] - np.cos(10.0)) for step in (0.1, 0.05))
    assert coarse / fine == pytest.approx(16.0, rel=0.1)
    assert coarse < 1e-5


class ClassicSteps:
    """Steps by the classic method of fourth order over Python floats."""

    def restart(self):
        """Nothing is kept from step to step."""

    def advance(self, rhs, step, h, s):
        t = step * h
        k1 = rhs(t, s)
        k2 = rhs(t + 0.5 * h, ahead(s, 0.5 * h, k1))
        k3 = rhs(t + 0.5 * h, ahead(s, 0.5 * h, k2))
        k4 = rhs(t + h, ahead(s, h, k3))
        slopes = [fma(2.0, b + c, a + d) for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        return ahead(s, h * (1.0 / 6.0), slopes)


@pytest.mark.parametrize("width", [1, 8])
def test_a_plain_loop_over_python_floats_gives_the_same_bits(width):
    columns = flown(OSCILLATOR, width=width, seed=9, **MIXED)
    for case in range(0, 37, 4):
        s, m = twin(ClassicSteps(), case, 9, 0.1, MIXED)
        assert (columns["end_x_km"][case], columns["end_v_m_s"][case]) == (s.x / 1e3, s.v)
        assert (columns["samples"][case], columns["sampled_at_s"][case]) == (m.samples, m.sampled_at)


def test_what_depends_on_time_alone_is_computed_once_for_all_lanes(monkeypatch):
    kernels, loaded = [], Kernel._loaded
    monkeypatch.setattr(Kernel, "_loaded", lambda self, form: (kernels.append((self, form)), loaded(self, form))[1])
    ends = flown(PUSHED, frequency_rad_s=np.full(8, 2.0))["end_m"]
    np.testing.assert_allclose(ends, (np.sin(10.0) - 0.5 * np.sin(20.0)) / 3.0, atol=1e-5)
    ((kernel, form),) = kernels
    code = kernel.library(form)[1].get_llvm_str()
    assert "call double @llvm.rint.f64" in code  # of the sine
    assert "@llvm.rint.v8f64" not in code


def test_a_force_may_loop_over_the_time_and_the_state(tmp_path):
    text = (FOLDER / "pushed_spring.py").read_text()
    looped = text.replace("v=sin(t) - p.frequency * p.frequency * s.x", "v=force")
    looped = looped.replace(
        "def rhs(t, s, p):\n",
        """def rhs(t, s, p):
    force, terms = sin(t), (t, s.x, p.frequency * p.frequency)
    for i in range(1, 2):
        force = force - terms[i + 1] * terms[i]
""",
    )
    (tmp_path / "looped.py").write_text(looped)
    frequencies = np.linspace(1.0, 3.0, 8)
    same_bytes(*(flown(m, frequency_rad_s=frequencies) for m in (PUSHED, load_model("looped.py", tmp_path))))


def test_a_case_keeps_its_bytes_in_any_order_among_any_cases():
    whole = flown(OSCILLATOR, **MIXED)
    order = np.random.default_rng(1).permutation(37)
    shuffled = {name: value[order] if np.ndim(value) else value for name, value in MIXED.items()}
    back = np.argsort(order)
    same_bytes(whole, {name: row[back] for name, row in flown(OSCILLATOR, case_ids=order, **shuffled).items()})
    few = {name: value[30:33] if np.ndim(value) else value for name, value in MIXED.items()}
    same_bytes({name: row[30:33] for name, row in whole.items()}, flown(OSCILLATOR, case_ids=[30, 31, 32], **few))


def test_noise_follows_the_case_number_and_the_seed_not_the_place_in_the_chunk():
    one = flown(OSCILLATOR, noise_m_s2=1.0, case_ids=[5, 6, 5, 2**40])
    assert one["end_x_km"][0] == one["end_x_km"][2]
    assert len(set(one["end_x_km"])) == 3
    other_seed = flown(OSCILLATOR, noise_m_s2=1.0, case_ids=[5], seed=2)
    assert other_seed["end_x_km"][0] != one["end_x_km"][0]


def test_noise_of_the_loop_has_the_variance_of_independent_pushes():
    # a free mass pushed by noise held for one step: v = h * sum of n deviates
    free = flown(OSCILLATOR, rate_rad_s=0.0, x0_km=0.0, noise_m_s2=1.0, case_ids=np.arange(4000))
    speed = free["end_v_m_s"]
    assert speed.std() == pytest.approx(0.1 * np.sqrt(100), rel=4 / np.sqrt(2 * 4000))
    assert abs(speed.mean()) < 4.0 / np.sqrt(4000)


@pytest.mark.parametrize(
    ("every", "samples", "last"), [(1.0, 100, 9.9), (3.0, 34, 9.9), (7.0, 15, 9.8), (500.0, 1, 0.0)]
)
def test_control_is_sampled_at_the_start_and_every_so_many_steps(every, samples, last):
    columns = flown(OSCILLATOR, every=every)
    assert columns["samples"][0] == samples
    assert columns["sampled_at_s"][0] == pytest.approx(last, abs=1e-12)


def test_sampled_damping_follows_the_closed_form_of_a_held_push():
    # v' = -gain v(t_k) between samples: v falls by the factor 1 - gain * interval at each
    columns = flown(OSCILLATOR, rate_rad_s=0.0, v0_m_s=1.0, gain_1_s=0.25, every=4.0, until_s=8.0)
    assert columns["end_v_m_s"][0] == pytest.approx((1.0 - 0.25 * 0.4) ** 20, rel=1e-13)


def test_a_case_that_becomes_nan_keeps_its_last_finite_state_and_its_neighbours_do_not_notice():
    breaks = np.full(37, 1e9)
    breaks[[3, 4, 20, 36]] = 2.05, 0.02, 6.0, -1.0
    broken, whole = flown(OSCILLATOR, **MIXED, breaks_at_s=breaks), flown(OSCILLATOR, **MIXED)
    bad = breaks < 1e9
    assert list(broken["status"]) == ["not-finite" if b else "ok" for b in bad]
    same_bytes({k: v[~bad] for k, v in broken.items()}, {k: v[~bad] for k, v in whole.items()})
    assert broken["end_time_s"][bad] == pytest.approx([2.0, 0.0, 5.9, 0.0], abs=0.1 + 1e-12)
    for case in np.flatnonzero(bad):
        until = {**MIXED, "until_s": max(float(broken["end_time_s"][case]), 1e-9), "breaks_at_s": breaks}
        if broken["end_time_s"][case] == 0.0:
            assert broken["end_x_km"][case] == pytest.approx(MIXED["x0_km"][case], rel=1e-15)
        else:
            assert broken["end_x_km"][case] == flown(OSCILLATOR, **until)["end_x_km"][case]
    assert np.isnan(broken["top_km"][bad]).all()


def test_the_history_of_a_broken_case_ends_with_its_last_finite_look():
    inputs = inputs_of(OSCILLATOR, {"breaks_at_s": 2.05})
    columns, history = fly_history(OSCILLATOR, inputs, 0, 1, folder=FOLDER, width=8)
    assert columns["status"][0] == "not-finite"
    assert np.isfinite(history["x_km"]).all()
    assert history["t_s"][-1] <= 2.05


@pytest.mark.parametrize("width", [1, 8])
def test_the_history_runs_from_the_first_state_to_the_last_one_of_the_row(width):
    inputs = inputs_of(OSCILLATOR, {name: value[4] if np.ndim(value) else value for name, value in MIXED.items()})
    columns, history = fly_history(OSCILLATOR, inputs, 4, 1, folder=FOLDER, width=width)
    same_bytes(columns, {name: row[4:5] for name, row in flown(OSCILLATOR, **MIXED).items()})
    assert history["t_s"].tolist() == pytest.approx([0.1 * k for k in range(74)])
    assert (history["x_km"][0], history["x_km"][-1]) == (inputs["x0_km"] * 1e3 / 1e3, columns["end_x_km"][0])
    assert max(history["x_km"]) == columns["sampled_top_km"][0]


def test_one_case_and_eight_at_a_time_give_the_same_bytes():
    same_bytes(flown(OSCILLATOR, width=1, **MIXED), flown(OSCILLATOR, width=8, **MIXED))


@pytest.mark.parametrize("rows", [10, 1000])
def test_the_history_has_every_bounce_at_its_time_however_few_its_rows_are(rows):
    """A ball from 5 m at 10 m/s^2 meets the floor at 1, 3, 5, 7 and 9 s, all between two steps."""
    ball = {"gravity_m_s2": 10.0, "x0_m": 5.0, "wall_m": 0.0, "step_s": 0.3, "last_s": 9.9}
    inputs = inputs_of(RAIL, ball)
    columns, history = fly_history(RAIL, inputs, 0, 1, folder=FOLDER, rows=rows, width=8)
    t, height = history["t_s"], history["x_m"]
    bounces = np.abs(t[:, None] - [1.0, 3.0, 5.0, 7.0, 9.0]).argmin(axis=0)
    assert t[bounces] == pytest.approx([1.0, 3.0, 5.0, 7.0, 9.0], abs=1e-12)
    assert height[bounces] == pytest.approx(np.zeros(5), abs=1e-12)
    assert columns["bounced_at_s"][0] in t
    # both ends and five bounces, and half as many rows as asked for; or those, 34 instants of the grid, and the stop
    assert len(t) == (2 + 5 + 5 if rows == 10 else 34 + 5)
