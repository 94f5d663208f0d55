"""What a message says to install is what the extra brings."""

import re
import tomllib
from pathlib import Path

import mc_engine
from mc_engine.extras import EXTRAS, how_to_install

PROJECT = Path(mc_engine.__file__).parents[1] / "pyproject.toml"


def test_the_extras_are_those_of_the_project():
    declared = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    names = {extra: tuple(re.match(r"[\w-]+", one)[0] for one in declared[extra]) for extra in EXTRAS}
    assert names == EXTRAS
    assert how_to_install("cloud") == '`pip install fsspec s3fs` (the extra "cloud")'


def test_nothing_tells_a_user_to_install_the_engine_from_an_index():
    root = PROJECT.parent
    texts = [path for folder in ("mc_engine", "campaigns", "reports") for path in (root / folder).rglob("*")]
    texts = [path for path in (*texts, root / "README.md") if path.suffix in (".py", ".md", ".yml", ".sh")]
    pattern = re.compile(r"""pip install ['"]?mc-engine""")
    assert [path.name for path in texts if pattern.search(path.read_text(encoding="utf-8"))] == []
