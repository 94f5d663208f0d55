"""The scenario of a run: vehicle and campaign, timeline, assumptions and dispersions."""

from collections.abc import Iterator, Mapping
from typing import Any

from mc_engine.statistics import Summary
from mc_engine.store.manifest_file import seed_remark
from mc_engine.store.run_files import NO_NOMINAL
from mc_engine.units import UNITS, convert
from reports.document.blocks import Cell, Column, Table
from reports.run.chosen_units import chosen_unit, spread_text
from reports.run.flown import Flown
from reports.run.phases import phase_times
from reports.sections.tables import fixed_table, input_table
from reports.text.numbers import capitalised, counted, number, with_unit
from reports.text.source_places import of_source

EVENTS = ("time of ", "start of ", "end of ")  # how the meaning of an event's time begins
DESIGNS = {
    "mc": "independent random draws",
    "lhs": "Latin hypercube sampling",
    "sobol": "scrambled Sobol’ points",
    "grid": "all combinations of given values",
    "one_at_a_time": "one input changed at a time",
    "table": "rows of a given table",
    "saltelli": "blocks for Sobol’ indices",
    "morris": "trajectories of elementary effects",
}
AT_EVENT = 4  # numbers that a row of the timeline tells


def scenario_blocks(flown: Flown) -> Iterator[Table | str | None]:
    """The vehicle and the campaign in words, the timeline of the nominal case, assumptions and dispersions."""
    yield _vehicle(flown)
    yield from note_paragraphs(flown.campaign)
    yield timeline_table(flown)
    changed = fixed_table(flown, "Assumptions: values set by the campaign file", True)
    if changed is None and flown.manifest.get("parameters"):
        yield "All parameters and settings that are not dispersed have the model’s own values (appendix Inputs)."
    yield changed
    yield input_table(flown) or "No input is dispersed: all cases have the nominal inputs."
    yield correlation_table(flown)


def note_paragraphs(campaign: Mapping[str, Any]) -> Iterator[str]:
    """The paragraphs of the note of [campaign], by its record in a manifest."""
    yield from filter(None, map(str.strip, campaign.get("note", "").split("\n\n")))


def _vehicle(flown: Flown) -> str:
    model, upstream = flown.manifest.get("model", {}), flown.manifest.get("upstream")
    said = [f"{model['title']}." if model.get("title") else ""]
    said.append(f"Source of the model: {model['source'].rstrip('.')}." if model.get("source") else "")
    dispersed = counted(len(flown.manifest.get("inputs", [])), "dispersed input")
    nominal = ", and one nominal case with all inputs at their nominal values"
    if flown.nominal.get("reason") == NO_NOMINAL:
        nominal = ""
    design = f"the design “{flown.design}”" + (f" ({DESIGNS[flown.design]})" if flown.design in DESIGNS else "")
    said.append(f"{counted(flown.n_wanted, 'case')} of {design} with {dispersed}{nominal}.")
    if upstream:
        said.append(f"Each case continues a case of the run of {upstream['name']}.")
        alike = seed_remark(flown.manifest["campaign"].get("seed"), upstream)
        said.append(f"The seed {alike}." if alike else "")
    return " ".join(filter(None, said))


def correlation_table(flown: Flown) -> Table | None:
    """The pairs of dispersed inputs that the campaign file correlates; None without any."""
    rows = [
        (
            Cell(f"{pair['first']}, {pair['second']}"),
            Cell(number(pair["rank"]), pair["rank"]),
            Cell(of_source(pair["source"] or "not stated")),
        )
        for pair in flown.manifest.get("correlations", [])
    ]
    columns = (Column("Inputs", "name"), Column("Rank correlation", "number"), Column("Source", "text"))
    note = "Spearman’s rank correlations of the draws, as the campaign file sets them or from its covariances."
    return Table("Correlated inputs", columns, tuple(rows), note) if rows else None


