"""The headline box: which requirements are met, with what confidence, and the key results."""

from collections.abc import Iterable, Iterator
from math import tau

import numpy as np

from mc_engine.model.figures import MapFigure
from mc_engine.statistics import Summary, Verdict
from mc_engine.statistics.designed_indices import IN_BLOCKS
from mc_engine.statistics.requirements import EXTENSIBLE
from mc_engine.statistics.worst import Limits
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store.run_files import NO_NOMINAL
from mc_engine.units import UNITS
from reports.document.blocks import Card
from reports.run.flown import URGENCY, Flown
from reports.sections.convergence import MUCH
from reports.sections.requirement_tables import demonstrated_text
from reports.sections.tables import TONES, limit_text
from reports.text.numbers import capitalised, count, given_percent, limit_number, number, percent, percentile, with_unit

MOST_COSTS = 4
NEAR_A_TURN = 0.95  # of a full turn, between the smallest and the largest angle


def verdict_cards(flown: Flown) -> tuple[Card, ...]:
    """One card per requirement, failed ones first."""
    verdicts = sorted(flown.verdicts, key=lambda verdict: URGENCY.index(verdict.outcome))
    joint = [] if flown.joint is None else [flown.joint]
    return tuple(_verdict_card(flown, verdict) for verdict in [*verdicts, *joint])


def _verdict_card(flown: Flown, verdict: Verdict) -> Card:
    asked = "inside every limit"
    if verdict.metric:
        asked = f"{flown.words(verdict.metric)} {limit_text(verdict, flown.unit(verdict.metric))}"
    wanted = f"{given_percent(verdict.share)} of cases, {given_percent(verdict.confidence)} confidence"
    counted = f"{count(verdict.passed)} of {count(verdict.tried)} cases inside"
    return Card(
        label=verdict.name,
        answer=verdict.outcome,
        detail=f"{asked} for {wanted}: {counted}{_because(flown, verdict)}.",
        tone=TONES[verdict.outcome],
    )


def _because(flown: Flown, verdict: Verdict) -> str:
    """The counts behind a verdict, as the end of a sentence."""
    lost = f", {count(verdict.no_number)} of the others without a number" if verdict.no_number else ""
    if verdict.lower is None or verdict.upper is None:
        return f"{lost}; " + (
            "no case was flown" if not verdict.tried else "the cases of this design are not a random sample"
        )
    if verdict.failing:
        return f"{lost}; {verdict.remark}"
    if verdict.outcome == "fail":
        return f"{lost}; the true probability is at most {percent(verdict.upper, up=True)}"
    but = f", but {verdict.remark}" if verdict.remark else ""
    return f"{lost}; the true probability is at least {percent(verdict.lower)}{but}{_further(flown, verdict)}"


def _further(flown: Flown, verdict: Verdict) -> str:
    """How many cases would demonstrate it: of this run extended, or of a new one where this one cannot be extended."""
    if not verdict.needed:
        return ""
    cases = f"{count(verdict.needed)} cases"
    if flown.design in EXTENSIBLE and not flown.manifest.get("upstream"):
        return f"; {cases} without a further failure would demonstrate it"
    return f"; a new run of {cases} with no more failures would demonstrate it"


def cost_cards(flown: Flown) -> tuple[Card, ...]:
    """The key results: the metrics of failed requirements, those that the model maps, then others that matter."""
    failed = [verdict.metric for verdict in flown.verdicts if verdict.outcome == "fail"]
    mapped = [figure.metric for figure in flown.figures if isinstance(figure, MapFigure)]
    names = [name for name in dict.fromkeys([*failed, *mapped, *flown.key_metrics]) if name in flown.summaries]
    names.sort(key=lambda name: flown.summaries[name].n_used == 0)  # what no case has comes last
    return tuple(_cost_cards(flown, names[:MOST_COSTS]))


