"""What the pages tell the reader to type works: commands, campaign files, code."""

import contextlib
import io
import re
import shlex

import pytest
from handwritten_pages import PAGES, blocks, commands, name_of

import mc_engine
from mc_engine.documentation.verbs_page import commands as verbs
from mc_engine.documentation.website import HOME

RECIPES = [
    HOME / "how_to" / f"{name}.md" for name in ("tables", "notebook", "correlated_covariances", "own_distributions")
]
HEAD = '[campaign]\nmodel = "{model}"\ncases = 1000\ndesign = "mc"\nseed = 1\n\n'


def parametrize(pages):
    return pytest.mark.parametrize("page", pages, ids=name_of)


def unknown_words(command):
    """The verb or options of a command that the program does not have."""
    words = [word for word in shlex.split(command.replace("…", "")) if word not in ("|", ">")]
    if words[0] in ("VERB", "--help"):
        return []
    if words[0] not in verbs():
        return [words[0]]
    known = {name for one in verbs()[words[0]].params for name in (*one.opts, *one.secondary_opts)} | {"--help", "-h"}
    return [word for word in words[1:] if word.startswith("-") and word.split("=")[0] not in known]


@parametrize([page for page in PAGES if commands(page)])
def test_every_command_on_a_page_has_a_verb_and_options_that_exist(page):
    assert [(command, wrong) for command in commands(page) if (wrong := unknown_words(command))] == []


def test_a_wrong_verb_or_option_is_found():
    assert unknown_words("fly deorbit") == ["fly"]
    assert unknown_words("run deorbit --case 5 --out x") == ["--case"]


def run_blocks(page):
    """Run a page's Python from top to bottom, as a reader would; what it prints."""
    printed, names = io.StringIO(), {}
    with contextlib.redirect_stdout(printed):
        for text, _ in blocks(page, "python"):
            exec(compile(text, name_of(page), "exec"), names)  # the page is the project's own
    return printed.getvalue()


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recipes")
    mc_engine.run(mc_engine.load_campaign("minimal", cases=200), folder / "runs" / "my_campaign")
    return folder


@parametrize(RECIPES)
def test_recipes_run_from_top_to_bottom_and_their_campaigns_load(page, flown, monkeypatch):
    monkeypatch.chdir(flown)
    printed = run_blocks(page)
    assert printed or page.stem in ("own_distributions", "notebook")
    if page.stem == "correlated_covariances":
        assert printed.strip() == blocks(page, "toml")[-1][0].strip()
    check_campaigns(page, flown)


@parametrize(
    [page for page in PAGES if page not in RECIPES and page.parent.name != "tutorial" and blocks(page, "toml")]
)
def test_every_campaign_file_on_a_page_loads(page, tmp_path):
    check_campaigns(page, tmp_path)


def check_campaigns(page, folder):
    """Load each campaign of a page, and each excerpt behind the head of a file for the model that its mark names."""
    for text, mark in blocks(page, "toml"):
        model = re.fullmatch(r"excerpt of ([\w.]+)", mark)
        assert model or "[campaign]" in text, f"say whose excerpt this is:\n{text}"
        campaign = mc_engine.load_campaign(
            page.stem, text=HEAD.format(model=model[1]) + text if model else text, directory=folder
        )
        assert campaign.cases > 0


@parametrize([page for page in PAGES if blocks(page, "python")])
def test_every_python_block_compiles(page):
    for text, _ in blocks(page, "python"):
        compile(text, name_of(page), "exec")
