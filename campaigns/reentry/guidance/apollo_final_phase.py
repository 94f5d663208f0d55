"""The stored table of the Apollo final phase, and its rows for `reference_table`.

R. Morth, Reentry guidance for Apollo, MIT Instrumentation Laboratory R-532 (1966), with the numbers flown, in SI:
speed [m/s], climb [m/s], drag [m/s^2], range to go [km], and the influence on the range of drag [km s^2/m], of the
climb [km s/m] and of the lift-to-drag ratio [km].
"""

import numpy as np

FLOWN = (
    (303.0, -210.5, 12.538, 4.0, -0.211, 0.01524, 22.5),
    (641.0, -219.1, 18.288, 16.5, -0.337, 0.02176, 40.4),
    (1195.4, -211.4, 24.841, 40.9, -0.549, 0.04277, 80.2),
    (1918.7, -185.5, 28.621, 85.7, -0.857, 0.08786, 179.1),
    (2600.2, -150.2, 30.023, 139.6, -1.202, 0.15063, 347.1),
    (3078.8, -126.7, 31.181, 185.0, -1.441, 0.20604, 522.6),
    (4271.5, -107.2, 36.180, 316.5, -2.008, 0.37301, 610.0),
    (4861.9, -126.7, 38.161, 389.5, -2.190, 0.46683, 862.1),
    (5595.2, -172.4, 36.698, 494.1, -3.011, 0.60652, 1264.4),
    (6348.7, -238.0, 29.078, 637.6, -3.939, 0.81116, 1815.9),
    (7037.8, -282.4, 8.565, 934.9, -12.280, 1.32155, 2565.0),
    (7162.8, -249.8, 1.951, 1190.8, -20.379, 1.85078, 2792.8),
)
REFERENCE_LIFT_TO_DRAG = 0.18
OVERCONTROL = 4.0


def influence_rows() -> tuple[np.ndarray, list[np.ndarray]]:
    """(falling speed [m/s], columns of `reference_table.Influence` in SI), finely resampled between the flown rows."""
    rows = np.array(FLOWN)[::-1]
    speed = np.union1d(np.linspace(rows[-1, 0], rows[0, 0], 4001), rows[:, 0])[::-1]
    columns = [np.interp(-speed, -rows[:, 0], column) for column in rows.T[1:]]
    scales = (1.0, 1.0, 1e3, 1e3, 1e3, 1e3)
    zero = np.zeros_like(speed)
    return speed, [*(scale * column for scale, column in zip(scales, columns, strict=True)), zero, zero]
