"""The layout of two small reports as text, which `test_golden_layout` compares with the files in `golden/`.

After a change of layout that is meant, write the files anew, and look at what changed in them:

    python tests/reports/golden_layout.py
"""

import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import mc_engine
from reports.contents import build
from reports.document.blocks import Document, FigureBlock, Table, Terms, Text

GOLDEN = Path(__file__).with_name("golden")
CAMPAIGNS = Path(__file__).parents[2] / "campaigns"
# By campaign: lines of its file that make it small; contributors of `minimal` are estimated from its table of cases.
SMALLER = {
    "minimal": {
        "cases = 2000": "cases = 300",
        'model = "model.py"': 'model = "campaigns.minimal.model"',
        "[sensitivity]                          # contributions of the inputs, from flights of their own\n"
        "cases = 512\n": "",
    },
    "deorbit": {"cases = 10_000": "cases = 400", "cases = 2048": "cases = 64"},
}


def report_of(name: str, folder: Path) -> Document:
    """The report of the small campaign, flown in the folder."""
    text = (CAMPAIGNS / name / "campaign.toml").read_text(encoding="utf-8")
    for line, smaller in SMALLER[name].items():
        assert line in text
        text = text.replace(line, smaller)
    file = folder / f"{name}.toml"
    file.write_text(text, encoding="utf-8")
    return build(mc_engine.run(mc_engine.load_campaign(file), folder / name), name)


def outline(document: Document) -> str:
    """Titles, anchors, captions, heads of columns and kinds of figures, a line each; # for the digits of numbers."""
    return "".join(f"{re.sub(r'[0-9]+', '#', line)}\n" for line in _lines(document))


def _lines(document: Document) -> Iterator[str]:
    yield f"{document.kind}: {document.title}"
    yield f"headline: {', '.join(card.label for card in (*document.verdicts, *document.costs))}"
    for section in document.sections:
        yield f"{section.kind} {section.anchor}: {section.title}"
        for block in section.blocks:
            if isinstance(block, Table):
                yield f"  table: {block.caption} | {' | '.join(column.title for column in block.columns)}"
            elif isinstance(block, FigureBlock):
                yield f"  figure, {block.drawing.form}, {len(block.drawing.plots)} panels: {block.caption}"
            elif isinstance(block, Text):
                yield f"  text, {block.kind}: {' '.join(block.paragraphs)[:60]}"
            else:
                assert isinstance(block, Terms)
                yield f"  terms: {', '.join(term for term, _ in block.entries)}"


def main() -> None:
    """Write all files anew."""
    for name in SMALLER:
        with tempfile.TemporaryDirectory() as folder:
            text = outline(report_of(name, Path(folder)))
        (GOLDEN / f"{name}.txt").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
