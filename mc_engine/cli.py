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

__all__ = ["app"]

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
