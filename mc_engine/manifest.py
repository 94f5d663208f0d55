"""The manifest of a run: all that is known before the first case flies, as plain data; and the table's columns."""

from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

from mc_engine.campaign import Campaign
from mc_engine.cases import dispersion_records
from mc_engine.figures import to_record
from mc_engine.flight import END_TIME
from mc_engine.input_values import inputs_of
from mc_engine.journal import utc_now
from mc_engine.kernel import source_digest
from mc_engine.model import Field, Parameter, Setting
from mc_engine.parts import Column
from mc_engine.provenance import engine_version, environment
from mc_engine.status import STATUS_NAME, STATUS_TEXT
from mc_engine.streams import SEED_CONTRACT

_SAMPLING = (
    "cases",
    "correlation",
    "designs",
    "dispersions",
    "distribution_keys",
    "distributions",
    "flight",
    "halton",
    "sobol",
    "sobol_numbers",
    "streams",
)


def sampling_digest() -> str:
    """SHA-256 over the sources that draw the inputs of a case and hand them to its kernel."""
    digest = sha256()
    for name in _SAMPLING:
        digest.update(f"{name}\n".encode() + Path(__file__).with_name(f"{name}.py").read_bytes())
    return digest.hexdigest()


def columns_of(campaign: Campaign) -> list[Column]:
    """Columns of the case table after case_id, status and reason: dispersions, metrics, last state."""
    model = campaign.model
    columns = [_input_column(model.input(one.name)) for one in campaign.dispersions]
    columns += [Column(one.name, one.unit, "metric", one.description) for one in model.metrics]
    columns.append(Column(END_TIME, "s", "state", "time at the end of the flight, from its start"))
    columns += [Column(f"end_{one.name}", one.unit, "state", f"{one.description}, at the end") for one in model.states]
    return columns


def _input_column(item: Parameter | Setting) -> Column:
    kind = "number"
    if isinstance(item, Setting) and item.choices:
        kind = "word"
    elif isinstance(item.default, bool):
        kind = "switch"
    return Column(item.name, item.unit, "dispersion", item.description, kind)


def manifest_of(campaign: Campaign) -> dict[str, Any]:
    """The manifest, without the columns, which the store adds."""
    model = campaign.model
    return {
        "format": 1,
        "engine": engine_version(),
        "created_utc": utc_now(),
        "seed_contract": SEED_CONTRACT,
        "campaign": {
            "name": campaign.name,
            "title": campaign.title,
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
            "digest": source_digest(model, campaign.directory),
            "sampling_digest": sampling_digest(),
        },
        "inputs": dispersion_records(campaign),
        **_shared_inputs(campaign),
        "quantities": [_record(one) for one in model.quantities],
        "requirements": [asdict(one) for one in campaign.requirements],
        "figures": [to_record(figure) for figure in model.figures],
        "published": [dict(record) for record in model.published],
        "status_texts": {STATUS_NAME[code]: text for code, text in STATUS_TEXT.items()},
        "provenance": environment(),
    }


def _record(item: Field) -> dict[str, str]:
    return {"name": item.name, "unit": item.unit, "description": item.description}


def _shared_inputs(campaign: Campaign) -> dict[str, list[dict[str, Any]]]:
    """Parameters and settings that are the same in all cases."""
    dispersed = {one.name for one in campaign.dispersions}
    parameters, settings = [], []
    for name, item in inputs_of(campaign.model).items():
        if name in dispersed:
            continue
        record = {**_record(item), "value": campaign.nominal[name]}
        if isinstance(item, Setting):
            settings.append({**record, "choices": list(item.choices)})
        else:
            parameters.append({**record, "overridden": name in campaign.parameters})
    return {"parameters": parameters, "settings": settings}