def timeline_table(flown: Flown) -> Table | None:
    """The phases of the nominal case and the events whose times the metrics tell, in their order; None without any.

    An event at 0 s is none of its own: an error that is largest as the flight begins, or one that never settles.
    """
    times, declared = {}, flown.manifest.get("event_times", [])
    for fact in flown.with_role("metric"):
        words, value = flown.words(fact.name), flown.own.nominal_value(fact.name)
        is_event = fact.name in declared or words.endswith(" time") or fact.description.startswith(EVENTS)
        if value is not None and _is_time(flown.own.unit(fact.name)) and is_event:
            times[fact.name] = words.removesuffix(" time")
    events = {*times.values()}
    at_start = [times.pop(name) for name in [*times] if _seconds(flown, name) == 0.0]
    phases = phase_times(flown)
    if not times and not phases:
        return None
    rows = [_phase_row(flown, place, *begin) for place, begin in enumerate(phases)]
    for name in sorted(times, key=lambda event: _seconds(flown, event)):
        summary, event = flown.summaries[name], times[name]
        spread = _range_text(flown, name, summary) if flown.chosen else _sigma_text(flown, name, summary)
        rows.append(
            (
                Cell(capitalised(event), small=flown.columns[name].description),
                Cell(
                    with_unit(number(flown.nominal_value(name), 5), flown.unit(name)),
                    _seconds(flown, name),
                ),
                Cell(spread, summary.sd),
                Cell("; ".join(_at_event(flown, name, event, events)) or "–"),
            )
        )
    rows.sort(key=lambda row: row[1].value or 0.0)
    columns = (
        Column("Event", "text"),
        Column("Nominal time", "number"),
        Column("Range of the cases" if flown.chosen else "1σ of the cases", "number"),
        Column("Nominal values at the event", "text"),
    )
    note = f"At 0 s in the nominal case, and not listed: {', '.join(at_start)}." * bool(at_start)
    return Table("Timeline of the nominal case", columns, tuple(rows), note)


def _sigma_text(flown: Flown, name: str, summary: Summary) -> str:
    return "–" if summary.sd is None else spread_text(flown, name, summary.spread or 0.0)


def _range_text(flown: Flown, name: str, summary: Summary) -> str:
    low, high = (number(end, 5, summary.spread) for end in (summary.minimum, summary.maximum))
    return with_unit(low if summary.constant else f"{low} to {high}", flown.unit(name))


def _phase_row(flown: Flown, place: int, name: str, time: float) -> tuple[Cell, ...]:
    """Where a phase of the nominal case begins, as far as the rows of its history tell."""
    seconds = convert(time, flown.unit("t_s"), "s")
    unit = chosen_unit("s", [seconds])  # not that of the histories, which suits the end of a long flight
    told = Cell(with_unit(number(convert(seconds, "s", unit), 5), unit), seconds)
    when = "first saved row in this phase" if place else "first phase"
    return Cell(f"Phase {name} begins", small=when), told, Cell("–"), Cell("–")


def _is_time(unit: str) -> bool:
    return unit in UNITS and UNITS[unit].quantity == "time"


def _seconds(flown: Flown, name: str) -> float:
    return convert(float(flown.own.nominal_value(name) or 0.0), flown.own.unit(name), "s")


def _at_event(flown: Flown, name: str, event: str, events: set[str]) -> Iterator[str]:
    """What else the metrics tell of an event: those whose names begin like that of its time, and of no longer one."""
    stem = _stem(event)
    longer = tuple(_stem(other) for other in events if len(other) > len(event))
    told = 0
    for fact in flown.with_role("metric"):
        value = flown.nominal_value(fact.name)
        mine = fact.name.startswith(stem) and not fact.name.startswith(longer) and fact.name != name
        if mine and value is not None and told < AT_EVENT:
            told += 1
            words = flown.words(fact.name).removeprefix(event).strip() or event
            yield f"{words} {with_unit(number(value, 4), flown.unit(fact.name))}"


def _stem(event: str) -> str:
    return f"{event.replace(' ', '_')}_"
