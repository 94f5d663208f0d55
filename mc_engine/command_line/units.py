"""The command that lists what a number can be in: units."""

import typer

from mc_engine.command_line.app import app, exit_status


@app.command()
@exit_status()
def units() -> None:
    """All units that a model or a campaign file can name, by what they measure; the first of each is that of SI."""
    from mc_engine.units import UNITS, by_quantity, other_endings

    groups = by_quantity()
    width = max(len(quantity) for quantity in groups)
    for quantity, names in groups.items():
        typer.echo(f"{quantity:<{width}}  {', '.join(names)}")
    others = ", ".join(f"{suffix} for {unit}" for unit, suffix in other_endings().items())
    typer.echo(f"\n{len(UNITS)} units; a column's name ends in its unit: {UNITS['N m'].suffix} for N m")
    typer.echo(f"Two end otherwise: {others}")
