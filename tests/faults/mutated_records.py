"""Mutations of a run's manifest and tables for which every checksum holds, and what a command makes of them."""

import copy
import json
from hashlib import sha256

from typer.testing import CliRunner

from mc_engine.command_line.commands import app
from mc_engine.store.journal import encode, scan

ODD = (
    None, True, False, 0, -1, 1, 10**30, 2**63, 1e308, -1e308, float("nan"), float("inf"), 1e-300, "", "x", "\x1b[31m",
    "\u202e", "\ud800", "a" * 3000, "../../etc/passwd", "/etc/hostname", [], {}, [[]], [None], {"a": 1}, [1, 2], ["a"],
    {"": None}, "9" * 400,
)  # fmt: skip
NEW_KEYS = ("extra", "name", "kind", "unit", "x", "\ud800")


def mutated(record, rng):
    """A copy of a JSON record, mutated in one to three places."""
    record = copy.deepcopy(record)
    for _ in range(int(rng.integers(1, 4))):
        places = [place for place in _places(record) if place]
        place = places[rng.integers(len(places))]
        parent = _at(record, place[:-1])
        kind = int(rng.integers(7))
        if kind < 2:
            parent[place[-1]] = copy.deepcopy(ODD[rng.integers(len(ODD))])
        elif kind == 2:
            del parent[place[-1]]
        elif kind == 3 and isinstance(parent, dict):
            parent[NEW_KEYS[rng.integers(len(NEW_KEYS))]] = copy.deepcopy(ODD[rng.integers(len(ODD))])
        elif kind in (3, 4) and isinstance(parent, list):
            parent.append(copy.deepcopy(parent[place[-1]]))
        elif kind == 5:
            parent[place[-1]] = copy.deepcopy(_at(record, places[rng.integers(len(places))]))
        else:
            for _ in range((1, 5, 300)[rng.integers(3)]):
                parent[place[-1]] = [parent[place[-1]]]
    return record


def _places(record, place=()):
    yield place
    inside = record.items() if isinstance(record, dict) else enumerate(record) if isinstance(record, list) else ()
    for key, value in inside:
        yield from _places(value, (*place, key))


def _at(record, place):
    for key in place:
        record = record[key]
    return record


def put_manifest(run, content):
    """The bytes as the manifest of a run, with its digest in the journal."""
    (run / "manifest.json").write_bytes(content)
    vouch(run, manifest=sha256(content).hexdigest())


def vouch(run, **facts):
    entries = scan((run / "journal.jsonl").read_bytes()).entries
    entries[0].facts.update(facts)
    lines = [encode(number, entry.at, entry.event, entry.facts) for number, entry in enumerate(entries, start=1)]
    (run / "journal.jsonl").write_bytes(b"".join(lines))


def call(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def assert_answered(done, *statuses):
    """One of the exit statuses, and in all but 0 a sentence; neither traceback nor raw warning."""
    assert done.exit_code in statuses, (done.exit_code, done.output, done.exception)
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    assert "Traceback" not in done.output
    assert "Warning:" not in done.output
    assert done.exit_code == 0 or done.stderr.strip()


def dumped(record):
    """The record as JSON; None where the mutation is none that JSON can hold."""
    try:
        return json.dumps(record).encode()
    except (ValueError, RecursionError):
        return None
