"""The reference of the command line, from the program itself."""

from collections.abc import Iterator
from typing import Any

import typer

from mc_engine.command_line import app as command_line
from mc_engine.command_line.commands import app
from mc_engine.documentation.markdown_text import code, escaped, prose, table

_HEAD = """# The command line

Made from the program: `mc-engine COMMAND --help` says the same. `python -m mc_engine COMMAND` is the same program.
"""


def commands() -> dict[str, Any]:
    """The commands by name, as the command line reads them."""
    group: Any = typer.main.get_command(app)
    return dict(group.commands)


def page() -> str:
    """A section per command with its arguments and options; the exit statuses first."""
    parts = [_HEAD, prose((command_line.__doc__ or "").split("\n", 1)[1]) + "\n"]
    for name, command in commands().items():
        parts += _verb(name, command)
    return "\n".join(parts)


def _verb(name: str, command: Any) -> Iterator[str]:
    arguments = [_option_value(param) for param in command.params if param.param_type_name == "argument"]
    usage = " ".join(["mc-engine", name, *arguments, "[OPTIONS]"])
    yield f"## {name}\n\n```text\n{usage}\n```\n\n{prose(command.help or '')}\n\n{prose(command.epilog or '')}\n"
    rows = [(code(_option_names(param)), escaped(param.help or ""), _default(param)) for param in command.params]
    yield (table(("Argument or option", "Meaning", "Default"), rows) + "\n") if rows else ""


def _option_value(option: Any) -> str:
    """The word that stands for a value; of the library's own, which differ between its versions, none is used."""
    return str(option.metavar or option.name.upper())


def _option_names(option: Any) -> str:
    if option.param_type_name == "argument":
        return _option_value(option)
    words = ", ".join([*option.opts, *option.secondary_opts])
    return words if option.is_flag else f"{words} {_option_value(option)}"


def _default(option: Any) -> str:
    if option.required:
        return "required"
    if option.default is True:
        return code(option.opts[0])
    return "" if option.default in (None, False, (), []) or callable(option.default) else code(str(option.default))