def _cost_cards(flown: Flown, names: list[str]) -> Iterator[Card]:
    for name in names:
        summary, unit = flown.summaries[name], flown.unit(name)
        used = f"{count(summary.n_used)} of {count(summary.n_tried)} cases"
        if summary.minimum is None or summary.maximum is None:
            yield Card(flown.words(name), "no number", f"{used} have one", "open")
            continue
        if summary.constant and summary.n_used > 1:
            yield Card(flown.words(name), *_same(flown, name, used))
            continue
        spread, limits = summary.spread, flown.limits(name)
        median, nominal = summary.at(0.5), flown.nominal_value(name)
        rest = [f"nominal {number(nominal, 4, spread)}"] if nominal is not None else []
        rest += [f"median {number(median.value, 4, spread)}"] if median else []
        demonstrated = _demonstrated(flown, name, limits)
        if limits == Limits() or limits.two_sided:
            low, high = (number(end, 4, spread) for end in (summary.minimum, summary.maximum))
            rest += [f"demonstrated {demonstrated}"] if demonstrated else _tails(flown, summary)
            answer = f"{low} to {with_unit(high, unit)} in the cases flown{_against(limits, unit)}"
            yield Card(flown.words(name), answer, f"{'; '.join([*rest, f'from {used}'])}.")
            continue
        large = limits.at_most is not None
        probability = flown.stated.probability if large else flown.stated.low
        end, tail = summary.maximum if large else summary.minimum, summary.at(probability)
        rest.append(f"{'largest' if large else 'smallest'} {number(end, 4, spread)}")
        if tail and flown.random and (tail.upper if large else tail.lower) is not None:  # else it is the worst case
            rest.append(f"{percentile(probability)} {number(tail.value, 4, spread)}")
        bound = demonstrated or f"{with_unit(number(end, 4, spread), unit)} in the cases flown"
        answer = f"at {'most' if large else 'least'} {bound}{_against(limits, unit)}"
        yield Card(flown.words(name), answer, f"{'; '.join([*rest, f'from {used}'])}.")


def _demonstrated(flown: Flown, name: str, limits: Limits) -> str:
    """What the verification matrix says is demonstrated of a metric by the requirement with these limits, in the same
    digits; empty without it."""
    for verdict in flown.verdicts:
        known = verdict.enclosed if limits.two_sided else verdict.demonstrated
        if verdict.metric == name and known is not None and verdict.limits == limits:
            where = f"in {given_percent(verdict.share)} of cases, {given_percent(verdict.confidence)} confidence"
            return f"{demonstrated_text(verdict, flown.unit(name))} {where}"
    return ""


def _tails(flown: Flown, summary: Summary) -> Iterator[str]:
    """Outer percentiles with their confidence bounds, those that the cases are enough for."""
    each = given_percent(flown.stated.confidence)
    for probability in flown.stated.outer if flown.random else ():
        quantile, upper = summary.at(probability), probability > 0.5
        bound = None if quantile is None else (quantile.upper if upper else quantile.lower)
        if quantile is not None and bound is not None:
            value, edge = number(quantile.value, 4, summary.spread), number(bound, 4, summary.spread, up=upper)
            side = "upper" if upper else "lower"
            yield f"{percentile(probability)} {value}, {each} {side} confidence bound {edge}"


def _against(limits: Limits, unit: str) -> str:
    """The limits behind a result: limits ±5 s, limits 24 to 55 m, or limit 2.5 kg; nothing without one."""
    if limits.at_most is None or limits.at_least is None:
        return f", limit {with_unit(limit_number(limits.ends[0]), unit)}" if limits.ends else ""
    if limits.at_least == -limits.at_most:
        return f", limits ±{with_unit(limit_number(limits.at_most), unit)}"
    return f", limits {limit_number(limits.at_least)} to {with_unit(limit_number(limits.at_most), unit)}"


def _same(flown: Flown, name: str, used: str) -> tuple[str, str]:
    """Answer and detail of a metric that is the same in all cases."""
    summary, nominal = flown.summaries[name], flown.nominal_value(name)
    begun = f"nominal {number(nominal)}; " if nominal is not None else ""
    where = "in all cases" if summary.n_used == summary.n_tried else "in all cases with a number"
    return f"{with_unit(number(summary.mean), flown.unit(name))} {where}", f"{begun}the same in {used}."


