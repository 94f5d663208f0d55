"""Where the numbers come from: versions, digests, seed, machine kind and timing, enough to make them again."""

from collections.abc import Iterator, Mapping
from typing import Any

from reports.document import Cell, Column, Table
from reports.flown import Flown
from reports.numbers import count, exact, number, with_unit, words

TIMED_EVENTS = ("timing", "finished")


def provenance_table(flown: Flown) -> Table:
    """Everything the manifest says of its own making, a line each."""
    columns = (Column("What", "text", 1.6), Column("Value", "code", 4.0))
    rows = tuple((Cell(what), Cell(text)) for what, text in _facts(flown) if text)
    return Table("Provenance of the run", columns, rows)


def _facts(flown: Flown) -> Iterator[tuple[str, str]]:
    manifest, campaign = flown.manifest, flown.campaign
    model, made = manifest.get("model", {}), manifest.get("provenance", {})
    yield "run directory", flown.name
    yield "run started (UTC)", str(manifest.get("created_utc", ""))
    yield "engine", str(manifest.get("engine", ""))
    yield "campaign", str(campaign.get("name", ""))
    yield "campaign digest", str(campaign.get("digest", ""))
    yield "model", str(campaign.get("model", "") or model.get("name", ""))
    yield "model source digest", str(model.get("digest", ""))
    yield "published source", str(model.get("source", ""))
    yield "design", flown.design
    yield "seed", str(campaign.get("seed", ""))
    yield "seed contract", str(manifest.get("seed_contract", ""))
    yield "cases flown / required", f"{count(flown.n_tried)} / {count(flown.n_wanted)}"
    yield "git", git_text(made.get("git"))
    for key in ("python", "platform", "cpu", "numba", "llvm"):
        yield key, str(made.get(key, ""))
    packages = made.get("packages", {})
    yield "packages", ", ".join(f"{name} {version}" for name, version in sorted(packages.items()))
    yield from timing_facts(flown)


def git_text(git: Mapping[str, Any] | None) -> str:
    """Commit, and whether files differed from it."""
    if not git:
        return "not a git checkout"
    return f"{git.get('commit', '')}{', with uncommitted changes' if git.get('dirty') else ''}"


def timing_facts(flown: Flown) -> Iterator[tuple[str, str]]:
    """Times from the manifest and from the journal's notes on timing, the later ones last."""
    notes = getattr(flown.run, "notes", None)
    entries = notes() if callable(notes) else []
    facts: dict[str, Any] = dict(manifest_timing(flown.manifest.get("timing")))
    for entry in entries:
        if entry.event in TIMED_EVENTS:
            facts.update(manifest_timing(entry.facts))
    for name, value in facts.items():
        yield f"timing: {words(name, 's')}", with_unit(number(value, 4), "s" if name.endswith("_s") else "")


def manifest_timing(record: Any) -> dict[str, float]:
    """The numbers among the facts of a note."""
    if not isinstance(record, Mapping):
        return {}
    return {str(key): float(value) for key, value in record.items() if type(value) in (int, float)}


def campaign_facts(flown: Flown) -> tuple[tuple[str, str], ...]:
    """The line under the title."""
    campaign = flown.campaign
    facts = (
        ("Campaign", str(campaign.get("name", ""))),
        ("Model", str(flown.manifest.get("model", {}).get("title", ""))),
        (
            "Cases",
            f"{count(flown.n_tried)} flown of {count(flown.n_wanted)}, {count(flown.every.completed)} completed",
        ),
        ("Design", f"{flown.design}, seed {exact(str(campaign.get('seed', '–')))}"),
        ("Run", str(flown.manifest.get("created_utc", ""))[:16].replace("T", " ") + " UTC"),
        ("Engine", f"mc-engine {flown.manifest.get('engine', '')}"),
    )
    return tuple((what, text) for what, text in facts if text.strip())
