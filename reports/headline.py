"""The headline box: will it work, how surely, and what does it cost."""

from collections.abc import Iterator

from mc_engine.figures import MapFigure
from mc_engine.shell_words import shell_word
from mc_engine.statistics import Verdict
from reports.document import Card
from reports.flown import CONFIDENCE, Flown
from reports.numbers import count, number, percent, with_unit
from reports.tables import TONES, limit_text

MOST_COSTS = 4
HIGH, LOW = 0.99865, 0.00135


def verdict_cards(flown: Flown) -> tuple[Card, ...]:
    """One card per requirement, failed ones first."""
    order = {"fail": 0, "not demonstrable": 1, "pass": 2}
    verdicts = sorted(flown.verdicts, key=lambda verdict: order[verdict.outcome])
    joint = [] if flown.joint is None else [flown.joint]
    return tuple(_verdict_card(flown, verdict) for verdict in [*verdicts, *joint])


def _verdict_card(flown: Flown, verdict: Verdict) -> Card:
    asked = "every limit kept"
    if verdict.metric:
        asked = f"{flown.words(verdict.metric)} {limit_text(verdict, flown.unit(verdict.metric))}"
    wanted = f"{percent(verdict.share, 3)} of cases, {percent(verdict.confidence)} confidence"
    counted = f"{count(verdict.passed)} of {count(verdict.tried)} cases inside"
    return Card(
        label=verdict.name,
        answer=verdict.outcome,
        detail=f"{asked} for {wanted}: {counted}{_because(flown, verdict)}.",
        tone=TONES[verdict.outcome],
    )


def _because(flown: Flown, verdict: Verdict) -> str:
    """What the counts show, as the end of a sentence."""
    lost = f", {count(verdict.no_number)} of the others without a number" if verdict.no_number else ""
    if verdict.lower is None or verdict.upper is None:
        return f"{lost}; " + ("no case was flown" if not verdict.tried else "cases of this design are no random sample")
    if verdict.outcome == "fail" and verdict.upper >= verdict.share:  # the joint one, for another's failing
        failing = [one.name for one in flown.verdicts if one.shared_outcome == "fail"]
        return f"{lost}; {' and '.join(failing)} {'fails' if len(failing) == 1 else 'fail'} with confidence shared"
    if verdict.outcome == "fail":
        return f"{lost}; the true share is at most {percent(verdict.upper)}"
    more = f", {count(verdict.needed)} cases would be needed without a further failure" if verdict.needed else ""
    return f"{lost}; the true share is at least {percent(verdict.lower)}{more}"


def cost_cards(flown: Flown) -> tuple[Card, ...]:
    """What the metrics that the model maps (or those that matter) come to."""
    mapped = [figure.metric for figure in flown.figures if isinstance(figure, MapFigure)]
    names = [name for name in dict.fromkeys([*mapped, *flown.key_metrics]) if name in flown.summaries]
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
        large, spread = flown.large_is_bad(name), summary.spread
        end = summary.maximum if large else summary.minimum
        tail = summary.at(HIGH if large else LOW)
        limit = None if tail is None else (tail.upper if large else tail.lower)
        side = "at most" if large else "at least"
        median = summary.at(0.5)
        middle = f"median {number(median.value, 4, spread) if median else '–'}"
        nominal = flown.nominal_value(name)
        rest = [middle, f"{'largest' if large else 'smallest'} {number(end, 4, spread)}", f"from {used}"]
        rest[:0] = [f"nominal {number(nominal, 4, spread)}"] if nominal is not None else []
        if flown.random and limit is not None and tail is not None:
            each = percent(0.5 * (1.0 + CONFIDENCE))
            rest.insert(0, f"quantile {number(tail.value, 4, spread)}, this limit of it holds with {each}")
            answer = f"{side} {with_unit(number(limit, 4, spread), unit)} in {percent(HIGH, 3)} of cases"
        else:
            answer = f"{side} {with_unit(number(end, 4, spread), unit)} in the cases flown"
        yield Card(flown.words(name), answer, f"{'; '.join(rest)}.")


def _same(flown: Flown, name: str, used: str) -> tuple[str, str]:
    """Answer and detail of a metric that does not differ from case to case."""
    summary, nominal = flown.summaries[name], flown.nominal_value(name)
    begun = f"nominal {number(nominal)}; " if nominal is not None else ""
    where = "in all cases" if summary.n_used == summary.n_tried else "in all cases with a number"
    return f"{with_unit(number(summary.mean), flown.unit(name))} {where}", f"{begun}the same in {used}."


def warnings(flown: Flown) -> tuple[str, ...]:
    """What a reader must know before believing any number below."""
    found = []
    missing = flown.n_wanted - flown.n_tried
    if missing > 0:
        found.append(
            f"The run is not complete: {count(missing)} of {count(flown.n_wanted)} cases are missing; "
            f"mc-engine resume {shell_word(flown.name)} flies them."
        )
    if flown.n_tried and not flown.ok.any():
        found.append(f"All {count(flown.n_tried)} cases failed: no metric has a number.")
    elif not flown.ok.all():
        failed = int((~flown.ok).sum())
        found.append(f"{count(failed)} of {count(flown.n_tried)} cases failed; they count against every requirement.")
    if flown.looked and flown.n_tried and flown.verdicts:
        found.append(_how_looked_at(flown))
    if flown.n_tried == 0:
        found.append("No case was flown.")
    if not flown.random:
        found.append(
            f"The design is “{flown.design}”: its cases are chosen, not drawn, so shares and quantiles below "
            "describe these cases and are no probabilities."
        )
    return tuple(found)


def _how_looked_at(flown: Flown) -> str:
    """Why the bounds are wider than those of a number of cases that was fixed in advance."""
    looks = [int(look) for look in flown.manifest.get("looks", [])]
    flown_so_far = count(flown.n_wanted)
    if looks:
        steps = ", ".join(count(look) for look in looks)
        story = f"Flying was to end once every requirement passes or fails, looked at after {steps} cases; "
        story += f"it went on to {flown_so_far}."
    else:
        begun = count(int(flown.campaign.get("cases", 0)))
        story = f"The run was begun with {begun} cases and extended to {flown_so_far} when those could be seen."
    return (
        f"{story} The bounds on shares hold at every number of cases at once (Robbins’ mixture, Ville’s inequality) "
        "and are wider for it; quantiles and other intervals are those of a number fixed in advance."
    )


def summary_sentence(flown: Flown) -> str:
    """All verdicts in one sentence."""
    outcomes = [verdict.outcome for verdict in flown.verdicts]
    if not outcomes:
        return "The campaign sets no requirement; below is what the cases cost."
    total = len(outcomes)
    if all(outcome == "pass" for outcome in outcomes):
        met = "The requirement is met" if total == 1 else f"All {total} requirements are met"
        return f"{met}{' by the cases flown so far' if flown.n_tried < flown.n_wanted else ''}."
    parts = [(outcomes.count("pass"), "met"), (outcomes.count("fail"), "failed"),
             (outcomes.count("not demonstrable"), "not demonstrable with these cases")]  # fmt: skip
    return f"Of {total} requirement{'s' if total > 1 else ''}: {', '.join(f'{n} {what}' for n, what in parts if n)}."