def warnings(flown: Flown) -> tuple[str, ...]:
    """What a reader must know before using any number below."""
    sentences = []
    shard = flown.manifest.get("shard")
    wanted = shard["stop"] - shard["first"] if shard else flown.n_wanted  # `resume` flies no case of another shard
    if missing := max(wanted - flown.n_tried, 0):
        sentences.append(
            f"The {'shard' if shard else 'run'} is not complete: {count(missing)} of {count(wanted)} cases are "
            "missing; “mc-engine resume .”, typed in the run’s folder, flies them."
        )
    if shard:
        sentences.append(
            f"This is shard {count(shard['number'])} of {count(shard['of'])}, with {count(wanted)} of "
            f"{count(flown.n_wanted)} cases; “mc-engine merge RUN SHARD...” makes one run of all shards."
        )
    if flown.n_tried and not flown.every.completed:
        every = "The only case" if flown.n_tried == 1 else f"All {count(flown.n_tried)} cases"
        sentences.append(f"{every} failed: no metric has a number.")
    elif failed := flown.n_tried - flown.every.completed:
        counted = f"{'it counts' if failed == 1 else 'they count'} against every requirement"
        consequence = counted if flown.verdicts else "the statistics of the metrics are of the other cases"
        sentences.append(f"{count(failed)} of {count(flown.n_tried)} cases failed; {consequence}.")
    status, reason = (str(flown.nominal.get(name) or "") for name in ("status", "reason"))
    if reason == NO_NOMINAL:
        sentences.append(f"{capitalised(reason)}.")
    elif status not in ("", STATUS_NAME[OK]):
        sentences.append(
            f"The nominal case failed with the status {status}{f', {reason}' if reason else ''}: it has no metrics."
        )
    if flown.looked and flown.n_tried and flown.verdicts:
        sentences.append(_how_looked_at(flown))
    if flown.n_tried == 0:
        sentences.append("No case was flown.")
    if flown.sampled:
        one = "one block of the design" if flown.design in IN_BLOCKS else "one"
        sentences.append(
            f"Requirements, statistics, percentiles, worst and failed cases are those of all "
            f"{count(flown.n_tried)} cases. Figures, convergence, contributors and regions show {count(flown.n_held)} "
            f"of them, {one} picked at random from each of equal stretches of the case numbers."
        )
    judged = dict.fromkeys(verdict.metric for verdict in flown.verdicts)
    coarse = [name for name in judged if (flown.integration_share(name) or 0.0) > MUCH]
    if coarse and flown.integration is not None:
        sentences.append(
            f"With {flown.integration.by}, {flown.listed(coarse)} would change by more than {number(MUCH)} standard "
            "deviations: the error of integration is not small beside the spread (see Convergence)."
        )
    sentences += turns(flown, flown.summaries)
    if not flown.random:
        sentences.append(
            f"The design is “{flown.design}”: its cases are chosen, not drawn at random. "
            f"Fractions {'' if flown.chosen else 'and percentiles '}below describe these cases and do not estimate "
            "probabilities."
        )
    return tuple(sentences)


def turns(flown: Flown, metrics: Iterable[str]) -> Iterator[str]:
    """A sentence for each metric that may jump by a full turn between cases."""
    return (sentence for name in metrics if (sentence := _turn(flown, name)))


def _turn(flown: Flown, name: str) -> str:
    """That an angle has cases near both ends of a full turn and more than half a turn without any; else empty."""
    unit = UNITS.get(flown.unit(name))
    if unit is None or unit.quantity != "angle":
        return ""
    values, turn = np.sort(flown.values(name)), tau / unit.factor
    values = values[np.isfinite(values)]
    if values.size < 2 or not NEAR_A_TURN * turn < values[-1] - values[0] <= turn * (1.0 + 1e-12):
        return ""
    gap = int(np.argmax(np.diff(values)))
    below, above = values[gap], values[gap + 1]
    if above - below <= 0.5 * turn:
        return ""
    between = f"{number(below, 4)} and {with_unit(number(above, 4), flown.unit(name))}"
    return (
        f"{flown.words(name)}: the cases lie near both ends of a full turn, none between {between}. Statistics and "
        "verdicts take an angle as a plain number: if this one jumps by a turn, they are wrong, and the metric should "
        "be the difference from a reference angle."
    )


def _how_looked_at(flown: Flown) -> str:
    """Interim analyses: why the bounds are wider than those of a number of cases that was fixed in advance."""
    looks = [int(look) for look in flown.manifest.get("looks", [])]
    flown_so_far = count(flown.n_wanted)
    if looks:
        steps = ", ".join(count(look) for look in looks)
        story = (
            f"The run was to end once every requirement passes or fails, with interim analyses after {steps} cases; "
        )
        story += f"it {'ended after' if flown.n_wanted in looks else 'was then extended to'} {flown_so_far}."
    elif flown.n_tried < flown.n_wanted:
        story = f"The run has {count(flown.n_tried)} of {flown_so_far} cases so far."
    else:
        begun = count(int(flown.campaign.get("cases", 0)))
        story = f"The run began with {begun} cases and was extended to {flown_so_far} after their results were known."
    return (
        f"{story} The bounds on probabilities hold at every number of cases at once (sequential testing: Robbins’ "
        "mixture, Ville’s inequality) and are wider for it; percentiles and other intervals are those of a number "
        "fixed in advance."
    )


def summary_sentence(flown: Flown) -> str:
    """All verdicts in one sentence."""
    outcomes = [verdict.outcome for verdict in flown.verdicts]
    if not outcomes:
        return "The campaign sets no requirement; the key results follow."
    total = len(outcomes)
    if all(outcome == "pass" for outcome in outcomes):
        met = {1: "The requirement is met", 2: "Both requirements are met"}.get(
            total, f"All {total} requirements are met"
        )
        return f"{met}{' by the cases flown so far' if flown.n_tried < flown.n_wanted else ''}."
    parts = [(outcomes.count("pass"), "met"), (outcomes.count("fail"), "failed"),
             (outcomes.count("not demonstrable"), "not demonstrable with these cases")]  # fmt: skip
    return f"Of {total} requirement{'s' if total > 1 else ''}: {', '.join(f'{n} {what}' for n, what in parts if n)}."
