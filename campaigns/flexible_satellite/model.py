"""The flexible-satellite model as the engine sees it: each case's matrices and the MODEL record.

Numbers in brackets are equations of the source of `MODEL`.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from campaigns.flexible_satellite import control, dynamics, outcome
from campaigns.flexible_satellite.dynamics import AXES, MODES
from campaigns.flexible_satellite.inputs import CHOICES, Inputs
from mc_engine.model import FixedStep, Refusals, declared_in, model, prepared
from mc_engine.model.figures import HistoryFigure, ScatterFigure
from mc_engine.physics.attitude import rotation_quaternion
from mc_engine.physics.constants import STANDARD_GRAVITY
from mc_engine.physics.rotations import Quaternion, product, to_matrix
from mc_engine.studies.published import read_published

# c0, kg^(1/2) m: rows body x, y, z; columns modes 1 to 4.  Printed with a transpose sign and in kg m^2, which cannot
# be: (1) and (2) need 3 x 4 and a square root of an inertia.
COUPLING = np.array([[7.0, -1.2, 1.1, 1.2], [1.2, 0.9, 2.5, -2.6], [2.2, -1.7, -0.8, -1.1]])
LONGEST_DELAY = 2  # samples that the control remembers


def prepare(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case: the inputs, matrices inverted, first state, gains, thrusters.

    i : inputs, float64[n] by symbol, SI;  settings : codes, float64[n], by symbol.  Refused cases join `refusals`.
    """
    coupling = i.coupling_factor[:, None, None] * COUPLING
    xx, yy, zz = (getattr(i, f"inertia_{axis}") * getattr(i, f"inertia_{axis}_factor") for axis in AXES)
    xy, xz, yz = i.inertia_xy, i.inertia_xz, i.inertia_yz
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
    inverse = _inverse_of_rigid_part(inertia, coupling, refusals)
    rows = vars(i) | _entries("m", inverse, AXES) | _entries("c", coupling, MODES)
    rows |= _entries("b", inverse @ coupling, MODES) | _first_state(i, inertia, coupling, refusals)
    for mode in MODES:
        frequency = getattr(i, f"modal_frequency_{mode}") * i.modal_frequency_factor
        damping = getattr(i, f"modal_damping_{mode}") * i.modal_damping_factor
        rows |= {f"k{mode}": frequency * frequency, f"d{mode}": 2.0 * damping * frequency}  # Lam^2 and 2 Xi Lam
    rows |= {"kp_fast": i.kp / i.delta_p, "kd_fast": i.kd * i.delta_d, "ki_fast": i.ki / i.delta_i}  # (16)
    return rows | _thruster_rows(i, settings, refusals)


def _inverse_of_rigid_part(inertia: np.ndarray, coupling: np.ndarray, refusals: Refusals) -> np.ndarray:
    """Inverse [1/(kg m^2)] of J - c0 c0^T, the inertia that is left to the body when the modes give way.

    inertia : float64[n, 3, 3] [kg m^2];  coupling : float64[n, 3, 4] [kg^(1/2) m].  Cases that no body can be join
    `refusals` and have the unit matrix.
    """
    finite = np.isfinite(inertia).all(axis=(1, 2)) & np.isfinite(coupling).all(axis=(1, 2))
    refusals.add(~finite, "the inertia matrix is not finite")
    unit = np.eye(3)
    usable = finite[:, None, None]
    low, middle, high = np.linalg.eigvalsh(np.where(usable, inertia, unit)).T
    refusals.add(~(low > 0.0), "the inertia matrix is not positive definite")
    refusals.add(
        high > (low + middle) * (1.0 + 1e-12),
        "the principal moments of inertia break the triangle inequality: the largest is above the sum of the others",
    )
    rigid = np.where(usable, inertia - coupling @ coupling.transpose(0, 2, 1), unit)
    positive = np.linalg.eigvalsh(rigid)[:, 0] > 0.0
    refusals.add(
        ~positive, "J - c0 c0^T is not positive definite: the modes carry more inertia than the whole satellite has"
    )
    return np.linalg.inv(np.where(positive[:, None, None], rigid, unit))


def _entries(name: str, matrix: np.ndarray, columns: Any) -> dict[str, np.ndarray]:
    """Entries of a matrix [n, 3, ...] by axis and column."""
    return {f"{name}{AXES[a]}{column}": matrix[:, a, b] for a in range(3) for b, column in enumerate(columns)}


