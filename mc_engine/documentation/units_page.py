"""The reference of units, from the table that converts them."""

from mc_engine.documentation.markdown_text import code, table
from mc_engine.units import UNITS, by_quantity

_HEAD = """# Units

What a model may declare, and a campaign file may give as `unit` of a dispersion in place of the parameter's own.
Inside, all is SI and radians. The name of a column ends in its unit (`_days` for day, `_pct` for %); the name inside
physics does not.
`mc-engine units` prints the list.
"""


def page() -> str:
    """A table of all units by what they measure, with their SI values and the ends of names."""
    rows = [
        (quantity, code(name), code(UNITS[name].suffix), f"{UNITS[name].factor:.10g}")
        for quantity, names in by_quantity().items()
        for name in names
    ]
    return "\n\n".join([_HEAD, table(("Quantity", "Unit", "Ends of names", "In SI"), rows)]) + "\n"
