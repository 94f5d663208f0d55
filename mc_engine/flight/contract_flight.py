"""Checks of a model's contract by flying a few cases of its campaign several times.

Results must exist, repeat, and not depend on the other cases in the batch.  Every dispersion must have an effect,
no metric may be a fixed number, and every event must happen.  `python -m mc_engine.flight.contract_flight FILE` prints
the sentences as JSON; `check` runs it as a separate process, because the model may crash or hang.
"""

import json
import os
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.columns import END_TIME
from mc_engine.campaign.dispersions import Dispersion
from mc_engine.campaign.loading import Campaign, load_campaign
from mc_engine.errors import EngineError
from mc_engine.flight.compiled import CompiledFlyer
from mc_engine.flight.flyer import NOMINAL_NOISE, Columns
from mc_engine.flight.kernel import FINER_STEPS, clock_number, finer, grid_of
from mc_engine.flight.lost_numbers import first_lost, may_be_lost, not_finite
from mc_engine.flight.missing_events import events_that_never_happen, why_no_stop
from mc_engine.flight.repeatability import (
    first_difference,
    influences,
    model_digests,
    nominal_inputs,
    not_repeating,
    note_environment,
    results,
)
from mc_engine.garbage_collection import collect_rarely
from mc_engine.model.faults import MORE, fault_of
from mc_engine.model.fields import AdaptiveStep, FixedStep
from mc_engine.model.record import Model, compiled_model
from mc_engine.model.trial import fixed_metrics
from mc_engine.sampling.distributions import Discrete, column, quantiles
from mc_engine.status import NOT_FINITE, OK, STATUS_NAME, STATUS_TEXT

_CASES = 32
_BLOCKS = 4  # of lanes that they fill at most
# where along its distribution an input is tried: not at its edges alone, where what works evenly does the same
_PLACES = np.array([0.05, 0.8, 0.95])
_TAILS = np.array([0.001, 0.999])  # where a failure may be that begins beyond a threshold of another input
_ROWS = 10_000  # of a table, among which its values are looked for
_PARTNERS = 4  # cases in which an input is tried that does nothing in the nominal case
LONGEST_S = 10.0  # of the flight of one case: with it, all that is flown here takes some minutes
_NOMINAL = np.array([NOMINAL_NOISE])
_GROSS = 0.1  # of the size of the states; halving changed sound steps by 0.03 at most, unstable ones by 1 to 100
_SAME_STEPS = 10  # grid points within which a number is lost that the equations lose
_VISIBLE = 1e-4  # of the size of the states: finer steps change those of the shipped campaigns by 2e-5 at most
_ROUNDED = 1e-6  # of a step: a billion steps as numbers of 16 digits miss `until` by less


def faults(campaign: Campaign) -> list[str]:
    """One sentence for each error that a flight of a few cases shows; empty if there is none.

    A flight that takes far too long ends the process, after its sentence is printed as by `main`.
    """
    if campaign.first is not None:
        return []  # its inputs come from a run that is not there yet
    ids = np.arange(min(campaign.cases, _CASES))
    inputs = full_inputs(campaign, case_table(campaign, ids))
    try:
        nominal = _fly_nominal(campaign)
        with _completed_within(_BLOCKS * LONGEST_S, f"the first {ids.size} cases have", campaign):
            flown = results(campaign, inputs, ids)
        lost = _too_long(campaign, nominal) or not_finite(campaign, inputs, ids, flown, nominal)
        faults_of_flight = [
            *(lost or _none_completing(campaign, flown, nominal)),
            *not_repeating(campaign, inputs, ids, flown),
        ]
        faults_of_flight = faults_of_flight or _passed_over(campaign, inputs, ids, flown)
        return faults_of_flight or [
            *_past_until(campaign, nominal),
            *_never_set(campaign, flown, nominal),
            *_always_the_same(campaign, flown),
            *_never_above(campaign, flown),
            *_met_while_above(campaign, flown),
            *_moving_nothing(campaign, inputs, ids),
            *events_that_never_happen(campaign, inputs, ids, nominal),
        ]
    except EngineError as error:
        return [str(error).removesuffix(MORE)]
    except Exception as error:
        return [fault_of(error, campaign.model_reference)]