def _first_state(i: SimpleNamespace, inertia, coupling, refusals: Refusals) -> dict[str, np.ndarray]:
    """Attitude, angular momentum J w [N m s] and modal momenta c0^T w [kg^(1/2) m/s]; the modes rest in the body."""
    q = np.array([i.initial_q0, i.initial_q1, i.initial_q2, i.initial_q3])
    size = np.sqrt((q * q).sum(axis=0))
    refusals.add(~(size > 0.0), "the first quaternion is zero")
    errors = np.array([i.initial_attitude_error_x, i.initial_attitude_error_y, i.initial_attitude_error_z])
    q = product(Quaternion(*(q / size)), Quaternion(*rotation_quaternion(errors)))
    w = np.array([i.initial_omega_x, i.initial_omega_y, i.initial_omega_z])
    # term by term: the order of NumPy's einsum follows the number of cases
    h, psi = (sum(matrix[:, a].T * w[a] for a in range(3)) for matrix in (inertia, coupling))  # J is symmetric
    rows = q._asdict() | {f"momentum_{axis}": h[a] for a, axis in enumerate(AXES)}
    return rows | {f"modal_momentum_{mode}": psi[mode - 1] for mode in MODES}


def _thruster_rows(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Parameters of modulators (18)-(21), valves and thruster axes, SI."""
    period = settings.step * settings.steps_per_sample
    turn = rotation_quaternion(np.array([i.misalignment_x, i.misalignment_y, i.misalignment_z]))
    delay = i.valve_delay / period
    refusals.add(delay > LONGEST_DELAY, f"valve_delay_s is longer than {LONGEST_DELAY} samples of the control")
    return {
        # thruster axes are body axes turned: components along them become components along the body by the transpose
        **_entries("a", np.reshape(to_matrix(Quaternion(*turn)), (3, 3, -1)).T, AXES),
        "gain": i.pwpf_gain,
        "level": i.thrust_level * np.where(settings.pwpf_pairing == CHOICES.pwpf_pairing.C, 0.5, 1.0),
        "torque": i.thrust_level * np.where(settings.pwpf_pairing == CHOICES.pwpf_pairing.A, 1.0, 0.5),
        "on": i.pwpf_u_off + i.pwpf_hysteresis,  # (21a)
        "off": i.pwpf_u_off,
        "time_constant": i.pwpf_time_constant,
        "decay": np.exp(-period / i.pwpf_time_constant),
        "exhaust_arm": i.isp * STANDARD_GRAVITY * i.arm,  # N m s of impulse per kg of propellant
        # shares of a sample's thrust that come in that sample, the next and the one after: linear between whole
        # samples of delay, derived here; they add to 1, and their mean delay is the one given
        **{name: np.maximum(0.0, 1.0 - np.abs(delay - k)) for k, name in enumerate(("now", "next", "then"))},
    }


MODEL = model(
    name="flexible_satellite",
    title="Flexible satellite under a robust PID and pulse-modulated thrusters",
    source="H. Taei, S. Ayati, S. F. Mousavi, Robust PID control of a flexible satellite considering thruster actuator "
    "dynamics (in Persian), Iranian Journal of Mechanical Engineering 24(3), 2022, doi 10.30506/IJMEP.2022.525295.1770",
    inputs=Inputs,
    clock=FixedStep("step", "duration", "steps_per_sample"),
    kernel_parameters=prepared(prepare, Inputs),
    prepare=prepare,
    **declared_in(dynamics, control, outcome),
    figures=(
        HistoryFigure(("q0", "q1", "q2", "q3"), "Attitude in the orbital frame"),
        HistoryFigure(("omega_x_rad_s", "omega_y_rad_s", "omega_z_rad_s", "rate_rad_s"), "Inertial body rates"),
        HistoryFigure(("eta_1", "eta_2", "eta_3", "eta_4"), "Displacement of the modes"),
        HistoryFigure(("command_x_n_m", "command_y_n_m", "command_z_n_m"), "Commanded torques"),
        HistoryFigure(("torque_x_n_m", "torque_y_n_m", "torque_z_n_m"), "Torques of the actuators"),
        HistoryFigure(("pulse_count_x", "pulse_count_y", "pulse_count_z"), "Pulses fired so far"),
        HistoryFigure(("attitude_error_deg", "control_effort_n_m_s"), "Attitude error and impulse spent"),
        ScatterFigure("q1", "q2", "Attitude at the end"),
        ScatterFigure("omega_x_rad_s", "omega_z_rad_s", "Rates at the end"),
        ScatterFigure("control_effort_n_m_s", "attitude_effort_s", "The two objectives of the tuning"),
    ),
    published=read_published(Path(__file__).with_name("published.toml")),
)
