"""Events that never happen in the flights of a few cases: the line of the model, and the range of their functions."""

import ast
from collections.abc import Iterator, Mapping
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.campaign.loading import Campaign
from mc_engine.flight.flight import fly, fly_histories, fly_interpreted
from mc_engine.flight.flyer import NOMINAL_NOISE, Columns
from mc_engine.flight.kernel import build_kernel
from mc_engine.flight.kernel_parts import watching_events
from mc_engine.lanes.kernel_cache import form_of, kept_or_made
from mc_engine.model.fields import DIRECTIONS, Event
from mc_engine.model.phases import due_field, noted_field
from mc_engine.model.reading import code_of, place_of
from mc_engine.model.record import Model, compiled_model
from mc_engine.model.syntax_tree import tree_of_file
from mc_engine.status import OK, STATUS_NAME
from mc_engine.suggestions import listed

_INTERPRETED_S = 10.0  # of the nominal case flown by Python: the kernel that it spares takes about as long to compile
_FEW = 5  # flights whose event functions are examined: the nominal case and some others
_ZERO = 1e-6  # of an event function's reach: a flight that comes or ends as near has reached the zero
_DECIDED = "let its function depend on the state and parameters alone, or let `control` decide"
_OTHER = {"rising": "falling", "falling": "rising"}
Histories = dict[str, Columns]  # by the case in words: times, and the functions of the events


def events_that_never_happen(
    campaign: Campaign, inputs: Mapping[str, Any], ids: np.ndarray, nominal: Columns
) -> Iterator[str]:
    """Sentences on events that happen in none of the cases, of which at least one completes.

    The nominal case is flown first, by Python, and shows most events.  Only if events are left is a kernel compiled,
    which watches them in all cases.
    """
    model = compiled_model(campaign.model)
    stops = [event for event in model.event_list if event.action == "stop"]
    # a case completes by a stopping event: the only one has happened
    asked = [event for event in model.event_list if not event.rare and (event.action != "stop" or len(stops) > 1)]
    if not asked:
        return
    watched = watching_events(model)
    times = _nominal_times(campaign, watched) if nominal["status"][0] == STATUS_NAME[OK] else {}
    if all(_happens(event, times) for event in asked):
        return
    # the inputs of a chain also hold columns of the run upstream, which the nominal case lacks
    cases = {name: np.append(one, np.broadcast_to(inputs[name], ids.size)) for name, one in campaign.nominal.items()}
    noise = np.append(NOMINAL_NOISE, ids)
    flown = fly(watched, cases, noise, campaign.seed, folder=campaign.directory)
    ok = flown["status"] == STATUS_NAME[OK]
    missing = [event for event in asked if not _happens(event, {name: row[ok] for name, row in flown.items()})]
    histories = _histories(campaign, watched, cases, noise) if missing else {}
    for event in missing:
        if sentence := _never_happens(model, event, histories, int(ok[1:].sum())):
            yield sentence


def why_no_stop(campaign: Campaign) -> str:
    """What to look at where no case meets a stopping event; a delayed one by its own name."""
    model = compiled_model(campaign.model)
    delayed = {due_field(event.name): event.name for event in model.event_list}
    stops = [event.name for event in model.event_list if event.action == "stop"]
    names = [delayed.get(name, name) for name in stops]
    usual = [event for event in model.event_list if event.name in names and not event.rare]
    cases = {name: np.array([value]) for name, value in campaign.nominal.items()}
    histories = _histories(campaign, watching_events(model), cases, np.array([NOMINAL_NOISE]))
    for event in usual:
        if carried := _carried(model, event, histories):
            return f"no stopping event happens before the time limit: {carried}; {_DECIDED}"
        if other := _other_way(event, histories):
            return f"no stopping event happens before the time limit: {other}; {_mended(event)}"
    if not delayed.keys() & {*stops}:
        happens, look_at = "crosses zero", "its direction"
    else:
        happens, look_at = "acts", "its direction, its delay `after`"
    return (f"no stopping event {happens} before the time limit, of {listed(names)}; look at its function, {look_at} "
            "and the clock's `until`")  # fmt: skip


def _nominal_times(campaign: Campaign, watched: Model) -> Columns:
    """The metrics of `watching_events` in the nominal case, flown by Python; none where it takes too long or fails."""
    flight = _KeptFlight(watched, campaign.directory)
    try:
        _, status, _, metrics = fly_interpreted(flight, campaign.nominal, NOMINAL_NOISE, campaign.seed)
    except Exception:
        return {}  # no finding: kernels go on where Python raises, and the kernel that watches is asked
    return {metric.name: row for metric, row in zip(watched.metrics, metrics, strict=False)} if status[0] == OK else {}


class _KeptFlight:
    """Flies one case by Python and keeps its results in the cache.

    They follow from the kernel, its arguments and the module that flies them, which name the file.
    """

    def __init__(self, model: Model, folder: Path | None):
        self.model, self._folder = model, folder

    def kernel(self, *arguments: Any) -> None:
        inputs, results = arguments[:-7], arguments[-7:-3]  # last are the history, its rows and their pace

        def flown() -> bytes:
            from mc_engine.flight.interpreted import InterpretedFlight  # which loads the compiler

            InterpretedFlight(self.model, _INTERPRETED_S).kernel(*arguments)
            return b"".join(numbers.tobytes() for numbers in results)

        by = Path(__file__).with_name("interpreted.py").read_bytes()
        content = [(np.shape(given), np.asarray(given).tobytes()) for given in inputs]
        digest = sha256(repr((by, content)).encode()).hexdigest()
        compiled = build_kernel(self.model, self._folder, 1).file(form_of(arguments))
        kept, _ = kept_or_made(compiled.with_suffix(f".{digest[:16]}.flight"), flown)
        ends = np.cumsum([numbers.size for numbers in results])[:-1]
        for numbers, values in zip(results, np.split(np.frombuffer(kept), ends), strict=True):
            numbers[...] = values.reshape(numbers.shape)


