"""The compiled flight against SciPy's, against itself in other widths, and the design against no design at all."""

import numpy as np
import pytest
from costate_free import shortest
from geo_sequences import MODEL, NOMINAL, fly_cases, fly_one, history, sequence, solution
from geo_twin import assert_same, ends, fly_twin

from campaigns.geo_injection.design import powered_arc
from campaigns.geo_injection.design.coast import coast, kepler
from campaigns.geo_injection.design.kept_programs import SEQUENCES
from campaigns.geo_injection.design.powered_arc import fly_burns
from campaigns.geo_injection.design.program import program_for
from campaigns.geo_injection.dynamics import direction, start

ERRORS = {
    "thrust_factor": 0.994, "isp_factor": 1.002, "initial_mass_factor": 1.003, "ignition_delay_1_s": -4.0,
    "ignition_delay_2_s": 7.0, "pitch_error_deg": 0.3, "yaw_error_deg": -0.4, "pitch_error_2_deg": 0.2,
    "yaw_error_1_deg": 0.1, "initial_position_r_m": 700.0, "initial_position_t_m": -900.0,
    "initial_position_n_m": 500.0,
    "initial_velocity_r_m_s": 0.5, "initial_velocity_t_m_s": -0.3, "initial_velocity_n_m_s": 0.8,
}  # fmt: skip


@pytest.mark.parametrize("name", ["two_burns_28_5", "three_burns_28_5"])
def test_all_errors_at_once_fly_as_in_an_independent_program(name):
    program = program_for(SEQUENCES[name])
    burns = float(len(program.burns))
    assert_same(ends(fly_one(**ERRORS, burns=burns, tolerance=1e-13)), fly_twin(program, **ERRORS))


def test_tail_off_and_sensed_velocity_fly_as_in_an_independent_program():
    program = program_for(SEQUENCES["two_burns_28_5"])
    errors = ERRORS | {"accelerometer_scale_error": 3e-4}
    row = fly_one(**errors, shutdown="sensed_velocity", tail_off_s=4.0, tail_off_factor=1.25, tolerance=1e-13)
    assert_same(ends(row), fly_twin(program, sensed=True, tail_nominal_s=4.0, tail_s=5.0, **errors))


def test_a_long_burn_of_several_segments_flies_as_in_an_independent_program():
    """Weak thrust: a program of five segments in the first burn, and the same end as at the design."""
    row = fly_one(thrust_n=5000.0, mass_flow_kg_s=1.535)
    assert row["semi_major_axis_km"] == pytest.approx(42_164.137, abs=0.01)
    assert row["eccentricity"] < 1e-6
    assert len(program_for(sequence(2, 28.5, thrust=5000.0)).burns[0].segments) > 3


@pytest.mark.slow
def test_a_case_has_the_same_bits_whatever_the_width():
    inputs = {name: np.array([value, 0.5 * value]) for name, value in ERRORS.items() if not name.endswith("factor")}
    for guidance in ("open_loop", "re_aimed"):
        wide, single = (fly_cases(width=width, guidance=guidance, **inputs) for width in (16, 1))
        for field in MODEL.metrics:
            assert (wide[field.name] == single[field.name]).all(), field.name


def test_the_thrust_direction_interpreted_is_the_one_in_the_history():
    flown = history(yaw_error_deg=0.4, pitch_error_deg=-0.2)
    from mc_engine.flight.flight import prepare, settings_of

    ready = prepare(MODEL, NOMINAL | {"yaw_error_deg": 0.4, "pitch_error_deg": -0.2}, 1)
    p = MODEL.kernel_parameters(*(float(value) for value in ready.parameters[:, 0]))
    m = start(p, settings_of(MODEL, ready.settings[0]))
    for k in (0, 40, 150):
        x, y, z = direction(flown["t_s"][k], m)
        assert np.hypot(np.hypot(x, y), z) == pytest.approx(1.0, abs=1e-12)
        assert flown["thrust_declination_deg"][k] == pytest.approx(np.degrees(np.arcsin(z)), abs=1e-9)


