"""The application of the command line, `mc-engine COMMAND`, with all its commands.

Each command imports what it needs itself: `--help`, `check`, `list`, `schema`, `plan` and `status` load neither numba
nor matplotlib.
"""

from typer.models import CommandInfo

from mc_engine.command_line import (  # noqa: F401 - each adds its commands
    after_flight,
    before_flight,
    flight,
    inspection,
    studies,
)
from mc_engine.command_line.app import app

__all__ = ["RUNS_CODE", "RUNS_NO_CODE", "app"]

_IN_ORDER = (
    *("init", "check", "plan", "sample", "list", "schema"),
    *("run", "resume", "extend", "rerun", "merge", "import", "replay", "debug"),
    *("tune", "rare", "report", "status", "summary", "verify", "compare", "export", "publish", "fetch"),
    *("published", "bench", "units"),
)
# Every command is in one of these sets, which its help and the documentation's page on trust state.
RUNS_CODE = frozenset(
    (
        *("check", "plan", "sample", "run", "resume", "extend", "rerun", "merge", "import", "replay"),
        *("debug", "tune", "rare", "bench"),
        "published",  # with --compute
    )
)
RUNS_NO_CODE = frozenset(_IN_ORDER) - RUNS_CODE
_CODE = "Runs code: the model of the campaign or run, with your rights; only for those that you trust."
_NO_CODE = "Runs no code of a campaign or run, whoever made it."


def _name(command: CommandInfo) -> str:
    return str(command.name or getattr(command.callback, "__name__", ""))


app.registered_commands.sort(key=lambda command: _IN_ORDER.index(_name(command)))
for _command in app.registered_commands:
    _command.epilog = _CODE if _name(_command) in RUNS_CODE else _NO_CODE
