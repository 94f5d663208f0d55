"""Provenance of a run: versions, digests, seed, machine kind and timing, enough to repeat the run."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from reports.document.blocks import Cell, Column, Table
from reports.run.flown import Flown
from reports.text.numbers import count, exact, number, with_unit, words


def provenance_table(flown: Flown) -> Table:
    """The provenance of a run."""
    campaign = flown.campaign
    cases = f"{count(flown.n_tried)} / {count(flown.n_wanted)}"
    own = [("design", flown.design), ("seed", campaign.get("seed", "")), ("cases flown / required", cases)]
    before = flown.manifest.get("upstream") or {}
    own += [(f"run upstream: {key}", before.get(key, "")) for key in ("name", "design", "seed", "cases", "digest")]
    return origin_table("run", flown.name, flown.manifest, own, _timing_facts(flown))


def origin_table(
    what: str,
    name: str,
    manifest: Mapping[str, Any],
    own: Iterable[tuple[str, Any]],
    more: Iterable[tuple[str, Any]] = (),
) -> Table:
    """Everything a manifest says of its own making, a line each.  own, more : facts of this kind of result alone."""
    campaign, model, made = (manifest.get(part, {}) for part in ("campaign", "model", "provenance"))
    facts = (
        ("directory", name),
        ("started (UTC)", manifest.get("created_utc", "")),
        ("engine", manifest.get("engine", "")),
        ("campaign", campaign.get("name", "")),
        ("imported from", (manifest.get("imported") or {}).get("file", "")),
        ("campaign digest", campaign.get("digest", "")),
        ("model", campaign.get("model", "") or model.get("name", "")),
        ("model source digest", model.get("digest", "")),
        ("published source", model.get("source", "")),
        *own,
        ("seed contract", manifest.get("seed_contract", "")),
        ("git", git_text(made.get("git"))),
        *((key, made.get(key, "")) for key in ("python", "platform", "cpu", "numba", "llvm")),
        (
            "packages",
            ", ".join(f"{package} {version}" for package, version in sorted(made.get("packages", {}).items())),
        ),
        *more,
    )
    rows = tuple((Cell(label), Cell(str(value))) for label, value in facts if str(value))
    return Table(f"Provenance of the {what}", (Column("What", "text"), Column("Value", "code")), rows)


def git_text(git: Mapping[str, Any] | None) -> str:
    """Commit, and whether files differed from it."""
    if not git:
        return "not a git checkout"
    return f"{git.get('commit', '')}{', with uncommitted changes' if git.get('dirty') else ''}"


def _timing_facts(flown: Flown) -> Iterator[tuple[str, str]]:
    """The numbers among the journal's notes on finished runs; the later ones count."""
    facts: dict[str, float] = {}
    for entry in flown.run.notes("finished"):
        facts |= {name: float(value) for name, value in entry.facts.items() if type(value) in (int, float)}
    for name, value in facts.items():
        yield f"timing: {words(name, 's')}", with_unit(number(value, 4), "s" if name.endswith("_s") else "")


def campaign_facts(flown: Flown) -> tuple[tuple[str, str], ...]:
    """The facts below the title: campaign, model, cases, design, date, engine."""
    campaign, imported = flown.campaign, flown.manifest.get("imported")
    came = f"flown of {count(flown.n_wanted)}"
    if imported:
        came = f"imported from {exact(imported['file'])}, not flown by the engine"
    facts = (
        ("Campaign", str(campaign.get("name", ""))),
        ("Model", str(flown.manifest.get("model", {}).get("title", ""))),
        ("Cases", f"{count(flown.n_tried)} {came}, {count(flown.every.completed)} completed"),
        ("Design", f"{flown.design}, seed {exact(str(campaign.get('seed', '–')))}"),
        ("Run", str(flown.manifest.get("created_utc", ""))[:16].replace("T", " ") + " UTC"),
        ("Engine", f"mc-engine {flown.manifest.get('engine', '')}"),
    )
    return tuple((what, text) for what, text in facts if text.strip())
