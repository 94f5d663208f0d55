"""Test planning: how many cases demonstrate a required probability, for one requirement and for those of a campaign."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from math import floor, log10
from operator import attrgetter
from typing import NamedTuple

from mc_engine.campaign.loading import Campaign
from mc_engine.numbers_in_text import chance_percent, counted, outward
from mc_engine.statistics.binomial import (
    acceptance_number,
    half_rate_share,
    lower_bound,
    pass_chance,
    smallest_interval_sample,
    smallest_sample,
)
from mc_engine.statistics.requirements import JOINT, SAMPLING_DESIGNS, joint_share
from mc_engine.statistics.time_uniform import smallest_sample as smallest_at_any_time

ROWS = 6  # failures 0 to 5
_RANKS = ("smallest and the largest", "2nd smallest and largest", "3rd smallest and largest")  # of two-sided intervals


class PlanRow(NamedTuple):
    """`cases` is the smallest number of cases that demonstrates the required probability with `failures` failures.

    demonstrated : probability that they demonstrate (lower confidence bound)
    half_rate : probability that this number of cases passes a system that fails half as often as allowed
    """

    failures: int
    cases: int
    demonstrated: float
    half_rate: float


def plan_row(share: float, confidence: float, failures: int) -> PlanRow:
    """The row for this number of failures: the smallest number of cases, and what it demonstrates."""
    cases = smallest_sample(share, confidence, failures)
    passes = pass_chance(cases, failures, half_rate_share(share))
    return PlanRow(failures, cases, lower_bound(cases - failures, cases, confidence), passes)


def table_lines(rows: Sequence[PlanRow], share: float, confidence: float) -> Iterator[str]:
    """A line per row, under a heading; with the cases that `run --until verdict` takes for as many failures."""
    heading = f"{'failures':>8}  {'cases':>9}  {'until verdict':>13}  {'demonstrated share':>18}"
    yield f"{heading}  passes at half the failures"
    digits = max(6, 3 - floor(log10(1.0 - share)))  # three of the share that may fail
    for row in rows:
        anytime = smallest_at_any_time(share, confidence, row.failures)
        shown = f"{outward(row.demonstrated, digits, up=False):.{digits}f}"
        yield f"{row.failures:>8}  {row.cases:>9}  {anytime:>13}  {shown:>18}  {chance_percent(row.half_rate)} %"


def interval_lines(share: float, confidence: float) -> Iterator[str]:
    """Cases for an interval between order statistics that holds the share (two-sided, Wilks)."""
    yield f"{'between the':>28}  {'cases':>9}"
    for rank, words in enumerate(_RANKS, start=1):
        yield f"{words:>28}  {smallest_interval_sample(share, confidence, rank):>9}"


def plan_lines(campaign: Campaign, failures: Sequence[int] = range(ROWS), two_sided: bool = False) -> Iterator[str]:
    """The plan of a campaign with requirements, line by line.

    failures : a row for each number of failed cases.  two_sided : also the cases for intervals by order statistics.
    """
    yield f"{campaign.name}: {counted(campaign.cases, 'case')}, design {campaign.design}"
    if campaign.design not in SAMPLING_DESIGNS:
        yield f'shares of cases of design "{campaign.design}" are no probabilities: what follows is for "mc"'
    required = attrgetter("share", "confidence")
    asked = sorted(campaign.requirements, key=required, reverse=True)
    for (share, confidence), group in groupby(asked, key=required):
        yield from _requirement_block(
            ", ".join(requirement.name for requirement in group), share, confidence, failures, campaign.cases, two_sided
        )
    if len(asked) > 1:
        yield from _joint_block(campaign, failures)


def _requirement_block(
    names: str, share: float, confidence: float, failures: Sequence[int], cases: int, two_sided: bool
) -> Iterator[str]:
    yield ""
    yield f"{names}: share {share:.14g} with confidence {confidence:.14g}"
    yield from table_lines([plan_row(share, confidence, number) for number in failures], share, confidence)
    yield _allowance(cases, share, confidence)
    if two_sided:
        yield from ["", *interval_lines(share, confidence)]


def _allowance(cases: int, share: float, confidence: float) -> str:
    """How many failures the campaign's own number of cases allows."""
    accepted = acceptance_number(cases, share, confidence)
    if accepted is None:
        needed = plan_row(share, confidence, 0).cases
        return f"  {cases:,} in the file are too few, even if none fails: {needed:,} are needed"
    just, half = (pass_chance(cases, accepted, true_share) for true_share in (share, half_rate_share(share)))
    return (
        f"  {cases:,} cases allow {counted(accepted, 'failure')}; they pass a system that just misses the share "
        f"with {chance_percent(just)} %, one that fails half as often as it may with {chance_percent(half)} %"
    )


def _joint_block(campaign: Campaign, failures: Sequence[int]) -> Iterator[str]:
    """All requirements: the cases that show each, the joint share, and each with the confidence shared."""
    asked = campaign.requirements
    confidence = min(requirement.confidence for requirement in asked)
    share = joint_share([requirement.share for requirement in asked])
    among = len(asked) + (share is not None)  # as the joint verdict shares it
    yield ""
    yield f"every requirement: if each passes, all are met with confidence {confidence:.14g} (Berger 1982)"
    yield f"{'failures':>8}  {'cases':>9}  cases with the confidence shared among {among} (Bonferroni)"
    for number in failures:
        each = max(plan_row(requirement.share, requirement.confidence, number).cases for requirement in asked)
        shared = max(
            plan_row(requirement.share, 1.0 - (1.0 - requirement.confidence) / among, number).cases
            for requirement in asked
        )
        yield f"{number:>8}  {each:>9}  {shared}"
    if share is not None:
        yield from _requirement_block(JOINT, share, confidence, failures, campaign.cases, two_sided=False)
