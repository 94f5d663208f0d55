"""Differences in code and campaign between two runs, from their manifests and campaign files."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import unified_diff
from typing import Any

from mc_engine.runner.manifest import environment

SHOWN_OF_A_DIGEST = 12


@dataclass(frozen=True)
class Difference:
    """One difference between two runs: before and after, in words; "none" if a run has no such item."""

    what: str
    before: str
    after: str


def code_differences(a: Mapping[str, Any], b: Mapping[str, Any]) -> tuple[Difference, ...]:
    """Engine, model, sampling, packages and processor, of two manifests; empty if all of them agree."""
    return _differences(_code_facts(a), _code_facts(b))


def campaign_differences(a: Mapping[str, Any], b: Mapping[str, Any]) -> tuple[Difference, ...]:
    """Design, seed, number of cases, dispersions, parameters, settings and requirements, of two manifests."""
    return _differences(_campaign_facts(a), _campaign_facts(b))


def machine_changes(manifest: Mapping[str, Any]) -> tuple[Difference, ...]:
    """In what the processor and packages at hand differ from those that a run names."""
    flown = {what: fact for what, fact in _machine_facts(manifest.get("provenance", {})).items() if fact}
    present = _machine_facts(environment())
    return _differences(flown, {what: present[what] for what in flown if what in present})


def campaign_diff(a: str, b: str) -> tuple[str, ...]:
    """The lines of the two campaign files that differ, each with one line about it, as `diff -u` marks them."""
    lines = unified_diff(a.splitlines(), b.splitlines(), "A", "B", lineterm="", n=1)
    return tuple(lines)[2:]  # after the names


def _differences(a: Mapping[str, str], b: Mapping[str, str]) -> tuple[Difference, ...]:
    names = dict.fromkeys([*a, *b])
    return tuple(
        Difference(name, a.get(name, "none"), b.get(name, "none"))
        for name in names
        if a.get(name, "none") != b.get(name, "none")
    )


def _code_facts(manifest: Mapping[str, Any]) -> dict[str, str]:
    model, made = manifest.get("model", {}), manifest.get("provenance", {})
    facts = {
        "engine": str(manifest.get("engine", "")),
        "model sources": _short(model.get("digest")),
        "sampling sources": _short(model.get("sampling_digest")),
        "seed contract": str(manifest.get("seed_contract", "")),
        "git": _git(made.get("git")),
    }
    return {**facts, **_machine_facts(made)}


def _machine_facts(made: Mapping[str, Any]) -> dict[str, str]:
    facts = {key: str(made.get(key, "")) for key in ("python", "platform", "cpu", "llvm")}
    packages = made.get("packages", {})
    return {**facts, **{f"package {name}": str(version) for name, version in packages.items()}}


def _campaign_facts(manifest: Mapping[str, Any]) -> dict[str, str]:
    campaign = manifest.get("campaign", {})
    facts = {key: str(campaign.get(key, "")) for key in ("model", "design", "seed", "cases")}
    if looks := manifest.get("looks"):  # `cases` is then the number at the first interim analysis
        facts["cases"] = f"until verdict, at most {looks[-1]}"
    for record in manifest.get("inputs", []):
        facts[f"dispersion {record['name']}"] = ", ".join(
            str(record[key]) for key in ("distribution", "bounds") if record.get(key)
        )
        facts[f"nominal {record['name']}"] = str(record.get("nominal", ""))
    for kind in ("parameter", "setting"):
        for record in manifest.get(f"{kind}s", []):
            facts[f"{kind} {record['name']}"] = f"{record.get('value', '')} {record.get('unit', '')}".strip()
    for record in manifest.get("requirements", []):
        facts[f"requirement {record['name']}"] = _requirement(record)
    return facts


def _requirement(record: Mapping[str, Any]) -> str:
    limits = [
        f"{words} {record[key]:,.12g}"
        for key, words in (("at_least", "at least"), ("at_most", "at most"))
        if record.get(key) is not None
    ]
    wanted = f"in {record.get('share')} of the cases with confidence {record.get('confidence')}"
    return f"{record.get('metric')} {' and '.join(limits)} {wanted}"


def _short(digest: Any) -> str:
    return str(digest or "")[:SHOWN_OF_A_DIGEST]


def _git(state: Mapping[str, Any] | None) -> str:
    if not state:
        return "none"
    return f"{_short(state.get('commit'))}{' with uncommitted changes' if state.get('dirty') else ''}"


def changed_lines(differences: tuple[Difference, ...]) -> Iterator[str]:
    """A line each, for the terminal."""
    for difference in differences:
        yield f"{difference.what}: {difference.before} -> {difference.after}"
