"""Colours that survive colour blindness and grey print: Okabe & Ito's eight, and cividis for fields.

Okabe & Ito, Color Universal Design (2008).  Nunez, Anderton & Renslow, PLoS ONE 13 (2018) e0199239 (cividis).
Colours with an @ are the page's own and follow its light or dark mode; so does the blue, which is lighter in the dark.
"""

import numpy as np

ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7"
INK, MUTED, GRID, PAPER = "@ink", "@muted", "@grid", "@paper"

# What the page colours are on paper, and in a page's style sheet.
ON_PAPER = {INK: "#1b1f23", MUTED: "#6c757d", GRID: "#dfe3e6", PAPER: "#ffffff"}
ON_SCREEN = {colour: f"var(--{colour[1:]})" for colour in ON_PAPER} | {BLUE: "var(--blue)"}

LINES = (ORANGE, PURPLE, GREEN, SKY, BLUE, VERMILION)  # of cases; the last ones also stand for medians and limits
DASHES = ("solid", "dash", "dot")
CIVIDIS = ("#00224e", "#003170", "#2a3f6d", "#434e6c", "#575d6d", "#6a6c71", "#7d7c78", "#918b78", "#a59c74",
           "#bcae6c", "#d2c060", "#e9d34e", "#fee838")  # fmt: skip


def coloured(svg: str, page: dict[str, str]) -> str:
    """The page colours in the attributes of an SVG as those of this page; no text has a quotation mark of its own."""
    for colour, own in page.items():
        svg = svg.replace(f'"{colour}"', f'"{own}"')
    return svg


def blended(part: float, *colours: str) -> str:
    """The colour at a part, 0 to 1, of the way through these colours, which lie at equal distances."""
    channels = np.array([[int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in colours])
    place = part * (len(colours) - 1)
    return "#" + "".join(f"{round(float(np.interp(place, range(len(colours)), row))):02x}" for row in channels.T)
