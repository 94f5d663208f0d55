"""Motion of the flexible satellite: hybrid-coordinate dynamics and quaternion kinematics in the orbital frame.

Body axes, SI.  Numbers in brackets are equations of H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical
Engineering 24(3), 2022.

The state holds momenta, not rates: the total angular momentum h = J w + c0 eta' and the modal momenta
psi = eta' + c0^T w.  With them (1) and (2) read h' = -w x h + u + T_d and psi' = -2 Xi Lam eta' - Lam^2 eta, without
eta'', and the rates follow from M w = h - c0 psi, M = J - c0 c0^T: the same motion for two thirds of the work.
"""

from mc_engine.lanes import merged, physics, sin
from mc_engine.model import Field, states
from mc_engine.physics.attitude import quaternion_rates
from mc_engine.physics.rotations import Quaternion
from mc_engine.physics.vectors import Vector, cross, subtracted

AXES, MODES = "xyz", (1, 2, 3, 4)
State = states(
    **{f"q{i}": Field(f"attitude in the orbital frame, component {i}, scalar first", unit="") for i in range(4)},
    **{f"momentum_{axis}_n_m_s": f"total angular momentum along body {axis}" for axis in AXES},
    **{f"modal_momentum_{i}": Field(f"momentum of mode {i}, √kg m/s", unit="") for i in MODES},
    **{f"eta_{i}": Field(f"displacement of mode {i}, √kg m", unit="") for i in MODES},
    **{f"impulse_{axis}_n_m_s": f"impulse of the {axis} actuator so far" for axis in AXES},
    attitude_effort_s="integral of |q1| + |q2| + |q3| so far",
    scalar_effort_s="integral of |1 - q0| so far",
)


@physics
def initial(p):
    """First state: modes at rest in the body."""
    return merged(
        State, p, eta_1=0.0, eta_2=0.0, eta_3=0.0, eta_4=0.0,
        impulse_x=0.0, impulse_y=0.0, impulse_z=0.0, attitude_effort=0.0, scalar_effort=0.0,
    )  # fmt: skip


@physics
def body_rate(s, p):
    """Inertial body rate [rad/s] from the momenta: w = M^-1 (h - c0 psi)."""
    h = Vector(s.momentum_x, s.momentum_y, s.momentum_z)
    psi1, psi2, psi3, psi4 = s.modal_momentum_1, s.modal_momentum_2, s.modal_momentum_3, s.modal_momentum_4
    return Vector(
        (p.mxx * h.x + p.mxy * h.y + p.mxz * h.z) - ((p.bx1 * psi1 + p.bx2 * psi2) + (p.bx3 * psi3 + p.bx4 * psi4)),
        (p.mxy * h.x + p.myy * h.y + p.myz * h.z) - ((p.by1 * psi1 + p.by2 * psi2) + (p.by3 * psi3 + p.by4 * psi4)),
        (p.mxz * h.x + p.myz * h.y + p.mzz * h.z) - ((p.bz1 * psi1 + p.bz2 * psi2) + (p.bz3 * psi3 + p.bz4 * psi4)),
    )


@physics
def rhs(t, s, m, p):
    """Time derivative of the state under the held torque m.body and the wave of the disturbance.  (1), (2), (5)"""
    h, w = Vector(s.momentum_x, s.momentum_y, s.momentum_z), body_rate(s, p)
    # rates eta' [kg^(1/2) m/s] of the modes: psi - c0^T w, which defines psi
    eta1 = s.modal_momentum_1 - (p.cx1 * w.x + p.cy1 * w.y + p.cz1 * w.z)
    eta2 = s.modal_momentum_2 - (p.cx2 * w.x + p.cy2 * w.y + p.cz2 * w.z)
    eta3 = s.modal_momentum_3 - (p.cx3 * w.x + p.cy3 * w.y + p.cz3 * w.z)
    eta4 = s.modal_momentum_4 - (p.cx4 * w.x + p.cy4 * w.y + p.cz4 * w.z)
    wave = p.disturbance_amplitude * sin(p.disturbance_frequency * t)
    dq0, dq1, dq2, dq3 = quaternion_rates(s.q0, s.q1, s.q2, s.q3, w.x, w.y, w.z)
    turn = 0.5 * p.orbit_rate  # the orbital frame's own rate multiplies q from the left: no matrix (9) is needed
    torque = subtracted(Vector(m.body.x + wave, m.body.y + wave, m.body.z + wave), cross(w, h))
    return merged(
        State,
        Quaternion(q0=dq0 - turn * s.q2, q1=dq1 + turn * s.q3, q2=dq2 + turn * s.q0, q3=dq3 - turn * s.q1),
        momentum_x=torque.x,
        momentum_y=torque.y,
        momentum_z=torque.z,
        modal_momentum_1=-p.d1 * eta1 - p.k1 * s.eta_1,
        modal_momentum_2=-p.d2 * eta2 - p.k2 * s.eta_2,
        modal_momentum_3=-p.d3 * eta3 - p.k3 * s.eta_3,
        modal_momentum_4=-p.d4 * eta4 - p.k4 * s.eta_4,
        eta_1=eta1,
        eta_2=eta2,
        eta_3=eta3,
        eta_4=eta4,
        impulse_x=abs(m.torque.x),
        impulse_y=abs(m.torque.y),
        impulse_z=abs(m.torque.z),
        attitude_effort=abs(s.q1) + abs(s.q2) + abs(s.q3),
        scalar_effort=abs(1.0 - s.q0),
    )
