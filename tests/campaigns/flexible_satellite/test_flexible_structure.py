"""Mass and modes: printed and recomputed numbers, what a craft left alone conserves, crafts that cannot be."""

import numpy as np
import pytest
from flexible_flights import ALONE, LAMBDA, MODEL, J, fly_cases, fly_one, prepared
from flexible_twin import C0

from campaigns.flexible_satellite import control, dynamics
from mc_engine.flight.kernel_parts import settings_class

# recomputed from Tables 10 and 11: rad/s and kg m^2, to the digits written
FREE_FREQUENCIES = [0.96281, 1.24016, 1.92937, 2.69062]
RIGID_MOMENTS = [27.001, 55.867, 64.202]


def rigid_of_the_kernel(**inputs):
    """J - c0 c0^T as the kernel has it: its inverse inverted."""
    p, _ = prepared(**inputs)
    inverse = [[p["mxx"], p["mxy"], p["mxz"]], [p["mxy"], p["myy"], p["myz"]], [p["mxz"], p["myz"], p["mzz"]]]
    return np.linalg.inv(np.array(inverse)[:, :, 0])


def test_the_body_that_gives_way_has_the_principal_moments_of_the_digest():
    moments = np.linalg.eigvalsh(rigid_of_the_kernel())
    np.testing.assert_allclose(moments, RIGID_MOMENTS, rtol=1e-4)
    np.testing.assert_allclose(rigid_of_the_kernel(), J - C0 @ C0.T, rtol=1e-12)


def free_frequencies(inertia, coupling, frequencies):
    """Frequencies [rad/s], float64[n, 4], of the free craft, undamped: det(Lam^2 - x^2 (1 - c0^T J^-1 c0)) = 0.

    frequencies : float64[n, 4], Lam, those of the appendages on a body that is held.
    """
    turned = np.linalg.solve(inertia, coupling)
    mass = np.eye(4) - coupling.transpose(0, 2, 1) @ turned
    # Lam^-1 M Lam^-1 is symmetric with eigenvalues 1 / x^2
    scaled = mass / (frequencies[:, :, None] * frequencies[:, None, :])
    return 1.0 / np.sqrt(np.linalg.eigvalsh(scaled)[:, ::-1])


def test_the_free_craft_rings_at_the_frequencies_of_the_digest():
    ours = free_frequencies(J[None], C0[None], LAMBDA[None])
    np.testing.assert_allclose(ours[0], FREE_FREQUENCIES, rtol=1e-5)


def test_the_right_hand_side_rings_at_those_frequencies_too():
    """Its derivatives by differences, about rest: the eigenvalues are zeros and +-i times the frequencies."""
    p, _ = prepared(**ALONE, initial_omega_x_rad_s=0.0, initial_omega_y_rad_s=0.0, initial_omega_z_rad_s=0.0)
    p = MODEL.kernel_parameters(**{name: float(row[0]) for name, row in p.items()})
    settings = settings_class(MODEL)(*(0.0 for _ in MODEL.settings))
    memory = control.start(p, settings)
    rest = np.array(dynamics.initial(p))
    moving = slice(4, 15)  # h, psi, eta

    def rate(displacement):
        state = rest.copy()
        state[moving] += displacement
        return np.array(dynamics.rhs(0.0, dynamics.State(*state), memory, p))[moving]

    size = 1e-3
    columns = [(rate(size * unit) - rate(-size * unit)) / (2.0 * size) for unit in np.eye(11)]
    values = np.linalg.eigvals(np.array(columns).T)
    np.testing.assert_allclose(np.sort(values.imag)[-4:], FREE_FREQUENCIES, rtol=1e-5)
    assert np.abs(values.real).max() < 1e-9


def test_the_dispersed_factors_reach_the_matrices():
    factors = {"inertia_x_factor": 1.1, "inertia_y_factor": 0.9, "inertia_z_factor": 1.05, "coupling_factor": 0.5}
    rigid = rigid_of_the_kernel(**factors, inertia_xy_kg_m2=1.0, inertia_xz_kg_m2=2.0, inertia_yz_kg_m2=3.0)
    inertia = np.array([[110.0, 1.0, 2.0], [1.0, 67.5, 3.0], [2.0, 3.0, 52.5]])
    np.testing.assert_allclose(rigid, inertia - 0.25 * C0 @ C0.T, rtol=1e-12)


# ---- a craft left alone


