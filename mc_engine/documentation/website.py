"""The pages of the site: gathered in a folder of their own, then built by Sphinx with every warning an error."""

import importlib
import shutil
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from mc_engine.campaign.search import SHIPPED
from mc_engine.documentation import campaign_pages, commands_page, function_pages, glossary_pages, schema_page
from mc_engine.errors import EngineError
from mc_engine.extras import how_to_install

HOME = Path(__file__).resolve().parent
_PICTURE = SHIPPED / "deorbit" / "fuel_map.png"
# Sections of reference/index.md, which is all there is of the reference without a site, and their pages on the site.
_SECTIONS = {
    "Keys of a campaign file": "campaign_file.md",
    "The command line": "command_line.md",
    "Columns of a run": "columns.md",
    "Units": "units.md",
    "Words of a report": "words.md",
    "Functions and classes": "functions.md",
}


def build(folder: Path) -> bool:
    """Write the site to `folder`; whether all pages are in order.  Sphinx says on stderr what is not.

    Raises EngineError without the extra "docs".
    """
    try:
        sphinx = importlib.import_module("sphinx.cmd.build")
        importlib.import_module("myst_parser")
        importlib.import_module("furo")
    except ModuleNotFoundError as error:
        raise EngineError(f"the site needs {error.name}; {how_to_install('docs')}") from None
    with TemporaryDirectory() as scratch:
        pages = Path(scratch) / "pages"
        write_pages(pages)
        # Without a doctree folder of its own, Sphinx leaves one among the pages.
        options = ["-q", "-W", "--keep-going", "-n", "-b", "html", "-d", str(Path(scratch) / "doctrees")]
        return bool(sphinx.build_main([*options, str(pages), str(folder)]) == 0)


def write_pages(folder: Path) -> None:
    """All sources of the site: what lies next to this file, and the reference from the program as it is."""
    for path in handwritten():
        target = folder / path.relative_to(HOME)
        target.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".md":
            target.write_text(_on_the_site(path.read_text(encoding="utf-8")), encoding="utf-8")
        else:
            shutil.copyfile(path, target)
    shutil.copyfile(_PICTURE, folder / _PICTURE.name)
    for name, text in reference_pages():
        target = folder / "reference" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")


def _on_the_site(text: str) -> str:
    """The text of a page with its links as the site has them: to the pages that are made, to the picture beside it."""
    text = text.replace(f"../../campaigns/{_PICTURE.relative_to(SHIPPED).as_posix()}", _PICTURE.name)
    for title, page in _SECTIONS.items():
        text = text.replace(f"reference/index.md#{title.lower().replace(' ', '-')}", f"reference/{page}")
        text = text.replace(f"\n## {title}\n", f"\n## [{title}]({page})\n") if text.startswith("# Reference") else text
    return text


def handwritten() -> list[Path]:
    """conf.py and the Markdown pages with the files that they show."""
    shown = (".md", ".css", ".toml", ".yml", ".yaml", ".sh", ".sbatch", ".slurm", ".png", ".svg", ".py")
    files = [path for path in sorted(HOME.rglob("*")) if path.suffix in shown and path.parent != HOME]
    return [HOME / "conf.py", *sorted(HOME.glob("*.md")), *(path for path in files if "__pycache__" not in path.parts)]


def reference_pages() -> Iterator[tuple[str, str]]:
    """(name, Markdown) of each page that comes from schema, program, models and docstrings."""
    yield "campaign_file.md", schema_page.page()
    yield "command_line.md", commands_page.page()
    yield "units.md", glossary_pages.units_page()
    yield "words.md", glossary_pages.terms_page()
    yield from campaign_pages.pages()
    yield from function_pages.pages()