def _fly_nominal(campaign: Campaign) -> Columns:
    """Fly the nominal case, once its kernel is compiled; end the process with a sentence if it is not completed."""
    CompiledFlyer(campaign).make_ready()
    with _completed_within(LONGEST_S, "the nominal case has", campaign):
        return results(campaign, campaign.nominal, _NOMINAL)


@contextmanager
def _completed_within(seconds: float, who: str, campaign: Campaign) -> Iterator[None]:
    """A kernel cannot be broken off: where the block takes longer, the process ends with a sentence."""

    def give_up() -> None:
        _print_sentences([f"{who} not completed after {seconds:.0f} s: {_length(campaign)}"])
        os._exit(0)

    timer = threading.Timer(seconds, give_up)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _length(campaign: Campaign) -> str:
    """What the clock allows, and what to do about a flight that takes too long."""
    clock, (_, settings) = compiled_model(campaign.model).clock, nominal_inputs(campaign)
    if isinstance(clock, FixedStep):
        n_steps, step, _ = grid_of(clock, settings)
        what, fix = f"{n_steps:,} steps of {step:g} s", "take longer steps, or an earlier `until`"
    else:
        what, fix = f"up to {clock.attempts:,} attempts", "take a larger `rtol` or fewer `attempts`"
    stops = "; look whether its stopping event crosses zero" if compiled_model(campaign.model).event_list else ""
    return f"its clock allows {what}; {fix}{stops}, or leave the flight out with `mc-engine check --no-model`"


def _too_long(campaign: Campaign, nominal: Columns) -> list[str]:
    """One sentence if the nominal case ends grossly differently with half the step of a multistep method.

    Beyond the stability limit of the method errors grow at every step.  Absurd numbers have status ok while finite.  If
    they overflow with either step, they do so at another time; what `rhs` itself makes infinite is so at the same one.
    """
    model, (_, settings) = compiled_model(campaign.model), nominal_inputs(campaign)
    clock = model.clock
    if not isinstance(clock, FixedStep) or clock.method == "rk4":
        return []
    _, step, _ = grid_of(clock, settings)
    with _completed_within(2.0 * LONGEST_S, "with half of its step the nominal case has", campaign):
        halved = results(campaign, campaign.nominal, _NOMINAL, finer(clock, nominal[END_TIME][0]))
    name, coarse, fine = "status", nominal["status"][0], halved["status"][0]
    if coarse == fine:
        name = ""
        if coarse == STATUS_NAME[OK]:
            begun = results(campaign, campaign.nominal, _NOMINAL, replace(clock, until=clock.step))
            name = _far(model, begun, nominal, halved)
        elif coarse == STATUS_NAME[NOT_FINITE]:
            ends = nominal[END_TIME][0], halved[END_TIME][0]
            name = END_TIME if abs(ends[0] - ends[1]) > _SAME_STEPS * step else ""
        if not name:
            return []
        coarse, fine = (f"{row[name][0]:.3g}" for row in (nominal, halved))
    return [f'steps of {step:g} s are too long for "{clock.method}": the nominal case has the {name} {coarse}, with '
            f"half of the step {fine}; take shorter steps, see the limits of stability in `FixedStep`, and then let "
            "`mc-engine bench --methods` find the fastest method of that accuracy"]  # fmt: skip


def _far(model: Model, begun: Columns, coarse: Columns, fine: Columns) -> str:
    """The end time or the first end state that differs grossly between two flights of a case; empty if there is none.

    begun : the case after one step
    """
    sizes = _sizes_at_end(model, np.array([True]), begun, fine)
    return next((name for name, size in sizes.items() if abs(coarse[name][0] - fine[name][0]) > _GROSS * size), "")


