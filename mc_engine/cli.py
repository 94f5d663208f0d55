"""The command line, `mc-engine VERB`.

Every verb imports what it needs itself: `--help`, `check`, `list`, `schema`, `plan` and `status` load neither
numba nor matplotlib.
"""

from types import ModuleType

from mc_engine import (
    verbs_after_flight,
    verbs_before_flight,
    verbs_of_comparison,
    verbs_of_export,
    verbs_of_flight,
    verbs_of_object_stores,
    verbs_of_rare_events,
    verbs_of_sources,
    verbs_of_speed,
    verbs_of_tuning,
    verbs_of_units,
)
from mc_engine.command_line import app

__all__ = ["RUNS_CODE", "RUNS_NO_CODE", "app"]

# Every verb is in one of them, and says so in its help; a test holds both, and the page on trust.
RUNS_CODE = frozenset(
    ("check", "plan", "sample", "run", "resume", "extend", "rerun", "merge", "replay", "tune", "rare", "bench")
)
RUNS_NO_CODE = frozenset(
    ("init", "list", "schema", "units", "published", "report", "status", "summary", "verify", "compare", "export")
) | {"publish", "fetch"}
_OF_CODE = "Runs code: the model of the campaign or run, with your rights; only for those that you trust."
_OF_NO_CODE = "Runs no code of a campaign or run, whoever made it."

_IN_ORDER: tuple[ModuleType, ...] = (
    verbs_before_flight,
    verbs_of_flight,
    verbs_of_tuning,
    verbs_of_rare_events,
    verbs_after_flight,
    verbs_of_comparison,
    verbs_of_export,
    verbs_of_object_stores,
    verbs_of_sources,
    verbs_of_speed,
    verbs_of_units,
)
_MODULES = [module.__name__ for module in _IN_ORDER]
app.registered_commands.sort(key=lambda verb: _MODULES.index(verb.callback.__module__) if verb.callback else 0)
for _verb in app.registered_commands:
    _verb.epilog = _OF_CODE if (_verb.name or getattr(_verb.callback, "__name__", "")) in RUNS_CODE else _OF_NO_CODE
