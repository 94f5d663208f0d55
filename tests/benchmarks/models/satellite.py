"""Attitude of a flexible satellite under a robust PID law, 18 states: rate, quaternion, modes, integral.  SI.

The control acts without a modulator, so the right-hand side is smooth but for its gain switch: a measure of speed
for a long state.

H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical Engineering 24 (3) (2022), eqs (1)-(17); gains of its
table 1, data of its tables 10 and 11.
"""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import fma, minimum, physics, sin, sqrt, where
from mc_engine.model import Field, FixedStep, Parameter, Setting, at_end, inputs, metrics, model, outputs, states

COUPLING = ((7.0, -1.2, 1.1, 1.2), (1.2, 0.9, 2.5, -2.6), (2.2, -1.7, -0.8, -1.1))  # kg^(1/2) m
FREQUENCY = (0.7, 1.0, 1.8, 2.5)  # rad/s
DAMPING = (0.0056, 0.0086, 0.0128, 0.0252)
ORBITAL_RATE = 1.078e-3  # rad/s
KP, KD, KI, C1, C2, GAMMA = 5.0, 20.0, 0.1, 0.025, 0.005, 1.5
LARGEST_TORQUE, LARGEST_RATE = 0.5, 0.1  # N m, rad/s
DELTA_P, DELTA_I, DELTA_D = 2.0, 5.0, 10.0
DISTURBANCE = 2.8867513459481287e-4  # N m
FIRST_QUATERNION = (0.4, 0.2, 0.4, -0.8)  # scalar first, body from orbit

Inputs = inputs(
    jx_kg_m2=Parameter(100.0, "moment of inertia, x", unit="kg m^2"),
    jy_kg_m2=Parameter(75.0, "moment of inertia, y", unit="kg m^2"),
    jz_kg_m2=Parameter(50.0, "moment of inertia, z", unit="kg m^2"),
    offset=Parameter(0.5, "constant part of the disturbance, of its amplitude", unit=""),
    duration_s=Setting(200.0, "length of the flight"),
    step_s=Setting(0.01, "step"),
)
NAMES = "wx wy wz q0 q1 q2 q3 a1 a2 a3 a4 b1 b2 b3 b4 nx ny nz".split()
State = states(**{name: Field(f"state {name} in SI", unit="") for name in NAMES})
Outputs = outputs(error=Field("vector part of the quaternion", unit=""))
Metrics = metrics(final_error=at_end("error", "vector part of the quaternion in the end", unit=""))
Parameters = namedtuple("Parameters", "jx jy jz ixx iyy izz ixy ixz iyz offset")


def prepare(inputs, settings, refusals):
    """Moments of inertia, and the inverse of inertia less coupling, symmetric."""
    c = np.array(COUPLING)
    j = np.stack([inputs.jx, inputs.jy, inputs.jz], axis=-1)
    inverse = np.linalg.inv(j[:, :, None] * np.eye(3) - c @ c.T)
    names = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
    return {**vars(inputs), **{name: inverse[:, i, k] for name, (i, k) in names.items()}}


@physics
def initial():
    """A large turn ahead, the modes at rest."""
    q0, q1, q2, q3 = FIRST_QUATERNION
    return State(
        wx=0.07, wy=-0.05, wz=-0.04, q0=q0, q1=q1, q2=q2, q3=q3, a1=0.0, a2=0.0, a3=0.0, a4=0.0,
        b1=0.0, b2=0.0, b3=0.0, b4=0.0, nx=0.0, ny=0.0, nz=0.0,
    )  # fmt: skip


# products and sums are fused as a compiler fuses them with -ffast-math: the C++ that this model is measured against


@physics
def _along(c, x1, x2, x3, x4, total):
    return fma(c[0], x1, fma(c[1], x2, fma(c[2], x3, fma(c[3], x4, total))))


@physics
def _dot(ax, ay, az, bx, by, bz):
    return fma(ax, bx, fma(ay, by, az * bz))


@physics
def _torque(s):
    """Control torque [N m], eqs (11), (13)-(16), and what part of it the limit of its size leaves."""
    fast = _dot(s.wx, s.wy, s.wz, s.wx, s.wy, s.wz) >= LARGEST_RATE * LARGEST_RATE
    kd, kp = where(fast, -DELTA_D * KD, -KD), where(fast, -KP / DELTA_P, -KP)
    ki = where(fast, -KI / DELTA_I, -KI)
    x = fma(kd, s.wx, fma(kp, s.q1, ki * fma(-GAMMA, s.q1 - FIRST_QUATERNION[1], s.nx)))
    y = fma(kd, s.wy, fma(kp, s.q2, ki * fma(-GAMMA, s.q2 - FIRST_QUATERNION[2], s.ny)))
    z = fma(kd, s.wz, fma(kp, s.q3, ki * fma(-GAMMA, s.q3 - FIRST_QUATERNION[3], s.nz)))
    size = sqrt(fma(x, x, fma(y, y, fma(z, z, 1e-300))))
    return x, y, z, minimum(1.0, LARGEST_TORQUE / size)


