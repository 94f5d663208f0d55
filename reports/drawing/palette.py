"""Colours that survive colour blindness and grey print: Okabe & Ito's eight, and cividis for fields.

Okabe & Ito, Color Universal Design (2008).  Nunez, Anderton & Renslow, PLoS ONE 13 (2018) e0199239 (cividis).
Colours with an @ are the page's own and follow its light or dark mode.
"""

ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7"
INK, MUTED, GRID, PAPER = "@ink", "@muted", "@grid", "@paper"

# What the page colours are on paper.
ON_PAPER = {INK: "#1b1f23", MUTED: "#6c757d", GRID: "#dfe3e6", PAPER: "#ffffff"}

LINES = (ORANGE, PURPLE, GREEN, SKY, BLUE, VERMILION)  # of cases; the last ones also stand for medians and limits
DASHES = ("solid", "dash", "dot")
CIVIDIS = ("#00224e", "#003170", "#2a3f6d", "#434e6c", "#575d6d", "#6a6c71", "#7d7c78", "#918b78", "#a59c74",
           "#bcae6c", "#d2c060", "#e9d34e", "#fee838")  # fmt: skip


def on_paper(svg: str) -> str:
    """The page colours in the attributes of an SVG as printed; no text has a quotation mark of its own."""
    for colour, printed in ON_PAPER.items():
        svg = svg.replace(f'"{colour}"', f'"{printed}"')
    return svg


def on_screen(svg: str) -> str:
    """The same as variables of a page's style sheet."""
    for colour in ON_PAPER:
        svg = svg.replace(f'"{colour}"', f'"var(--{colour[1:]})"')
    return svg


def field_colour(part: float) -> str:
    """The field's colour from 0, dark, to 1, bright."""
    place = min(max(part, 0.0), 1.0) * (len(CIVIDIS) - 1)
    low = min(int(place), len(CIVIDIS) - 2)
    ends = [[int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in CIVIDIS[low : low + 2]]
    return "#" + "".join(f"{round(a + (place - low) * (b - a)):02x}" for a, b in zip(*ends, strict=True))


def blended(colour: str, part: float) -> str:
    """From nearly white at 0 to the colour at 1."""
    ends = [(247, int(colour[k : k + 2], 16)) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(a + min(part, 1.0) * (b - a)):02x}" for a, b in ends)
