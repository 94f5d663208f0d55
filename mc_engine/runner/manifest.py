"""The manifest of a run: all that is known before the first case flies, as plain data.  No user names, no paths."""

import platform
import subprocess
from dataclasses import asdict
from hashlib import sha256
from importlib import metadata
from math import isfinite
from pathlib import Path
from typing import Any

from mc_engine.campaign.cases import dispersion_records
from mc_engine.campaign.columns import case_columns
from mc_engine.campaign.loading import Campaign
from mc_engine.flight.flyers import flyer_of
from mc_engine.model.fields import Named, Setting, inputs_of
from mc_engine.model.figures import to_record
from mc_engine.model.record import Model
from mc_engine.model.simulator import System
from mc_engine.sampling.streams import SEED_CONTRACT
from mc_engine.status import STATUS_MEANING
from mc_engine.store.journal import utc_now
from mc_engine.store.parts import Column

PACKAGES = ("numpy", "scipy", "pyerfa", "numba", "llvmlite", "pandas", "pyarrow", "joblib", "pydantic")


def sampling_digest() -> str:
    """SHA-256 over the sources that draw the inputs of a case and hand them to its kernel."""
    engine, digest = Path(__file__).parents[1], sha256()
    files = [path for folder in ("sampling", "campaign") for path in (engine / folder).iterdir() if path.is_file()]
    for path in sorted(files):
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
    return digest.hexdigest()


def columns_of(campaign: Campaign) -> list[Column]:
    """Columns of the case table after case_id, status and reason."""
    from_upstream = () if campaign.upstream is None else campaign.upstream.columns
    return case_columns(campaign.model, campaign.dispersions, from_upstream)


def manifest_of(campaign: Campaign) -> dict[str, Any]:
    """The manifest, except its columns, which `create_store` adds."""
    model = campaign.model
    return {
        "format": 1,
        "engine": engine_version(),
        "created_utc": utc_now(),
        "seed_contract": SEED_CONTRACT,
        "campaign": {
            "name": campaign.name,
            "title": campaign.title,
            "note": campaign.note,
            "model": campaign.model_reference,
            "design": campaign.design,
            "seed": campaign.seed,
            "cases": campaign.cases,
            "digest": campaign.digest,
        },
        "model": {
            "name": model.name,
            "title": model.title,
            "source": model.source,
            "digest": flyer_of(campaign).digest(),
            "sampling_digest": sampling_digest(),
        },
        "inputs": [*_upstream_inputs(campaign), *dispersion_records(campaign)],
        "correlations": [asdict(pair) for pair in campaign.correlations],
        **_constant_inputs(campaign),
        "quantities": [_description(quantity) for quantity in model.quantities],
        "ranges": _ranges(campaign.model),
        "event_times": list(model.event_times) if isinstance(model, Model) else [],
        "metric_outputs": dict(model.metric_outputs) if isinstance(model, Model) else {},
        "requirements": [asdict(requirement) for requirement in campaign.requirements],
        "report": campaign.report.model_dump(),
        "looks": list(campaign.looks),
        "histories_of_first": _histories_of_first(campaign),
        "figures": [*(to_record(figure) for figure in model.figures), *_upstream_figures(campaign)],
        "published": [dict(record) for record in model.published],
        "upstream": _upstream_facts(campaign),
        "status_texts": dict(STATUS_MEANING),
        "provenance": environment(),
    }


def _upstream_facts(campaign: Campaign) -> dict[str, Any] | None:
    """Identity of the run from which the campaign takes its inputs, or None."""
    if campaign.upstream is None:
        return None
    facts = {key: campaign.upstream.rows.facts[key] for key in ("name", "title", "model", "design", "seed", "digest")}
    failed = int(campaign.upstream.failed.sum())
    return {**facts, "cases": campaign.upstream.rows.n_cases, "failed": failed, "links": dict(campaign.upstream.links)}


def _upstream_inputs(campaign: Campaign) -> list[dict[str, Any]]:
    """The dispersions of the upstream run, from its manifest, under the names that they have here."""
    if campaign.upstream is None:
        return []
    upstream, name = campaign.upstream, campaign.upstream.name
    records = [{**record, "name": upstream.name_here(record["name"])} for record in upstream.rows.facts["inputs"]]
    return [
        {**record, "note": f"in the run of {name}. {record['note']}".strip()} for record in records if record["name"]
    ]


def _upstream_figures(campaign: Campaign) -> list[dict[str, Any]]:
    """Maps and scatter plots of the upstream run, with the names that its columns have here."""
    if campaign.upstream is None:
        return []
    figures = []
    for record in campaign.upstream.rows.facts["figures"]:
        axes = [key for key in ("x", "y", "metric") if key in record]
        named = {key: campaign.upstream.name_here(record[key]) for key in axes}
        if record["kind"] in ("map", "scatter") and all(named.values()):
            figures.append({**record, **named})
    return figures


def _histories_of_first(campaign: Campaign) -> int:
    """How many cases, from case 0 on, keep their history whatever their result; one after them may be a worst case."""
    listed, n = {*campaign.retention.cases}, campaign.retention.first
    while n in listed:
        n += 1
    return n


def _description(item: Named) -> dict[str, str]:
    return {"name": item.name, "unit": item.unit, "description": item.description}


def _ranges(model: System) -> dict[str, list[float | None]]:
    """Bounds of the physical range of each metric and output that has one; None for an open end."""
    fields = [*model.quantities, *model.metrics]
    ends = {field.name: [end if isfinite(end) else None for end in (field.low, field.high)] for field in fields}
    return {name: pair for name, pair in ends.items() if pair != [None, None]}


def _constant_inputs(campaign: Campaign) -> dict[str, list[dict[str, Any]]]:
    """Parameters and settings that are the same in all cases."""
    varying = {dispersion.name for dispersion in campaign.dispersions}
    varying |= set() if campaign.upstream is None else campaign.upstream.links.keys()
    parameters, settings = [], []
    for name, item in inputs_of(campaign.model).items():
        if name in varying:
            continue
        record = {**_description(item), "value": campaign.nominal[name], "overridden": name in campaign.parameters}
        if isinstance(item, Setting):
            settings.append({**record, "choices": list(item.choices)})
        else:
            parameters.append(record)
    return {"parameters": parameters, "settings": settings}


def engine_version() -> str:
    """Version of the installed engine; "source" where it runs without being installed."""
    try:
        return metadata.version("mc-engine")
    except metadata.PackageNotFoundError:
        return "source"


def environment() -> dict[str, Any]:
    """Interpreter, platform, processor, packages, and the git state of the engine's own sources."""
    import llvmlite.binding as llvm

    return {
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "cpu": str(llvm.get_host_cpu_name()),
        "packages": {name: metadata.version(name) for name in PACKAGES},
        "numba": metadata.version("numba"),
        "llvm": ".".join(map(str, llvm.llvm_version_info)),
        "git": git_state(Path(__file__).parents[1]),
        "seed_contract": SEED_CONTRACT,
    }


def git_state(folder: Path) -> dict[str, Any] | None:
    """Last commit that changed `folder`, and whether the folder differs from it; None outside a repository."""
    commit = _git(folder, "log", "-1", "--format=%H", "--", ".")
    if not commit:
        return None
    return {"commit": commit, "dirty": bool(_git(folder, "status", "--porcelain", "--", "."))}


def _git(folder: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=10.0, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
