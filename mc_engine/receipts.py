"""What counts in a run directory after all that its journal tells.

A part counts from its line on, until a line replaces or withdraws it; of the nominal case and of the histories the
last line counts.
"""

from collections.abc import Iterable

from mc_engine.journal import Entry
from mc_engine.parts import Part


def counted_parts(entries: Iterable[Entry]) -> list[Part]:
    """Receipts of the parts of cases, in the order in which they came."""
    counted: list[Part] = []
    for entry in entries:
        if entry.event not in ("part", "part-replaced", "part-withdrawn"):
            continue
        facts = dict(entry.facts)
        gone = facts["file"] if entry.event == "part-withdrawn" else facts.pop("replaces", None)
        if gone is not None:
            counted = [part for part in counted if part.file != gone]
        if entry.event != "part-withdrawn":
            counted.append(Part(**facts))
    return counted


def counted_nominal(entries: Iterable[Entry]) -> Part | None:
    """Receipt of the nominal case, if it was written and not withdrawn."""
    told = [entry for entry in entries if entry.event in ("nominal", "nominal-withdrawn")]
    return Part(**told[-1].facts) if told and told[-1].event == "nominal" else None


def history_receipts(entries: Iterable[Entry]) -> list[Part]:
    """Receipts of all histories ever written; the last one counts."""
    return [Part(**entry.facts) for entry in entries if entry.event == "history"]
