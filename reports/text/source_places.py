"""References to a published source, distinguished from the tables, figures and sections of the report itself."""

import re

# "Table 5", "thrusters of Table 8"; behind a comma, as in "Vallado, Table 8-4", a table has its source before it.
_BARE = re.compile(
    r"(?:^|\b(?:and|by|from|in|of|on|to|with) )(?:Tables?|Fig(?:ure)?s?\.?|[Ss]ections?) \d++(?:[.-]\d++)*+"
    r"(?: and \d++)?+(?! of\b)"
)


def of_source(text: str) -> str:
    """The text with "of the source" behind the tables, figures and sections that it names without saying of what."""
    return _BARE.sub(r"\g<0> of the source", text)