def test_the_history_shows_two_burns_and_a_coast():
    flown = history()
    burning = flown["acceleration_m_s2"] > 0.0
    assert np.flatnonzero(np.diff(burning.astype(int))).size == 2
    assert flown["radius_km"][0] == pytest.approx(6578.137, abs=1e-6)
    assert flown["radius_km"][-1] == pytest.approx(42_164.137, abs=1e-3)
    coasting = ~burning
    assert np.ptp(flown["osculating_semi_major_axis_km"][coasting]) < 1e-3
    assert flown["acceleration_m_s2"][0] == pytest.approx(20_000.0 / 22_170.0, rel=1e-12)


def test_the_optimum_without_costates_is_the_same_to_a_hundredth_of_a_second():
    planned = sequence(2, 28.5)
    total, miss = shortest(planned.problem(), [-1.2, 2.3, 0.7, 21.5])
    assert miss < 1e-9
    ours = solution(2, 28.5).durations.sum()
    assert planned.time_unit * total == pytest.approx(planned.time_unit * ours, abs=0.01)


def test_the_rates_of_the_costates_are_those_of_the_hamiltonian():
    """eq. (16) of the source as it is printed, against the vector form that is flown."""
    y = np.array([[0.9, -0.3, 0.4, 0.1, 1.1, -0.2, 0.6, -0.5, 0.3, 0.2, 0.4, -0.7]])
    dt = 1e-5
    rates = (fly_burns(y, 1.0, dt, 0.1, 0.03) - fly_burns(y, 1.0, -dt, 0.1, 0.03))[0] / (2.0 * dt)
    x, yy, z = y[0, :3]
    lvx, lvy, lvz = -y[0, 6:9]
    r5 = (y[0, :3] @ y[0, :3]) ** 2.5
    printed = [
        (lvx * (yy * yy + z * z - 2 * x * x) - 3 * x * (lvy * yy + lvz * z)) / r5,
        (lvy * (x * x + z * z - 2 * yy * yy) - 3 * yy * (lvx * x + lvz * z)) / r5,
        (lvz * (x * x + yy * yy - 2 * z * z) - 3 * z * (lvx * x + lvy * yy)) / r5,
    ]
    assert rates[9:12] == pytest.approx(printed, abs=1e-8)
    assert rates[6:9] == pytest.approx(y[0, 9:12], abs=1e-8)
    push = 0.1 * y[0, 6:9] / np.linalg.norm(y[0, 6:9])
    assert rates[3:6] == pytest.approx(push - y[0, :3] / (y[0, :3] @ y[0, :3]) ** 1.5, abs=1e-8)


def test_the_arc_has_the_bits_of_its_interpreted_twin(monkeypatch):
    y = np.array([[1.0, 0.1, -0.2, 0.1, 1.15, 0.3, 0.4, -0.8, 0.2, 0.3, 0.1, -0.4]]) * [[1.0], [1.01]]
    flown = fly_burns(y, [1.0, 0.9], [0.9, -0.7], 0.1, 0.03)
    monkeypatch.setattr(powered_arc, "_fly_all", powered_arc._fly_all.__wrapped__)
    np.testing.assert_array_equal(flown, fly_burns(y, [1.0, 0.9], [0.9, -0.7], 0.1, 0.03))


@pytest.mark.parametrize("dt", [-7.0, -0.3, 0.0, 1e-4, 2.0, 25.0])
def test_coasts_in_closed_form_are_those_integrated_with_their_primer_vector(dt):
    y = np.array([[1.0, 0.1, -0.2, 0.1, 1.15, 0.3, 0.4, -0.8, 0.2, 0.3, 0.1, -0.4]])
    flown = fly_burns(y, 1.0, dt, 0.0, 0.0, 0.01)
    assert coast(y, np.array([dt])) == pytest.approx(flown, abs=1e-9)


def test_a_circle_coasts_though_it_has_no_perigee():
    r, v = np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])
    place, velocity = kepler(r, v, np.array([2.0]))
    assert place[0] == pytest.approx([np.cos(2.0), np.sin(2.0), 0.0], abs=1e-14)
    assert velocity[0] == pytest.approx([-np.sin(2.0), np.cos(2.0), 0.0], abs=1e-14)
