"""Colours that survive colour blindness and grey print: Okabe & Ito's eight, and cividis for fields.

Okabe & Ito, Color Universal Design (2008).  Nunez, Anderton & Renslow, PLoS ONE 13 (2018) e0199239 (cividis).
Colours with an @ are the page's own and follow its light or dark mode.
"""

ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7"
INK, MUTED, GRID, PAPER = "@ink", "@muted", "@grid", "@paper"

# What the page colours are on paper.
ON_PAPER = {INK: "#1b1b1b", MUTED: "#7a7a7a", GRID: "#dddddd", PAPER: "#ffffff"}

LINES = (VERMILION, BLUE, GREEN, ORANGE, PURPLE, SKY)
DASHES = ("solid", "dash", "dot")
FIELD = "cividis"


def on_paper(colour: str) -> str:
    """The colour as printed."""
    return ON_PAPER.get(colour, colour)


def field_scale(steps: int = 16) -> list[list[object]]:
    """The field's colour scale as plotly wants it."""
    from matplotlib import colormaps

    ramp = colormaps[FIELD].resampled(steps)
    return [[index / (steps - 1), "rgb({:.0f},{:.0f},{:.0f})".format(*(255 * c for c in ramp(index)[:3]))]
            for index in range(steps)]  # fmt: skip
