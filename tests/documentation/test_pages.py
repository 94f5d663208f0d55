"""What the pages tell the reader to type works: commands, campaign files, code."""

import contextlib
import io
import re
import shlex

import numpy as np
import pytest
from handwritten_pages import PAGES, blocks, commands, name_of

import mc_engine
from mc_engine.campaign.search import SHIPPED
from mc_engine.documentation.commands_page import commands as verbs
from mc_engine.documentation.website import HOME
from mc_engine.flight.chunks import fly_cases
from mc_engine.flight.contract import breaches
from mc_engine.flight.contract_flight import faults
from mc_engine.status import STATUS_NAME
from mc_engine.store.run_files import NOMINAL_CASE
from mc_engine.studies.published import read_published

RECIPES = [
    HOME / "how_to" / f"{name}.md"
    for name in (
        "tables",
        "notebook",
        "correlated_covariances",
        "own_distributions",
        "prepare_and_end_cases",
        "curves_rotations_frames_air",
    )
]
PHASES = HOME / "how_to" / "phases.md"
PUBLISHED = HOME / "how_to" / "published_results.md"
HEAD = '[campaign]\nmodel = "{model}"\ncases = 1000\ndesign = "mc"\nseed = 1\n\n'


def parametrize(pages):
    return pytest.mark.parametrize("page", pages, ids=name_of)


WIDEST = 88  # columns of code that fit beside the site's menu; commands wrap


def broken_links(page):
    """Links and pictures of a page as it lies among the sources that lead to no file, or to no heading of a page."""
    text = page.read_text(encoding="utf-8")
    for shown, link in re.findall(r"\[([^\]]*)\]\(([^)\s]+)\)", _without_code(text)):
        path, _, place = link.partition("#")
        if re.match(r"[a-z]+:", link):
            continue
        target = (page.parent / path).resolve() if path else page
        if not shown or not target.is_file() or (place and place not in headings(target)):
            yield link


def headings(page):
    """The places in a page that a forge gives to its headings."""
    titles = re.findall(r"^#+ (.*)$", _without_code(page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


def _without_code(text):
    return re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)


@parametrize(PAGES)
def test_links_and_pictures_lead_somewhere_where_pages_are_read_as_they_lie(page):
    assert list(broken_links(page)) == []


def test_a_link_without_words_to_no_file_or_to_no_heading_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "# One more\n[](page.md) [a](none.md) ![b](none.png) [c](page.md#two) [d](#one-more) [e](https://x.org)"
    )
    assert list(broken_links(page)) == ["page.md", "none.md", "none.png", "page.md#two"]


@parametrize([page for page in PAGES if page.name != "README.md"])
def test_code_is_no_wider_than_its_column(page):
    code = [text for kind in ("python", "toml", "jinja") for text, _ in blocks(page, kind)]
    assert [line for text in code for line in text.splitlines() if len(line) > WIDEST] == []


def test_the_overviews_name_every_page():
    for folder in ("how_to", "explanation"):
        overview = (HOME / folder / "index.md").read_text(encoding="utf-8")
        pages = sorted(path.name for path in (HOME / folder).glob("*.md") if path.name != "index.md")
        assert sorted(re.findall(r"\]\((\w+\.md)\)", overview)) == pages
        assert sorted(f"{name}.md" for name in overview.split(":hidden:")[1].split("```")[0].split()) == pages


def unknown_words(command):
    """The verb or options of a command that the program does not have."""
    words = [word for word in shlex.split(command.replace("…", "")) if word not in ("|", ">")]
    if words[0] in ("COMMAND", "--help"):
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


def test_the_page_on_how_cases_end_knows_every_status():
    text = (HOME / "how_to" / "prepare_and_end_cases.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w-]+)` \| .* \| (yes|no) \|$", text, re.MULTILINE)
    assert dict(rows) == {name: "no" if name == "ok" else "yes" for name in STATUS_NAME.values()}


def test_the_prepared_campaign_keeps_the_contract_and_reaches_its_target(tmp_path):
    """The page's function and inputs in the smallest model."""
    (function, declared, *_) = (text for text, _ in blocks(HOME / "how_to" / "prepare_and_end_cases.md", "python"))
    text = (SHIPPED / "minimal" / "model.py").read_text()
    own = text[text.index("Inputs = inputs(") : text.index("State = states(")]
    for old, new in (
        (own, f"{declared}\n"),
        ("@physics\ndef initial", f"{function}\n\n@physics\ndef initial"),
        ("initial=initial,", "initial=initial, prepare=prepare, kernel_parameters=prepared(prepare, Inputs),"),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "model.py").write_text(text)
    (tmp_path / "campaign.toml").write_text((SHIPPED / "minimal" / "campaign.toml").read_text())
    campaign = mc_engine.load_campaign(tmp_path / "campaign.toml")
    assert breaches(campaign) == []
    hundred_metres = 0.1
    assert fly_cases(campaign, np.array([NOMINAL_CASE]))["apogee_altitude_km"] == pytest.approx(
        650.0, abs=hundred_metres
    )


@parametrize(
    [
        page
        for page in PAGES
        if page not in (*RECIPES, PUBLISHED, PHASES) and page.parent.name != "tutorial" and blocks(page, "toml")
    ]
)
def test_every_campaign_file_on_a_page_loads(page, tmp_path):
    check_campaigns(page, tmp_path)


def test_the_records_of_the_page_on_published_results_are_read_and_show_each_way_to_compute(tmp_path):
    path = tmp_path / "published.toml"
    ((text, _),) = blocks(PUBLISHED, "toml")
    path.write_text(text, encoding="utf-8")
    records = read_published(path)
    assert [next(way for way in ("column", "statistic", "compute") if way in record) for record in records] == [
        "column", "statistic", "compute",
    ]  # fmt: skip


def test_the_rocket_of_the_page_on_phases_keeps_the_contract_and_gives_what_is_printed(tmp_path, monkeypatch):
    (rocket, _), (results, _) = blocks(PHASES, "python")
    (tmp_path / "rocket.py").write_text(rocket)
    (tmp_path / "campaign.toml").write_text(blocks(PHASES, "toml")[0][0])
    monkeypatch.chdir(tmp_path)
    campaign = mc_engine.load_campaign("campaign.toml")
    assert breaches(campaign) == []
    assert faults(campaign) == []
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(results, PHASES.name, "exec"), {})  # the page is the project's own
    assert printed.getvalue() == blocks(PHASES, "text")[0][0]


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
