"""The glossary page, from the glossary of the report."""

import importlib

from mc_engine.documentation.markdown_text import escaped

_HEAD = "# Words of a report\n\nThe same as in the last section of every report.\n"


def page() -> str:
    """A definition per word."""
    glossary = importlib.import_module("reports.glossary").GLOSSARY  # the engine itself imports no reports
    return (
        "\n\n".join([_HEAD, *(f"{escaped(word)}\n: {escaped(meaning)}" for word, meaning in glossary.entries)]) + "\n"
    )
