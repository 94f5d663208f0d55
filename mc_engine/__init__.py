"""Monte Carlo dispersion campaigns for spacecraft guidance, navigation and control.

The public names load what they need when they are first used: the command line starts without numba or pandas.
"""

from importlib import import_module

TYPE_CHECKING = False  # not from `typing`, for which `python -m mc_engine` would look in the working folder
if TYPE_CHECKING:
    from mc_engine.campaign.cases import case_table
    from mc_engine.campaign.loading import Campaign, load_campaign
    from mc_engine.campaign.search import list_campaigns
    from mc_engine.errors import CampaignError, EngineError, ModelError, RunInterrupted, StoreError
    from mc_engine.model.fields import AdaptiveStep, Event, Extremum, Field, FixedStep, Parameter, Setting
    from mc_engine.model.record import Model, Refusals
    from mc_engine.model.simulator import Refuse, Simulator
    from mc_engine.runner.runner import Replay, extend, replay, resume, run
    from mc_engine.store.opening import open_store
    from mc_engine.store.store import Store
    from mc_engine.studies.opened_run import Case, Run, open_run
    from mc_engine.studies.tuning import tune
    from mc_engine.studies.tuning_folder import TuningRecord, open_tuning

_HOME = {
    "campaign.loading": ("Campaign", "load_campaign"),
    "campaign.search": ("list_campaigns",),
    "campaign.cases": ("case_table",),
    "errors": ("CampaignError", "EngineError", "ModelError", "RunInterrupted", "StoreError"),
    "model.record": (
        "AdaptiveStep",
        "Event",
        "Extremum",
        "Field",
        "FixedStep",
        "Model",
        "Parameter",
        "Refusals",
        "Setting",
    ),
    "model.simulator": ("Refuse", "Simulator"),
    "studies.opened_run": ("Case", "Run", "open_run"),
    "runner.runner": ("Replay", "extend", "replay", "resume", "run"),
    "store.opening": ("open_store",),
    "store.store": ("Store",),
    "studies.tuning": ("tune",),
    "studies.tuning_folder": ("TuningRecord", "open_tuning"),
}
_MODULE = {name: module for module, names in _HOME.items() for name in names}

__all__ = [  # noqa: RUF022 - by module, as above
    "Campaign",
    "list_campaigns",
    "load_campaign",
    "case_table",
    "CampaignError",
    "EngineError",
    "ModelError",
    "RunInterrupted",
    "StoreError",
    "AdaptiveStep",
    "Event",
    "Extremum",
    "Field",
    "FixedStep",
    "Model",
    "Parameter",
    "Refusals",
    "Setting",
    "Refuse",
    "Simulator",
    "Case",
    "Run",
    "open_run",
    "Replay",
    "extend",
    "replay",
    "resume",
    "run",
    "Store",
    "open_store",
    "tune",
    "TuningRecord",
    "open_tuning",
]


def __getattr__(name: str) -> object:
    if name not in _MODULE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_MODULE[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