def _sizes_at_end(model: Model, which: np.ndarray, *flights: Columns) -> dict[str, float]:
    """Largest size of the end time and of each end state, by column; those of one unit, as of a position, have one."""
    units = {END_TIME: END_TIME} | {f"end_{state.name}": state.unit for state in model.states}
    sizes = {name: max(abs(flown[name][which]).max(initial=0.0) for flown in flights) for name in units}
    return {name: max(sizes[other] for other in units if units[other] == unit) for name, unit in units.items()}


def _passed_over(campaign: Campaign, inputs: Mapping[str, Any], ids: np.ndarray, flown: Columns) -> list[str]:
    """One sentence if cases end far away, or otherwise, with short steps: an adaptive step looks at a few instants.

    Far is more than the spread of the cases; one alone may be a case at the edge between two ways to end.
    """
    model = compiled_model(campaign.model)
    if not isinstance(model.clock, AdaptiveStep):
        return []
    flight_s = float(np.nanmax(flown[END_TIME]))
    fine = results(campaign, inputs, ids, finer(model.clock, flight_s))
    elsewhere = flown["status"] != fine["status"]
    both = ~elsewhere & (flown["status"] == STATUS_NAME[OK])
    # also halfway: a state that the stopping event makes zero has no size at the end
    halfway = results(campaign, inputs, ids, replace(model.clock, until=0.5 * flight_s))
    for name, size in _sizes_at_end(model, both, flown, halfway).items():
        change = np.where(both, abs(fine[name] - flown[name]), 0.0)
        elsewhere |= (change > flown[name][both].std()) & (change > _VISIBLE * size)
    if elsewhere.sum() < 2:
        return []
    return [f"steps are too long: {elsewhere.sum()} of the first {ids.size} cases end elsewhere with a tenth of the "
            f"tolerances and steps of at most {flight_s / FINER_STEPS:.3g} s; let events of the time begin and end "
            "what acts for a short time, such as a burn, or give the clock a shorter `longest_step` or a smaller "
            "`rtol`"]  # fmt: skip


def _past_until(campaign: Campaign, nominal: Columns) -> Iterator[str]:
    """One sentence if the nominal case flies past `until` in its last step, with the times and the step that fit."""
    clock, (_, settings) = compiled_model(campaign.model).clock, nominal_inputs(campaign)
    if not isinstance(clock, FixedStep):
        return
    (n, step, _), until = grid_of(clock, settings), clock_number(clock.until, settings)
    if nominal[END_TIME][0] - until > _ROUNDED * step:
        ends = " or ".join(f"{k * step:.15g} s" for k in (n - 1, n) if k)
        yield (
            f"the clock's `until` is {until:.15g} s, and flights end at {n * step:.15g} s, after {n:,} steps of "
            f"{step:.15g} s; take an `until` of {ends}, or steps of {until / n:.15g} s"
        )


def _none_completing(campaign: Campaign, flown: Columns, nominal: Columns) -> Iterator[str]:
    """One sentence if no case at all reached its end, or the nominal one did not."""
    status = flown["status"]
    if (status == STATUS_NAME[OK]).any():
        if nominal["status"][0] != STATUS_NAME[OK]:
            why = _why(campaign, nominal, 0, "it")
            yield f"the nominal case does not complete: it is {nominal['status'][0]} ({why})"
        return
    words, counts = np.unique(status.astype(str), return_counts=True)
    word = str(words[counts.argmax()])
    why = _why(campaign, flown, int(np.flatnonzero(status == word)[0]), "the first of them")
    yield f"none of the first {status.size} cases completes: {counts.max()} are {word} ({why})"


