"""The reference pages of units, from the table that converts them, and of the terms that reports use."""

import importlib

from mc_engine.documentation.markdown_text import code, escaped, table
from mc_engine.units import UNITS, by_quantity

_UNITS = """# Units

A model may declare these units, and a campaign file may give one as the `unit` of a dispersion in place of the
parameter's own. Physics is in SI and radians. The name of a column ends in its unit (`_days` for day, `_pct` for %);
the name inside physics does not.
`mc-engine units` prints the list.
"""
_TERMS = "# Words of a report\n\nThe glossary in the last section of every report.\n"


def units_page() -> str:
    """A table of all units by what they measure, with their SI values and the ends of names."""
    rows = [
        (quantity, code(name), code(UNITS[name].suffix), f"{UNITS[name].factor:.10g}")
        for quantity, names in by_quantity().items()
        for name in names
    ]
    return "\n\n".join([_UNITS, table(("Quantity", "Unit", "Ends of names", "In SI"), rows)]) + "\n"


def terms_page() -> str:
    """A definition for each term."""
    glossary = importlib.import_module("reports.document.glossary").GLOSSARY  # the engine itself imports no reports
    return (
        "\n\n".join([_TERMS, *(f"{escaped(term)}\n: {escaped(meaning)}" for term, meaning in glossary.entries)]) + "\n"
    )
