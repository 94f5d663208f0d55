"""A campaign as a limit state function: from standard normal numbers to the margin of a case to a requirement.

Each dispersed input has one independent standard normal number u.  The campaign's correlations are applied to the
probabilities Phi(u), and the input is the quantile.  So the cases have the distribution that the campaign file
describes.

Noise in flight is addressed by case numbers.  Here they begin at FIRST_NOISE, so that no case has the same noise as a
case of the campaign's own runs.
"""

import os
from collections.abc import Callable

import numpy as np
from scipy.special import ndtr, ndtri

from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.parts import Requirement, rank_pairs
from mc_engine.errors import CampaignError, Problem
from mc_engine.flight.chunks import fly_in_threads
from mc_engine.model.faults import naming_faults
from mc_engine.sampling.correlation import correlated, gaussian_copula
from mc_engine.sampling.designs import RANDOM
from mc_engine.sampling.distributions import Constant, Discrete, Empirical, quantiles
from mc_engine.statistics.limits import inside_limits
from mc_engine.statistics.worst import Limits
from mc_engine.status import OK, STATUS_NAME
from mc_engine.suggestions import hint, listed

FIRST_NOISE = 2**51
AT_LIMIT = float(np.nextafter(0.0, 1.0))  # margin of a case right at its limit: inside, as little as can be
# columns of a rare event's cases beside those named by inputs and the metric, and those that every table has
OWN_COLUMNS = ("level", "noise_id", "weight", "failed", "margin")


class LimitState:
    """The function margin(u, noise) of a campaign and one of its requirements, which keeps the results of its cases.

    names : the dispersed inputs, one column of u each.  status, metric : of every case flown, in order.
    metric_field : the metric of the requirement, as the model declares it.
    watch : called before each flight with the number of cases flown and failed so far; it may raise.
    """

    def __init__(
        self,
        campaign: Campaign,
        requirement: Requirement,
        workers: int | None = None,
        watch: Callable[[int, int], None] | None = None,
    ):
        refuse_unmappable(campaign, requirement)
        self.campaign, self.requirement = campaign, requirement
        self.metric_field = next(field for field in campaign.model.metrics if field.name == requirement.metric)
        self.names = [
            dispersion.name for dispersion in campaign.dispersions if not isinstance(dispersion.distribution, Constant)
        ]
        self.status: list[np.ndarray] = []
        self.metric: list[np.ndarray] = []
        self._workers, self._watch = workers or os.cpu_count() or 1, watch
        self._n = self._failed = 0

    def __call__(self, u: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """float64[n]: distance inside the nearer limit, in the metric's unit; -inf for a case without a number."""
        if self._watch is not None:
            self._watch(self._n, self._failed)
        requirement, ids = self.requirement, FIRST_NOISE + noise
        with naming_faults(self.campaign.model_reference, "a case"):
            flown = fly_in_threads(self.campaign, self.inputs(u), ids, ["status", requirement.metric], self._workers)
        status, metric = flown["status"], flown[requirement.metric]
        able = (status == STATUS_NAME[OK]) & np.isfinite(metric)
        with np.errstate(invalid="ignore"):
            margin = np.where(able, Limits(requirement.at_most, requirement.at_least).distances(metric), -np.inf)
        # a case right at its limit is inside: the engine's word for it, safe from rounding of the difference
        inside = able & inside_limits(metric, requirement.at_least, requirement.at_most)
        margin = np.where(inside, np.maximum(margin, AT_LIMIT), np.minimum(margin, 0.0))
        self.status.append(status)
        self.metric.append(metric)
        self._n, self._failed = self._n + len(u), self._failed + int(np.count_nonzero(~inside))
        return margin

    def shares(self, u: np.ndarray) -> list[np.ndarray]:
        """One column float64[n] per name: the share of its distribution that lies below each input."""
        columns = [ndtr(column) for column in u.T]
        return correlated(gaussian_copula, columns, self.names, rank_pairs(self.campaign.correlations))

    def sigmas(self, u: np.ndarray) -> np.ndarray:
        """float64[n, n_names]: each input as the standard normal number of the same share, its distance in sigmas."""
        ends = 2.0**-54, 1.0 - 2.0**-53
        return np.column_stack([ndtri(np.clip(column, *ends)) for column in self.shares(u)])

    def inputs(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """A column per dispersion of the campaign, in declared units."""
        shares = dict(zip(self.names, self.shares(u), strict=True))
        table = {}
        for dispersion in self.campaign.dispersions:
            assert dispersion.distribution is not None  # a loaded campaign has one for every random design
            table[dispersion.name] = quantiles(
                dispersion.distribution, shares.get(dispersion.name, np.full(len(u), 0.5))
            )
        return table


def chosen_requirement(campaign: Campaign, name: str | None) -> Requirement:
    """The requirement of that name, or the only one."""
    names = [requirement.name for requirement in campaign.requirements]
    if not names:
        message = "is missing: a rare event is a requirement not met; add one with a metric and a limit"
    elif name is None and len(names) > 1:
        message = f"there are several; choose one of {listed(names)}, on the command line by `--requirement`"
    elif name is not None and name not in names:
        message = f'"{name}" is not a requirement of this campaign{hint(name, names)}'
    else:
        return next(requirement for requirement in campaign.requirements if name in (None, requirement.name))
    raise CampaignError(campaign.name, [Problem("requirement", message)])


def refuse_unmappable(campaign: Campaign, requirement: Requirement) -> None:
    """CampaignError unless inputs map continuously from standard normal numbers, and no name is one of OWN_COLUMNS."""
    problems = []
    if campaign.upstream is not None or campaign.first is not None:
        message = "takes inputs from another run, whose cases cannot be moved towards failure; give distributions"
        problems.append(Problem("inputs.from", message))
    if campaign.design not in RANDOM:
        message = f'"{campaign.design}" gives its cases no probabilities; use {listed(RANDOM)}'
        problems.append(Problem("campaign.design", message))
    for dispersion in campaign.dispersions if not problems else ():
        if isinstance(dispersion.distribution, Discrete):
            message = (
                "has no values between its own, so no chain can move through it; make one campaign a value, and add "
                "up their probabilities by weight"
            )
            problems.append(Problem(f"dispersion.{dispersion.name}", message))
        if isinstance(dispersion.distribution, Empirical):
            message = "measured values say nothing beyond the largest of them; give a distribution fitted to them"
            problems.append(Problem(f"dispersion.{dispersion.name}", message))
    if not problems and all(isinstance(dispersion.distribution, Constant) for dispersion in campaign.dispersions):
        problems.append(Problem("dispersion", "nothing is dispersed, so there is no probability to estimate"))
    named = [(f"dispersion.{dispersion.name}", dispersion.name) for dispersion in campaign.dispersions]
    for place, name in [*named, (f"requirement.{requirement.name}.metric", requirement.metric)]:
        if name in OWN_COLUMNS:
            message = f'"{name}" is the name of a column of every rare event; give it another name in the model'
            problems.append(Problem(place, message))
    if problems:
        raise CampaignError(campaign.name, problems)
