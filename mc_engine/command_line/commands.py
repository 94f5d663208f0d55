"""The command line, `mc-engine COMMAND`.

Every command imports what it needs itself: `--help`, `check`, `list`, `schema`, `plan` and `status` load neither
numba nor matplotlib.
"""

from types import ModuleType

from mc_engine.command_line import after_flight as verbs_after_flight
from mc_engine.command_line import before_flight as verbs_before_flight
from mc_engine.command_line import comparison as verbs_of_comparison
from mc_engine.command_line import export as verbs_of_export
from mc_engine.command_line import flight as verbs_of_flight
from mc_engine.command_line import object_stores as verbs_of_object_stores
from mc_engine.command_line import rare_events as verbs_of_rare_events
from mc_engine.command_line import sources as verbs_of_sources
from mc_engine.command_line import speed as verbs_of_speed
from mc_engine.command_line import tuning as verbs_of_tuning
from mc_engine.command_line import units as verbs_of_units
from mc_engine.command_line.app import app

__all__ = ["RUNS_CODE", "RUNS_NO_CODE", "app"]

# Every command is in one of them, and says so in its help; a test holds both, and the page on trust.
RUNS_CODE = frozenset(
    ("check", "plan", "sample", "run", "resume", "extend", "rerun", "merge", "replay", "tune", "rare", "bench")
) | {"published"}  # with --compute
RUNS_NO_CODE = frozenset(
    ("init", "list", "schema", "units", "report", "status", "summary", "verify", "compare", "export")
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
app.registered_commands.sort(key=lambda command: _MODULES.index(command.callback.__module__) if command.callback else 0)
for _verb in app.registered_commands:
    _verb.epilog = _OF_CODE if (_verb.name or getattr(_verb.callback, "__name__", "")) in RUNS_CODE else _OF_NO_CODE