def _why(campaign: Campaign, flown: Columns, row: int, who: str) -> str:
    """Why the case in a row failed, and where it ended."""
    word, reason = str(flown["status"][row]), str(flown["reason"][row])  # with phases, the reason tells that of the end
    if word == "refused":
        return reason
    if word == "no-stop":
        text, where = why_no_stop(campaign), [reason]
    else:
        text = {STATUS_NAME[code]: text for code, text in STATUS_TEXT.items()}[word]
        where = [f"at t = {flown[END_TIME][row]:.6g} s", reason]
    ends = " ".join(filter(None, where))
    return f"{text}{f'; {who} ends {ends}' if ends else ''}"


def _never_set(campaign: Campaign, flown: Columns, nominal: Columns) -> Iterator[str]:
    """Metrics without a finite number in any case that flew, and the line that makes the first of them not a number."""
    ok = flown["status"] == STATUS_NAME[OK]
    model, lost = compiled_model(campaign.model), False
    for metric in model.metrics:
        values = flown[metric.name][ok]
        if not metric.sometimes and not np.isfinite(values).any():
            lost = True
            word = "infinite in all" if np.isinf(values).any() else "not a number in any"
            yield (
                f'the metric "{metric.name}" is {word} of the {values.size} cases that flew; look at `evaluate`, or at '
                "the output or the event that it is declared by, or declare it with sometimes=True if it exists only "
                "with some settings"
            )
    if lost and may_be_lost(model, nominal):
        sentence = first_lost(model, campaign.nominal, NOMINAL_NOISE, campaign.seed, "the nominal case")
        yield from filter(None, [sentence])


def _always_the_same(campaign: Campaign, flown: Columns) -> Iterator[str]:
    """Metrics with one value in all cases that `evaluate` gives to any other flight as well.

    A metric that only does not move in this campaign, such as a count that stays zero, is none of them.
    """
    ok = flown["status"] == STATUS_NAME[OK]
    model = compiled_model(campaign.model)
    same = [metric for metric in model.metrics if not metric.sometimes and np.unique(flown[metric.name][ok]).size == 1]
    fixed = fixed_metrics(model, *nominal_inputs(campaign)) if same else {}
    for metric in same:
        if metric.name in fixed:
            value = fixed[metric.name] / metric.si_factor
            yield (
                f'the metric "{metric.name}" is {value:g} whatever happens; let `evaluate` work it out, leave it out, '
                "or declare it with sometimes=True if it differs only with some settings"
            )


def _last_times(model: Model) -> Iterator[tuple[Any, Any]]:
    """(metric, extremum) of each last time above a level."""
    for extremum in model.extrema:
        if extremum.kind == "last_above":
            yield from ((metric, extremum) for metric in model.metrics if metric.symbol == extremum.name)


def _never_above(campaign: Campaign, flown: Columns) -> Iterator[str]:
    """Last times above a level that no case exceeds, of outputs in a unit below SI's, such as deg: a level in deg is
    too high then.  One in km, taken for m, would be too low; no case above it is as it should be."""
    ok = flown["status"] == STATUS_NAME[OK]
    model = compiled_model(campaign.model)
    for metric, extremum in _last_times(model):
        if metric.sometimes or flown[metric.name][ok].any():
            continue
        level, output = extremum.level, extremum.quantity
        unit, factor = next((q.unit, q.si_factor) for q in model.quantities if q.name == output)
        if factor < 1.0:
            yield (
                f'the metric "{metric.name}" is 0 in all of the {ok.sum()} cases that flew: none has "{output}" above '
                f"the level of {level / factor:.6g} {unit}; `level` is in SI: multiply a level in {unit} by "
                f"{factor:.6g}, or declare the metric with sometimes=True if it differs only with some settings"
            )


