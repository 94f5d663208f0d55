"""The search of `mc-engine tune`: NSGA-II of pymoo, through its ask-and-tell interface.

K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, IEEE Transactions on Evolutionary Computation 6 (2002), 182-197; its
constraint handling: a feasible candidate beats any other, of two infeasible ones the one with the smaller violation.
"""

from importlib.util import find_spec
from typing import Any

import numpy as np

from mc_engine.campaign.tuning_section import Tuning
from mc_engine.errors import EngineError
from mc_engine.extras import how_to_install
from mc_engine.studies.candidates import Scores

_WORST = 1e30  # stands for an objective without a number; such a candidate is infeasible anyway
_DEAD = 1e15  # violation of a candidate without a number for every metric
_CROSSOVER_INDEX, _MUTATION_INDEX = 15.0, 20.0  # Deb's distribution indices: how near children stay to their parents


class GeneticSearch:
    """One search: call `ask` and `tell` in turn.  The same seed and scores give the same candidates."""

    def __init__(self, tuning: Tuning, population: int, seed: int):
        """EngineError in a sentence if pymoo is not installed."""
        if find_spec("pymoo") is None:
            raise EngineError(f"tuning needs pymoo, which is not installed; {how_to_install('tune')}")
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.problem import Problem
        from pymoo.operators.crossover.sbx import SBX
        from pymoo.operators.mutation.pm import PM
        from pymoo.operators.sampling.lhs import LHS

        n_tuned = len(tuning.parameters)
        self._signs = tuning.signs
        self._problem = Problem(
            n_var=n_tuned,
            n_obj=len(tuning.objectives),
            n_ieq_constr=len(tuning.constraints) + 1,
            xl=np.array([parameter.lower for parameter in tuning.parameters]),
            xu=np.array([parameter.upper for parameter in tuning.parameters]),
        )
        self._algorithm = NSGA2(
            pop_size=population,
            sampling=LHS(),
            crossover=SBX(prob=tuning.crossover, eta=_CROSSOVER_INDEX),
            mutation=PM(prob=1.0, prob_var=tuning.mutation or 1.0 / n_tuned, eta=_MUTATION_INDEX),
        )
        self._algorithm.setup(self._problem, seed=seed, termination=("n_gen", 10**9), verbose=False)
        self._asked: Any = None

    def ask(self) -> np.ndarray:
        """The next generation, float64[n, n_tuned]; no rows where the search finds no new candidate."""
        self._asked = self._algorithm.ask()
        if self._asked is None or not len(self._asked):
            return np.empty((0, self._problem.n_var))
        return np.array(self._asked.get("X"), dtype=np.float64)

    def tell(self, scores: Scores) -> None:
        """Report the scores of the candidates of the last `ask`."""
        from pymoo.core.evaluator import Evaluator
        from pymoo.problems.static import StaticProblem

        dead = ~np.isfinite(scores.violation)
        objectives = np.where(np.isfinite(scores.objectives), scores.objectives * self._signs, _WORST)
        excess = np.column_stack([np.nan_to_num(scores.excess, nan=0.0), np.where(dead, _DEAD, 0.0)])
        Evaluator().eval(StaticProblem(self._problem, F=objectives, G=excess), self._asked)
        self._algorithm.tell(infills=self._asked)


def non_dominated(values: np.ndarray) -> np.ndarray:
    """bool[n], true where no other row is as small in every column and smaller in one; of equal rows the first.

    values : float64[n, n_objectives].  Rows that are not finite are never true.
    """
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    best = np.zeros(len(values), dtype=bool)
    usable = np.flatnonzero(np.isfinite(values).all(axis=1))
    rows = usable[np.unique(values[usable], axis=0, return_index=True)[1]]
    if rows.size:
        best[rows[NonDominatedSorting().do(values[rows], only_non_dominated_front=True)]] = True
    return best


def hypervolume(values: np.ndarray, reference: np.ndarray) -> float:
    """Volume between `reference` and the rows that are below it in every column; 0 where there are none.

    values : float64[n, n_objectives];  reference : float64[n_objectives].
    """
    from pymoo.indicators.hv import HV

    return float(HV(ref_point=reference)(values))
