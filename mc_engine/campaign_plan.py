"""What a campaign's requirements take: cases for each, for all at once, and what the file's own number allows."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from mc_engine.campaign import Campaign
from mc_engine.campaign_parts import Requirement
from mc_engine.plan import ROWS, acceptance_number, half_rate_share, interval_lines, plan_row, table_lines
from mc_engine.statistics.binomial import pass_chance
from mc_engine.statistics.requirements import JOINT, SAMPLING_DESIGNS, joint_share


def plan_lines(campaign: Campaign, failures: Sequence[int] = range(ROWS), two_sided: bool = False) -> Iterator[str]:
    """The plan of a campaign with requirements, line by line.

    failures : a row for each number of failed cases.  two_sided : also the cases for intervals by order statistics.
    """
    yield f"{campaign.name}: {campaign.cases:,} cases, design {campaign.design}"
    if campaign.design not in SAMPLING_DESIGNS:
        yield f'shares of cases of design "{campaign.design}" are no probabilities: what follows is for "mc"'
    asked = sorted(campaign.requirements, key=_wanted, reverse=True)
    for (share, confidence), group in groupby(asked, key=_wanted):
        yield from _block(", ".join(one.name for one in group), share, confidence, failures, campaign.cases, two_sided)
    if len(asked) > 1:
        yield from _together(campaign, failures)


def _wanted(requirement: Requirement) -> tuple[float, float]:
    return requirement.share, requirement.confidence


def _block(
    names: str, share: float, confidence: float, failures: Sequence[int], cases: int, two_sided: bool
) -> Iterator[str]:
    yield ""
    yield f"{names}: share {share:.10g} with confidence {confidence:.10g}"
    yield from table_lines([plan_row(share, confidence, one) for one in failures], share, confidence)
    yield _allowance(cases, share, confidence)
    if two_sided:
        yield from ["", *interval_lines(share, confidence)]


def _allowance(cases: int, share: float, confidence: float) -> str:
    """What the file's own number of cases comes to."""
    accepted = acceptance_number(cases, share, confidence)
    if accepted is None:
        needed = plan_row(share, confidence, 0).cases
        return f"  {cases:,} in the file are too few, even if none fails: {needed:,} are needed"
    just, half = (pass_chance(cases, accepted, one) for one in (share, half_rate_share(share)))
    return (
        f"  {cases:,} cases allow {accepted:,} failures; they pass a system that just misses the share with "
        f"{100.0 * just:.1f} %, one that fails half as often as it may with {100.0 * half:.1f} %"
    )


def _together(campaign: Campaign, failures: Sequence[int]) -> Iterator[str]:
    """All requirements: the cases that show each, the joint share, and each with the confidence shared."""
    asked = campaign.requirements
    confidence = min(one.confidence for one in asked)
    share = joint_share([one.share for one in asked])
    among = len(asked) + (share is not None)  # as the joint verdict shares it
    yield ""
    yield f"every requirement: if each passes, all are met with confidence {confidence:.10g} (Berger 1982)"
    yield f"{'failures':>8}  {'cases':>9}  cases with the confidence shared among {among} (Bonferroni)"
    for number in failures:
        each = max(plan_row(one.share, one.confidence, number).cases for one in asked)
        shared = max(plan_row(one.share, 1.0 - (1.0 - one.confidence) / among, number).cases for one in asked)
        yield f"{number:>8}  {each:>9}  {shared}"
    if share is not None:
        yield from _block(JOINT, share, confidence, failures, campaign.cases, two_sided=False)
