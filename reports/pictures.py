"""The figures of a document as SVG, each drawn once for all the formats that want it."""

from reports.document import FigureBlock
from reports.figures import paper


class Pictures:
    """SVG texts by the number of their figure."""

    def __init__(self) -> None:
        self._svg: dict[int, str] = {}

    def svg(self, block: FigureBlock) -> str:
        """The figure as printed, without a background."""
        if block.number not in self._svg:
            self._svg[block.number] = paper.svg(block.drawing.printed)
        return self._svg[block.number]
