"""Extensions whose line of the journal is damaged, as the lines behind it prove them.

A part of cases beyond those that the run had then was asked for by a line that is lost: the run is to have at least the
cases up to its end.  A session says how many cases were missing when it began, and so how many it was to come to, even
where not all of them were flown; but only where no other line is lost that could have changed what counted then, and
where the one that is lost cannot have withdrawn a part instead.  Where nothing behind proves an extension, nothing
that was flown hangs on the line, and it is dropped like any other.
"""

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from mc_engine.journal import Entry
from mc_engine.receipts import MOST_CASES, Receipts

_EXTENDED = "extended"


def with_lost_extensions(
    entries: Iterable[Entry], lost: Collection[int], manifest: Mapping[str, Any] | None
) -> list[Entry]:
    """The lines that can be trusted, and `extended` lines in place of those lost ones that parts behind them prove.

    lost : numbers of the lines that cannot be trusted.  manifest : None where it is damaged, and nothing can be said.
    """
    kept = [entry for entry in entries if entry.number not in lost]
    if not lost or manifest is None or not _can_grow(manifest):
        return kept
    found = _Proofs(lost, manifest["campaign"]["cases"])
    try:
        for entry in kept:
            found.take(entry)
    except ValueError:  # a line that contradicts those put back: they prove nothing
        return kept
    return sorted([*kept, *found.extensions.values()], key=lambda entry: entry.number)


def _can_grow(manifest: Mapping[str, Any]) -> bool:
    from mc_engine.designs import EXTENSIBLE  # which loads SciPy, for the rare journal that has lost a line

    alone = manifest.get("shard") is None and manifest.get("upstream") is None
    return alone and manifest["campaign"].get("design", "mc") in EXTENSIBLE


class _Proofs:
    """What the lines taken so far prove.  extensions : the lines to put back, by number."""

    def __init__(self, lost: Collection[int], cases: int):
        self.extensions: dict[int, Entry] = {}
        self._lost = sorted(lost)
        self._counted = Receipts(cases)
        self._last = 0  # number of the last extension, found or put back
        self._session, self._session_wants = 1, 0  # number of its first line; cases that it was to come to

    def take(self, entry: Entry) -> None:
        """One more line that can be trusted."""
        self._counted.take(entry)
        if entry.event == _EXTENDED:
            self._last = entry.number
        elif entry.event == "started":
            self._session, self._session_wants = entry.number, self._wants(entry)
            if self._session_wants > self._cases and not self._may_be_withdrawn(self._session_wants - self._cases):
                self._put_back(entry, self._session_wants)
        elif entry.event in ("part", "part-replaced"):
            stop = entry.facts["first"] + entry.facts["rows"]
            if stop > self._cases:
                self._put_back(entry, stop)

    @property
    def _cases(self) -> int:
        return self._counted.cases or 0

    def _may_be_withdrawn(self, rows: int) -> bool:
        """May the lost line have withdrawn a part of so many cases, which only seem to count?"""
        return any(part.rows == rows for part in self._counted.parts)

    def _wants(self, started: Entry) -> int:
        """Cases that the run was to come to in the session of this line; 0 where that is not certain."""
        missing = started.facts.get("missing")
        alone = sum(number < started.number for number in self._lost) == 1
        if not alone or type(missing) is not int or missing < 0:
            return 0
        wants = sum(part.rows for part in self._counted.parts) + missing
        return wants if wants <= MOST_CASES else 0

    def _put_back(self, proof: Entry, stop: int) -> None:
        """Let the run have the cases up to `stop`, by the lost line before the session, or else by one in it."""
        place = self._last_lost(self._session)
        if place is None and self._last not in self.extensions:
            place = self._last_lost(proof.number)
        if place is not None:
            self._last, stop = place, max(stop, self._session_wants if place < self._session else 0)
        elif self._last not in self.extensions:
            return  # no line is lost that could have asked for it
        self.extensions[self._last] = Entry(self._last, proof.at, _EXTENDED, {"cases": stop})
        self._counted.cases = stop

    def _last_lost(self, before: int) -> int | None:
        return max((number for number in self._lost if self._last < number < before), default=None)