@physics
def rhs(t, s, p):
    """Derivative of the state: eqs (1), (2) solved for the rates, (5)-(9), and the integral in (13)."""
    ux, uy, uz, share = _torque(s)
    td = DISTURBANCE * (sin(t) + p.offset)
    c1, c2, c3 = COUPLING
    hx = _along(c1, s.b1, s.b2, s.b3, s.b4, p.jx * s.wx)
    hy = _along(c2, s.b1, s.b2, s.b3, s.b4, p.jy * s.wy)
    hz = _along(c3, s.b1, s.b2, s.b3, s.b4, p.jz * s.wz)
    e1 = fma(2.0 * DAMPING[0] * FREQUENCY[0], s.b1, FREQUENCY[0] * FREQUENCY[0] * s.a1)
    e2 = fma(2.0 * DAMPING[1] * FREQUENCY[1], s.b2, FREQUENCY[1] * FREQUENCY[1] * s.a2)
    e3 = fma(2.0 * DAMPING[2] * FREQUENCY[2], s.b3, FREQUENCY[2] * FREQUENCY[2] * s.a3)
    e4 = fma(2.0 * DAMPING[3] * FREQUENCY[3], s.b4, FREQUENCY[3] * FREQUENCY[3] * s.a4)
    tx = fma(s.wz, hy, fma(-s.wy, hz, _along(c1, e1, e2, e3, e4, fma(share, ux, td))))
    ty = fma(s.wx, hz, fma(-s.wz, hx, _along(c2, e1, e2, e3, e4, fma(share, uy, td))))
    tz = fma(s.wy, hx, fma(-s.wx, hy, _along(c3, e1, e2, e3, e4, fma(share, uz, td))))
    dx = _dot(p.ixx, p.ixy, p.ixz, tx, ty, tz)
    dy = _dot(p.ixy, p.iyy, p.iyz, tx, ty, tz)
    dz = _dot(p.ixz, p.iyz, p.izz, tx, ty, tz)
    # rate relative to the orbital frame, eqs (7)-(9)
    rx = fma(2.0 * ORBITAL_RATE, fma(s.q1, s.q2, s.q0 * s.q3), s.wx)
    ry = fma(ORBITAL_RATE, fma(-s.q1, s.q1, fma(s.q2, s.q2, fma(-s.q3, s.q3, s.q0 * s.q0))), s.wy)
    rz = fma(2.0 * ORBITAL_RATE, fma(s.q2, s.q3, -(s.q0 * s.q1)), s.wz)
    return State(
        wx=dx,
        wy=dy,
        wz=dz,
        q0=-0.5 * _dot(s.q1, s.q2, s.q3, rx, ry, rz),
        q1=0.5 * _dot(-s.q3, s.q0, s.q2, ry, rx, rz),
        q2=0.5 * _dot(-s.q1, s.q0, s.q3, rz, ry, rx),
        q3=0.5 * _dot(-s.q2, s.q0, s.q1, rx, rz, ry),
        a1=s.b1,
        a2=s.b2,
        a3=s.b3,
        a4=s.b4,
        b1=fma(-c1[0], dx, fma(-c2[0], dy, fma(-c3[0], dz, -e1))),
        b2=fma(-c1[1], dx, fma(-c2[1], dy, fma(-c3[1], dz, -e2))),
        b3=fma(-c1[2], dx, fma(-c2[2], dy, fma(-c3[2], dz, -e3))),
        b4=fma(-c1[3], dx, fma(-c2[3], dy, fma(-c3[3], dz, -e4))),
        nx=fma(C1, s.wx, C2 * s.q1),
        ny=fma(C1, s.wy, C2 * s.q2),
        nz=fma(C1, s.wz, C2 * s.q3),
    )


@physics
def observe(s):
    """Size of the vector part of the quaternion."""
    return Outputs(error=sqrt(s.q1 * s.q1 + s.q2 * s.q2 + s.q3 * s.q3))


MODEL = model(
    name="satellite",
    title="Turn of a flexible satellite",
    source="H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical Engineering 24 (3) (2022)",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep("step", "duration"),
    kernel_parameters=Parameters,
    prepare=prepare,
    initial=initial,
    rhs=rhs,
    observe=observe,
)