def _happens(event: Event, times: Columns) -> bool:
    """Whether an event happens in any of the cases; not if there is no case.  times : by `watching_events`."""
    return bool(times) and not np.isnan(times[noted_field(event.name)]).all()


def _histories(campaign: Campaign, watched: Model, cases: Mapping[str, np.ndarray], noise: np.ndarray) -> Histories:
    """The event functions along the flights of the first cases, of which the first is the nominal one."""
    few = {name: row[:_FEW] for name, row in cases.items()}
    noise = noise[:_FEW]
    flights = fly_histories(watched, few, noise, campaign.seed, folder=campaign.directory)
    who = ["the nominal case", *(f"case {case}" for case in noise[1:])]
    flown = zip(who, flights, strict=True)
    return {name: history for name, (_, history) in flown if history["t_s"].size}


def _never_happens(model: Model, event: Event, histories: Histories, n_cases: int) -> str:
    """The sentence on an event; "" where a flight without phases comes to its zero, such as one that ends there."""
    if carried := _carried(model, event, histories):
        return f"{carried}; {_DECIDED}, or declare it with rare=True if it is for unusual cases"
    if other := _other_way(event, histories):
        return (f"{other}, in which it happens in none of {n_cases} cases; {_mended(event)}, or declare it with "
                "rare=True if it is for unusual cases")  # fmt: skip
    sizes = [np.abs(history[event.name]) for history in histories.values()]
    if not model.phases and any(size.min() <= _ZERO * size.max() for size in sizes):
        return ""
    values = np.concatenate([*(history[event.name] for history in histories.values()), np.empty(0)])
    if model.phases or ((values < 0.0).any() and (values > 0.0).any()):
        within = ", in the phases that look for it" if model.phases else ""
        return (f'the event "{event.name}" happens in none of {n_cases} cases{within}; mend its function or its '
                "direction, or declare it with rare=True if it is for unusual cases")  # fmt: skip
    sign = "above" if (values > 0.0).any() else "below"
    return (f'the event "{event.name}" crosses zero in none of {n_cases} cases, its function stays {sign} it; mend '
            "the function, or declare it with rare=True if it is for unusual cases")  # fmt: skip


def _other_way(event: Event, histories: Histories) -> str:
    """Where an event's function crosses zero against the event's direction, and in that never; "" if nowhere."""
    for who, history in histories.items():
        own, t = (_time_of_crossing(history["t_s"], history[event.name], way)
                  for way in (event.direction, _OTHER.get(event.direction, "")))  # fmt: skip
        if np.isnan(own) and not np.isnan(t):
            return (f'{_place(event)}: the event "{event.name}" crosses zero {_OTHER[event.direction]} at '
                    f'{t:.4g} s in {who}, but its direction is "{event.direction}"')  # fmt: skip
    return ""


def _carried(model: Model, event: Event, histories: Histories) -> str:
    """Where a sample, a switch or the beginning of a phase carries an event's function over zero; "" if nowhere."""
    signs: tuple[float, ...] = (DIRECTIONS[event.direction],)
    if event.direction == "either":  # with phases it is 1 where it is not looked for: a jump that is none of its own
        signs = () if model.phases else (1.0, -1.0)
    for (who, history), sign in product(histories.items(), signs):
        t, values = history["t_s"], sign * history[event.name]
        jumps = np.flatnonzero((t[1:] == t[:-1]) & (values[:-1] < 0.0) & (values[1:] >= 0.0))
        if jumps.size:
            return (
                f'{_place(event)}: the event "{event.name}" does not happen where a sample of the control, '
                f"`switch` or the beginning of a phase carries it over zero, at {t[jumps[0]]:.4g} s in {who}"
            )
    return ""


def _time_of_crossing(t: np.ndarray, values: np.ndarray, direction: str) -> float:
    """The time [s] of the first crossing, linear between two rows; NaN if there is none.

    Between rows of one time nothing is crossed: they are before and after a sample, a switch or the beginning of a
    phase.
    """
    sign = DIRECTIONS.get(direction, 0.0)
    before, after = sign * values[:-1], sign * values[1:]
    crossed = np.flatnonzero((t[1:] > t[:-1]) & (before < 0.0) & (after >= 0.0))
    if not crossed.size:
        return float("nan")
    k = crossed[0]
    return float(t[k] + (t[k + 1] - t[k]) * before[k] / (before[k] - after[k]))


def _mended(event: Event) -> str:
    return f'give it the direction "{_OTHER[event.direction]}" or "either", or its function the other sign'


def _place(event: Event) -> str:
    """The line on which an event is declared in the file of its function, or else that of the function."""
    code = code_of(event.function)
    file = code.co_filename if code else ""
    for node in ast.walk(tree_of_file(file)):
        for key, value in zip(node.keys, node.values, strict=True) if isinstance(node, ast.Dict) else ():
            called = isinstance(value, ast.Call) and getattr(value.func, "id", "") == Event.__name__
            if called and isinstance(key, ast.Constant) and key.value == event.name:
                return f"{Path(file).name}, line {value.lineno}"
    return place_of(event.function)