def kept(row):
    """(energy [J], size of the angular momentum [N m s]) from the rates at the end, as the digest writes them."""
    w = np.array([row[f"omega_{axis}_rad_s"] for axis in "xyz"])
    eta = np.array([row[f"eta_{i}"] for i in (1, 2, 3, 4)])
    etad = np.array([row[f"end_modal_momentum_{i}"] for i in (1, 2, 3, 4)]) - C0.T @ w
    energy = 0.5 * w @ J @ w + w @ C0 @ etad + 0.5 * etad @ etad + 0.5 * eta @ (LAMBDA**2 * eta)
    return np.array([energy, np.linalg.norm(J @ w + C0 @ etad)])


def test_left_alone_the_craft_keeps_its_energy_and_the_size_of_its_angular_momentum():
    flown = fly_cases(**ALONE, duration_s=np.linspace(0.01, 100.0, 21))
    numbers = np.array([kept({name: column[case] for name, column in flown.items()}) for case in range(21)])
    first = kept(fly_one(**ALONE, duration_s=1e-3, step_s=1e-3))
    assert np.abs(numbers / first - 1.0).max() < 1e-8
    assert np.abs(flown["eta_1"]).max() > 1e-3  # the modes do ring


def test_left_alone_it_keeps_the_direction_of_its_momentum_in_the_orbital_frame():
    """With no orbital motion that frame is inertial: turned there by its attitude, h stands still."""

    def there(row):
        q0, q = row["q0"], np.array([row["q1"], row["q2"], row["q3"]])
        h = np.array([row[f"end_momentum_{axis}_n_m_s"] for axis in "xyz"])
        return h + 2.0 * np.cross(q, np.cross(q, h) + q0 * h)

    first, last = (there(fly_one(**ALONE, duration_s=time)) for time in (0.01, 100.0))
    np.testing.assert_allclose(last, first, rtol=0.0, atol=1e-7 * np.linalg.norm(first))


def test_the_quaternion_keeps_its_norm():
    row = fly_one()
    assert sum(row[f"q{i}"] ** 2 for i in range(4)) == pytest.approx(1.0, abs=1e-11)


def test_damping_only_takes_energy_away():
    row = fly_one(**ALONE | {"modal_damping_factor": 1.0}, duration_s=100.0)
    before, after = kept(fly_one(**ALONE, duration_s=0.01)), kept(row)
    assert after[0] < before[0] * (1.0 - 2e-5)
    assert after[1] == pytest.approx(before[1], rel=1e-8)


# ---- crafts that cannot be

# with more, c0^T J^-1 c0 has an eigenvalue above 1
MOST_COUPLING = 1.0 / np.sqrt(np.linalg.eigvalsh(C0.T @ np.linalg.inv(J) @ C0)[-1])
REFUSALS = [
    ({"inertia_xy_kg_m2": 90.0}, "the inertia matrix is not positive definite"),
    ({"inertia_x_factor": 0.0}, "the inertia matrix is not positive definite"),
    ({"inertia_x_kg_m2": 126.0}, "the principal moments of inertia break the triangle inequality"),
    ({"inertia_yz_kg_m2": 55.0}, "the principal moments of inertia break the triangle inequality"),
    ({"coupling_factor": MOST_COUPLING * (1.0 + 1e-9)}, "J - c0 c0^T is not positive definite"),
    ({"initial_q0": 0.0, "initial_q1": 0.0, "initial_q2": 0.0, "initial_q3": 0.0}, "the first quaternion is zero"),
    ({"valve_delay_s": 0.0201}, "valve_delay_s is longer than 2 samples of the control"),
    ({"inertia_x_factor": np.nan}, "inertia_x_factor is not a number"),
    ({"inertia_x_factor": np.inf}, "inertia_x_factor is infinite"),
    ({"inertia_x_factor": 1e300, "inertia_x_kg_m2": 1e300}, "the inertia matrix is not finite"),
    ({"pwpf_hysteresis": 0.0}, "pwpf_hysteresis is outside"),
]


@pytest.mark.parametrize(("inputs", "sentence"), REFUSALS, ids=[sentence for _, sentence in REFUSALS])
def test_a_craft_that_cannot_be_is_refused_with_its_reason(inputs, sentence):
    row = fly_one(**inputs)
    assert (row["status"], row["reason"].startswith(sentence)) == ("refused", True)
    assert np.isnan(row["q0"])


def test_just_inside_the_limits_it_flies():
    assert fly_one(inertia_x_kg_m2=125.0, duration_s=1.0)["status"] == "ok"
    assert fly_one(valve_delay_s=0.02, duration_s=1.0)["status"] == "ok"
    assert fly_one(coupling_factor=0.99 * MOST_COUPLING, duration_s=1.0)["status"] == "ok"
