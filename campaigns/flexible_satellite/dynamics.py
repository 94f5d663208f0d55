"""Motion of the flexible satellite: hybrid-coordinate dynamics and quaternion kinematics in the orbital frame.

Body axes, SI.  Numbers in brackets are equations of H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical
Engineering 24(3), 2022.

The state holds momenta, not rates: the total angular momentum h = J w + c0 eta' and the modal momenta
psi = eta' + c0^T w.  With them (1) and (2) read h' = -w x h + u + T_d and psi' = -2 Xi Lam eta' - Lam^2 eta, without
eta'', and the rates follow from M w = h - c0 psi, M = J - c0 c0^T: the same motion for two thirds of the work.
"""

from collections import namedtuple

from mc_engine.lanes import physics, sin
from mc_engine.physics.attitude import quaternion_rates, second_axis_in_body

# q: body from orbital frame, scalar first; h [N m s]; psi and eta of the four modes [kg^(1/2) m, per s for psi]
# impulse: integral of |torque| of each thruster axis [N m s]; attitude_effort, scalar_effort: of |q1| + |q2| + |q3|
# and of |1 - q0| [s]
State = namedtuple(
    "State",
    "q0 q1 q2 q3 hx hy hz psi1 psi2 psi3 psi4 eta1 eta2 eta3 eta4 "
    "impulse_x impulse_y impulse_z attitude_effort scalar_effort",
)
Parameters = namedtuple(
    "Parameters",
    "q0 q1 q2 q3 hx hy hz psi1 psi2 psi3 psi4 "  # first state; eta starts at zero
    "mxx mxy mxz myy myz mzz "  # M^-1, the inverse of J - c0 c0^T
    "bx1 bx2 bx3 bx4 by1 by2 by3 by4 bz1 bz2 bz3 bz4 "  # M^-1 c0
    "cx1 cx2 cx3 cx4 cy1 cy2 cy3 cy4 cz1 cz2 cz3 cz4 "  # c0
    "k1 k2 k3 k4 d1 d2 d3 d4 "  # Lam^2 and 2 Xi Lam
    "orbit_rate disturbance_amplitude disturbance_frequency disturbance_offset "
    "kp kd ki kp_fast kd_fast ki_fast gamma c1 c2 beta lambda2 torque_limit rate_limit dbar "
    "rate_noise attitude_noise "
    "gain level on off time_constant decay torque thrust_x thrust_y thrust_z "  # modulators and thrusters
    "now next then "  # shares of a sample's thrust that come in that sample, the next and the one after
    "axx axy axz ayx ayy ayz azx azy azz "  # thruster axes in body axes, by columns
    "exhaust_arm",  # N m s of impulse per kg of propellant
)
# what the sampled control hands on: see `control.py`
Memory = namedtuple(
    "Memory",
    "integral_x integral_y integral_z command_x command_y command_z "
    "torque_x torque_y torque_z body_x body_y body_z "
    "filtered_x output_x age_x pulses_x shortest_x filtered_y output_y age_y pulses_y shortest_y "
    "filtered_z output_z age_z pulses_z shortest_z "
    "next_x next_y next_z then_x then_y then_z",
)


@physics
def initial(p, o):
    """First state: modes at rest in the body."""
    zero = 0.0
    return State(
        q0=p.q0, q1=p.q1, q2=p.q2, q3=p.q3, hx=p.hx, hy=p.hy, hz=p.hz, psi1=p.psi1, psi2=p.psi2, psi3=p.psi3,
        psi4=p.psi4,
        eta1=zero, eta2=zero, eta3=zero, eta4=zero, impulse_x=zero, impulse_y=zero, impulse_z=zero,
        attitude_effort=zero, scalar_effort=zero,
    )  # fmt: skip


@physics
def body_rate(s, p):
    """Inertial body rate [rad/s] from the momenta: w = M^-1 (h - c0 psi)."""
    return (
        (p.mxx * s.hx + p.mxy * s.hy + p.mxz * s.hz)
        - ((p.bx1 * s.psi1 + p.bx2 * s.psi2) + (p.bx3 * s.psi3 + p.bx4 * s.psi4)),
        (p.mxy * s.hx + p.myy * s.hy + p.myz * s.hz)
        - ((p.by1 * s.psi1 + p.by2 * s.psi2) + (p.by3 * s.psi3 + p.by4 * s.psi4)),
        (p.mxz * s.hx + p.myz * s.hy + p.mzz * s.hz)
        - ((p.bz1 * s.psi1 + p.bz2 * s.psi2) + (p.bz3 * s.psi3 + p.bz4 * s.psi4)),
    )


@physics
def modal_rates(s, wx, wy, wz, p):
    """Rates eta' [kg^(1/2) m/s] of the four modes from their momenta: psi - c0^T w, which defines psi."""
    return (
        s.psi1 - (p.cx1 * wx + p.cy1 * wy + p.cz1 * wz),
        s.psi2 - (p.cx2 * wx + p.cy2 * wy + p.cz2 * wz),
        s.psi3 - (p.cx3 * wx + p.cy3 * wy + p.cz3 * wz),
        s.psi4 - (p.cx4 * wx + p.cy4 * wy + p.cz4 * wz),
    )


@physics
def orbital_rate(s, wx, wy, wz, p):
    """Body rate relative to the orbital frame, which turns at -orbit_rate about its second axis.  (6)-(9)"""
    x, y, z = second_axis_in_body(s.q0, s.q1, s.q2, s.q3)
    return wx + p.orbit_rate * x, wy + p.orbit_rate * y, wz + p.orbit_rate * z


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state under the held torque m.body and the wave of the disturbance.  (1), (2), (5)"""
    wx, wy, wz = body_rate(s, p)
    eta1, eta2, eta3, eta4 = modal_rates(s, wx, wy, wz, p)
    wave = p.disturbance_amplitude * sin(p.disturbance_frequency * t)
    dq0, dq1, dq2, dq3 = quaternion_rates(s.q0, s.q1, s.q2, s.q3, wx, wy, wz)
    turn = 0.5 * p.orbit_rate  # the orbital frame's own rate multiplies q from the left: no matrix (9) is needed
    return State(
        q0=dq0 - turn * s.q2,
        q1=dq1 + turn * s.q3,
        q2=dq2 + turn * s.q0,
        q3=dq3 - turn * s.q1,
        hx=(m.body_x + wave) - (wy * s.hz - wz * s.hy),
        hy=(m.body_y + wave) - (wz * s.hx - wx * s.hz),
        hz=(m.body_z + wave) - (wx * s.hy - wy * s.hx),
        psi1=-p.d1 * eta1 - p.k1 * s.eta1,
        psi2=-p.d2 * eta2 - p.k2 * s.eta2,
        psi3=-p.d3 * eta3 - p.k3 * s.eta3,
        psi4=-p.d4 * eta4 - p.k4 * s.eta4,
        eta1=eta1,
        eta2=eta2,
        eta3=eta3,
        eta4=eta4,
        impulse_x=abs(m.torque_x),
        impulse_y=abs(m.torque_y),
        impulse_z=abs(m.torque_z),
        attitude_effort=abs(s.q1) + abs(s.q2) + abs(s.q3),
        scalar_effort=abs(1.0 - s.q0),
    )
