"""Explicit Runge-Kutta pairs as tables: nodes, sparse rows, and two error estimates.

A step of any of them is the same short loop, see `adaptive_step`.
"""

from dataclasses import dataclass

import numpy as np

Row = dict[int, float]  # stage -> weight; stages left out have none


@dataclass(frozen=True)
class RungeKuttaPair:
    """A method and its embedded error estimates.

    order : of the step.  nodes : c_2 ... c_s.  rows : a_ij of stages 2 ... s.  weights : b_j.
    error, second_error : weights of two estimates of the step's error over its length; the second damps the
        first where both are given (Hairer's rule for DOP853), else it is empty.
    """

    order: int
    nodes: tuple[float, ...]
    rows: tuple[Row, ...]
    weights: Row
    error: Row
    second_error: Row

    def tables(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(nodes, starts, columns, weights) for the kernel; the step's end is one more stage at node 1."""
        rows = [{}, *self.rows, self.weights, self.error, self.second_error]
        starts = np.cumsum([0, *(len(row) for row in rows)])
        columns = np.array([stage for row in rows for stage in row], dtype=np.int64)
        weights = np.array([weight for row in rows for weight in row.values()], dtype=np.float64)
        return np.array([0.0, *self.nodes, 1.0]), starts.astype(np.int64), columns, weights


# E. Hairer, S. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., section II.5, and the
# authors' code DOP853: twelve stages, order 8, error estimates of orders 5 and 3.
DOP853 = RungeKuttaPair(
    order=8,
    nodes=(
        0.05260015195876773,
        0.0789002279381516,
        0.1183503419072274,
        0.2816496580927726,
        0.3333333333333333,
        0.25,
        0.3076923076923077,
        0.6512820512820513,
        0.6,
        0.8571428571428571,
        1.0,
    ),
    rows=(
        {0: 0.05260015195876773},
        {0: 0.0197250569845379, 1: 0.0591751709536137},
        {0: 0.02958758547680685, 2: 0.08876275643042054},
        {0: 0.2413651341592667, 2: -0.8845494793282861, 3: 0.924834003261792},
        {0: 0.037037037037037035, 3: 0.17082860872947386, 4: 0.12546768756682242},
        {0: 0.037109375, 3: 0.17025221101954405, 4: 0.06021653898045596, 5: -0.017578125},
        {
            0: 0.03709200011850479,
            3: 0.17038392571223998,
            4: 0.10726203044637328,
            5: -0.015319437748624402,
            6: 0.008273789163814023,
        },
        {
            0: 0.6241109587160757,
            3: -3.3608926294469414,
            4: -0.868219346841726,
            5: 27.59209969944671,
            6: 20.154067550477894,
            7: -43.48988418106996,
        },
        {
            0: 0.47766253643826434,
            3: -2.4881146199716677,
            4: -0.590290826836843,
            5: 21.230051448181193,
            6: 15.279233632882423,
            7: -33.28821096898486,
            8: -0.020331201708508627,
        },
        {
            0: -0.9371424300859873,
            3: 5.186372428844064,
            4: 1.0914373489967295,
            5: -8.149787010746927,
            6: -18.52006565999696,
            7: 22.739487099350505,
            8: 2.4936055526796523,
            9: -3.0467644718982196,
        },
        {
            0: 2.273310147516538,
            3: -10.53449546673725,
            4: -2.0008720582248625,
            5: -17.9589318631188,
            6: 27.94888452941996,
            7: -2.8589982771350235,
            8: -8.87285693353063,
            9: 12.360567175794303,
            10: 0.6433927460157636,
        },
    ),
    weights={
        0: 0.054293734116568765,
        5: 4.450312892752409,
        6: 1.8915178993145003,
        7: -5.801203960010585,
        8: 0.3111643669578199,
        9: -0.1521609496625161,
        10: 0.20136540080403034,
        11: 0.04471061572777259,
    },
    error={
        0: 0.01312004499419488,
        5: -1.2251564463762044,
        6: -0.4957589496572502,
        7: 1.6643771824549864,
        8: -0.35032884874997366,
        9: 0.3341791187130175,
        10: 0.08192320648511571,
        11: -0.022355307863886294,
    },
    second_error={
        0: -0.18980075407240762,
        5: 4.450312892752409,
        6: 1.8915178993145003,
        7: -5.801203960010585,
        8: -0.4226823213237919,
        9: -0.1521609496625161,
        10: 0.20136540080403034,
        11: 0.02265179219836082,
    },
)

# J. Dormand, P. Prince, Journal of Computational and Applied Mathematics 6 (1980) 19-26: seven stages, the last
# one the first of the next step, order 5 with an estimate of order 4.
DP54 = RungeKuttaPair(
    order=5,
    nodes=(1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0),
    rows=(
        {0: 1 / 5},
        {0: 3 / 40, 1: 9 / 40},
        {0: 44 / 45, 1: -56 / 15, 2: 32 / 9},
        {0: 19372 / 6561, 1: -25360 / 2187, 2: 64448 / 6561, 3: -212 / 729},
        {0: 9017 / 3168, 1: -355 / 33, 2: 46732 / 5247, 3: 49 / 176, 4: -5103 / 18656},
    ),
    weights={0: 35 / 384, 2: 500 / 1113, 3: 125 / 192, 4: -2187 / 6784, 5: 11 / 84},
    error={
        0: 71 / 57600,
        2: -71 / 16695,
        3: 71 / 1920,
        4: -17253 / 339200,
        5: 22 / 525,
        6: -1 / 40,
    },
    second_error={},
)

PAIRS = {"dop853": DOP853, "dp54": DP54}
LARGEST_STAGES = 13  # room in a kernel: the stages of the largest pair and the end of its step
