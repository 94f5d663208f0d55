"""What figures are made of, as tests look for it: drawings by their kind, marks by their class and words."""

import re

from reports.document.blocks import FigureBlock, blocks_of

FORMS = {
    "map": "Filled contour map",
    "scatter": "Scatter of cases",
    "corridor": "Cases by the limits that they violate",
    "footprint": "Impact points about the mean impact point",
    "histories": "Curves against time, the nominal case among them",
    "profile": "Curves along flights, the nominal case among them",
    "margins": "Margins relative to the limits",
    "front": "Candidates and the front of the objectives",
}


def drawings(document, kind):
    """All drawings of a kind in a document."""
    return [block.drawing for block in blocks_of(document, FigureBlock) if block.drawing.form == FORMS[kind]]


def marks_of(drawing, kind, words=""):
    """Marks of a class in all panels, those whose name or key begins with these words."""
    marks = [mark for plot in drawing.plots for mark in plot.marks if isinstance(mark, kind)]
    return [mark for mark in marks if mark.key.startswith(words) or getattr(mark, "name", "").startswith(words)]


def classes(drawing):
    """Words and number of cases of each class of a scatter plot, from its key."""
    found = [re.match(r"(.*): ([\d\u202f]+) of [\d\u202f]+ cases", mark.key) for mark in drawing.key]
    return {one[1]: int(one[2].replace("\u202f", "")) for one in found if one}