def _met_while_above(campaign: Campaign, flown: Columns) -> Iterator[str]:
    """Requirements on a last time above a level which a flight that is above it until it ends met, or would meet where
    all have the same length."""
    ok = flown["status"] == STATUS_NAME[OK]
    factors = {metric.name: metric.si_factor for metric, _ in _last_times(compiled_model(campaign.model))}
    for requirement in campaign.requirements:
        if requirement.metric not in factors or requirement.at_most is None or not ok.any():
            continue
        factor = factors[requirement.metric]
        ends, last = flown[END_TIME][ok], flown[requirement.metric][ok] * factor
        inside = ends <= requirement.at_most * factor
        if (inside & (last >= ends)).any() or (inside.all() and np.ptp(ends) == 0.0):
            yield (
                f'requirement "{requirement.name}" is met by a flight that is above the level of '
                f'"{requirement.metric}" until it ends, because the metric is then the time of the end, such as '
                f"{ends[inside].max():.6g} s; choose at_most below it, or fly longer"
            )


def _moving_nothing(campaign: Campaign, inputs: Mapping[str, Any], ids: np.ndarray) -> Iterator[str]:
    """Dispersions whose values all give the same metrics: of the nominal case, of some dispersed ones, and of the
    nominal case with another input at a rare value, such as that of a failure whose time is dispersed."""
    idle = [dispersion for dispersion in campaign.dispersions if not _moves(campaign, dispersion, campaign.nominal)]
    for dispersion in idle:
        rows = [{k: v[i] if np.ndim(v) else v for k, v in inputs.items()} for i in range(min(_PARTNERS, ids.size))]
        rows += [
            {**campaign.nominal, other.name: value}
            for other in campaign.dispersions
            if other is not dispersion
            for value in _rare_values(campaign, other)
        ]
        if not any(_moves(campaign, dispersion, row) for row in rows):
            name = dispersion.name
            yield f'dispersion "{name}" moves no metric; use it in the physics, or leave it out of the campaign'


def _moves(campaign: Campaign, dispersion: Dispersion, others: Mapping[str, Any]) -> bool:
    """Whether some values of a dispersion give different results; one that has but one value does."""
    places = _trial_values(campaign, dispersion)
    if np.unique(places).size == 1:
        return True
    flown = results(campaign, {**others, dispersion.name: places}, np.zeros(len(places), dtype=np.int64))
    names = ["status", *(metric.name for metric in compiled_model(campaign.model).metrics)]
    rows = [{name: flown[name][[i]] for name in names} for i in range(len(places))]
    return any(first_difference(rows[0], row) is not None for row in rows[1:])


def _trial_values(campaign: Campaign, dispersion: Dispersion, probabilities: np.ndarray = _PLACES) -> np.ndarray:
    if campaign.upstream is None and campaign.design != "table":
        if dispersion.levels:
            return column(dispersion.levels)
        assert dispersion.distribution is not None  # a loaded campaign has one for every random design
        return quantiles(dispersion.distribution, probabilities)
    values = case_table(campaign, np.arange(min(campaign.cases, _ROWS)))[dispersion.name]
    return np.sort(values)[[0, 3 * values.size // 4, -1]]


def _rare_values(campaign: Campaign, dispersion: Dispersion) -> np.ndarray:
    """Every value of a discrete dispersion, and of another one those near its ends."""
    if isinstance(dispersion.distribution, Discrete):
        return column(dispersion.distribution.values)
    return _trial_values(campaign, dispersion, _TAILS)


def main() -> None:
    """Print the sentences on the campaign named on the command line as a JSON list.

    With `--wait` behind the name nothing is flown before the digests of another process come on standard input, as
    JSON; without them this process ends.
    """
    collect_rarely()
    note_environment()
    campaign = load_campaign(sys.argv[1])
    waits = sys.argv[2:] == ["--wait"]
    if waits and not isinstance(campaign.model, Model):
        return
    there = model_digests(campaign)
    here = sys.stdin.read() if waits else json.dumps(there)
    if here:
        _print_sentences(influences(json.loads(here), there) or faults(campaign))


def _print_sentences(sentences: list[str]) -> None:
    print(json.dumps(sentences), flush=True)


if __name__ == "__main__":
    main()
