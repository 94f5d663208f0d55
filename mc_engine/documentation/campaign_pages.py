"""The reference of the shipped campaigns: their files, and all inputs and results."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path

import numpy as np

from mc_engine.campaign.search import SHIPPED, ShippedCampaign, campaign_section, list_campaigns
from mc_engine.documentation.markdown_text import code, escaped, table
from mc_engine.model import AdaptiveStep, Event, Model, Named, Parameter, Setting, load_model
from mc_engine.status import STATUS_MEANING
from mc_engine.studies.published_table import campaign_table

_COLUMNS = """# Columns of a run

One row a case in `cases/*.parquet` of a run directory. Units are in the columns' names, in the Parquet metadata of each
field, and in `Store.units`. The nominal case is kept apart, in `nominal.parquet`, and enters no statistic.

| Column | Meaning |
|---|---|
| `case_id` | number of the case, from 0 on; it never changes |
| `status` | how the case ended, see below |
| `reason` | why a case failed, where more is known than its status |
| dispersions | a column per dispersed parameter, under its name |
| metrics | a column per metric of the model; not a number where the case failed |
| `end_time_s`, `end_…` | of a compiled model: the time and the last state of the case, a column per state |
| `end_phase` | of a model with phases: the last phase |

## How a case ended

"""


def pages() -> Iterator[tuple[str, str]]:
    """A page for what all runs have in common, and one a model."""
    statuses = [(code(name), escaped(text)) for name, text in STATUS_MEANING.items()]
    groups = {
        name: list(files) for name, files in groupby(list_campaigns(), lambda campaign: campaign.path.parent.name)
    }
    names = "\n".join(f"- [{name}](campaigns/{name}.md)" for name in groups)
    toctree = "\n".join(f"campaigns/{name}" for name in groups)
    hidden = f"```{{toctree}}\n:hidden:\n\n{toctree}\n```"
    common = [_COLUMNS + table(("Status", "Meaning"), statuses), "## The columns of each campaign", names, hidden]
    yield "columns.md", "\n\n".join(common) + "\n"
    for name, files in groups.items():
        yield f"campaigns/{name}.md", campaign_page(name, files)


def campaign_page(name: str, files: Sequence[ShippedCampaign]) -> str:
    """All campaign files of the folder campaigns/`name`, and the columns of each model that they fly."""
    folder = SHIPPED / name
    references = [model_reference(file.path) for file in files]
    models = {reference: load_model(reference, folder) for reference in dict.fromkeys(references)}
    parts = [f"# {name}"]
    for reference, model in models.items():
        shown = [file for file, flies in zip(files, references, strict=True) if flies == reference]
        parts += _model(model, reference, shown, len(models) == 1)
    if (folder / "published.toml").is_file():
        parts += ["## Validation against published results", campaign_table(folder / "published.toml")]
    return "\n\n".join(parts) + "\n"


def model_reference(path: Path) -> str:
    """The model that a campaign file names."""
    return str(campaign_section(path)["model"])


def _model(model: Model, reference: str, files: Sequence[ShippedCampaign], alone: bool) -> Iterator[str]:
    """One model's files and columns, under a heading of its own where the folder has several."""
    if not alone:
        yield f"## {escaped(model.title)}"
    yield f"{escaped(model.title)}: the model {code(reference)}."
    if model.source:
        yield f"Source: {escaped(model.source)}."
    level = "##" if alone else "###"
    yield f"{level} Campaign files"
    yield table(("Name", "Title"), [(code(file.name), escaped(file.title)) for file in files])
    yield from _column_tables(model, level)


def _column_tables(model: Model, level: str) -> Iterator[str]:
    rows = [
        (*_meaning(parameter), f"{parameter.default:.10g}", _accepted_values(parameter))
        for parameter in model.parameters
    ]
    yield f"{level} Parameters"
    yield table(("Parameter", "Unit", "Meaning", "Nominal", "Allowed"), rows)
    if model.settings:
        yield f"{level} Settings"
        yield "The same for all cases of a run; `[parameters]` of a campaign file sets them."
        settings = [(*_meaning(setting), code(_word(setting.default)), _choices(setting)) for setting in model.settings]
        yield table(("Setting", "Unit", "Meaning", "Default", "Allowed"), settings)
    for title, fields in (("Metrics", model.metrics), ("States", model.states), ("Histories", model.quantities)):
        yield f"{level} {title}"
        yield _INTRODUCTION[title]
        yield table(("Column", "Unit", "Meaning"), [_meaning(field, title == "States") for field in fields])
    yield f"{level} Flight"
    yield _flight(model)


_INTRODUCTION = {
    "Metrics": "One number a case.",
    "States": "What the integrator carries; its last value stands in the table of cases.",
    "Histories": "Along the flight of the cases whose history is saved, besides `case_id`, `t_s` and the states.",
}


def _meaning(field: Named, at_the_end: bool = False) -> tuple[str, str, str]:
    return (
        code(f"end_{field.name}" if at_the_end else field.name),
        escaped(field.unit) or "–",
        escaped(field.description),
    )


def _accepted_values(item: Parameter | Setting) -> str:
    if np.isinf(item.low) and np.isinf(item.high):
        return ""
    if np.isinf(item.high):
        return f"≥ {item.low:.10g}"
    return f"≤ {item.high:.10g}" if np.isinf(item.low) else f"{item.low:.10g} … {item.high:.10g}"


def _choices(setting: Setting) -> str:
    if setting.date:
        return "a date in UTC"
    return ", ".join(code(word) for word in setting.choices) or _accepted_values(setting)


def _word(value: str | bool | float) -> str:
    return str(value).lower() if isinstance(value, bool) else value if isinstance(value, str) else f"{value:.10g}"


def _flight(model: Model) -> str:
    clock = model.clock
    stepping = (
        f"Steps chosen by each case ({clock.method}), relative error {_shown(clock.rtol)} a step"
        if isinstance(clock, AdaptiveStep)
        else f"Steps of {_shown(clock.step)} on a common grid ({clock.method})"
    )
    events = [(code(event.name), event.direction, _action(event)) for event in model.event_list]
    listed = "\n\n" + table(("Event", "Crossing", "Then"), events) if events else ""
    return f"{stepping}, up to {_shown(clock.until)}.{listed}"


def _action(event: Event) -> str:
    if event.after:
        return f"acts after {code(event.after) if isinstance(event.after, str) else f'{event.after:g} s'}"
    if event.to:
        return f"begins the phase {code(event.to)}"
    return "ends the case" if event.action == "stop" else "switches the model"


def _shown(value: object) -> str:
    """A number of the clock, or the setting that holds it."""
    return f"the setting {code(value)}" if isinstance(value, str) else f"{value:g}"
