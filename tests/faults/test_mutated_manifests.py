"""Manifests that no engine wrote, with digests that hold: a sentence or a harmless answer, nothing opened outside."""

import json
import os
import shutil
import sys
from collections import Counter

import numpy as np
import pytest
from mutated_records import assert_answered, call, dumped, mutated, put_manifest
from stones import flown_stones

from mc_engine import load_campaign
from mc_engine.runner import runner

READERS = ("status", "verify", "summary", "compare", "report", "replay", "resume", "export")
OPTIONS = {"replay": ("3",), "resume": ("--no-report",), "report": ("--format", "md")}
SECTION = '[requirement.speed]\nmetric = "impact_speed_m_s"\nat_most = 100.0\n'

opened: list[str] = []
watching = [False]
sys.addaudithook(lambda event, facts: opened.append(os.fsdecode(facts[0])) if watching[0] and event == "open"
                 and isinstance(facts[0], str | bytes) else None)  # fmt: skip


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stones")
    flown_stones(folder, 60, 20)
    campaign = folder / "campaign" / "campaign.toml"
    campaign.write_text(campaign.read_text() + SECTION)
    return runner.run(load_campaign(campaign), folder / "required", workers=2, chunk=20).path


@pytest.fixture
def run(flown, tmp_path):
    return shutil.copytree(flown, tmp_path / "run")


def asked(verb, run, flown):
    """What the command line says of the run, and that it opened nothing that the manifest names outside of it."""
    more = OPTIONS.get(verb, (flown,) if verb == "compare" else ("--out", run.parent / "out.csv"))
    arguments = (verb, run, *(more if verb in (*OPTIONS, "compare", "export") else ()))
    opened.clear()
    watching[0] = True
    done = call(*arguments)
    watching[0] = False
    assert not [name for name in opened if "hostname" in name or "passwd" in name]
    assert_answered(done, 0, 1, 5) if verb == "compare" else assert_answered(done, 0, 5)
    return done


@pytest.mark.filterwarnings("ignore:Glyph:UserWarning")  # a letter that no font has, in a label of a figure
@pytest.mark.parametrize("count", [120, pytest.param(3000, marks=pytest.mark.slow)])
def test_mutated_manifests_are_answered_with_a_sentence(run, flown, count, record_property):
    rng = np.random.default_rng(count)
    record, journal = json.loads((flown / "manifest.json").read_bytes()), (flown / "journal.jsonl").read_bytes()
    counts = Counter()
    for k in range(count):
        content = None
        while content is None:
            content = dumped(mutated(record, rng))
        (run / "journal.jsonl").write_bytes(journal)
        put_manifest(run, content)
        counts[asked(READERS[k % len(READERS)], run, flown).exit_code] += 1
    record_property("exit statuses", " ".join(f"{status}: {n}" for status, n in sorted(counts.items())))


DIRTY = {
    "git of another type": lambda m: m["provenance"].update(git="clean"),
    "git as a list": lambda m: m["provenance"].update(git=[1]),
    "packages as a list": lambda m: m["provenance"].update(packages=["numpy"]),
    "half a letter": lambda m: m["columns"][-1].update(description="\ud800"),
    "half a letter in a name that is no member": lambda m: m.update({"\ud800": 1}),
    "a figure without its columns": lambda m: m["figures"].append({"kind": "map", "x": "height_m"}),
    "a figure of numbers": lambda m: m["figures"].append({"kind": "scatter", "x": 1, "y": 2, "title": 3}),
    "published as numbers": lambda m: m["published"].append(7),
    "a statistic without a number": lambda m: m["published"].append(
        {"quantity": "q", "published": "x", "statistic": "mean", "of": "height_m", "over": []}
    ),
    "upstream as words": lambda m: m.update(upstream="elsewhere"),
    "imported as a word": lambda m: m.update(imported="results.parquet"),
    "imported from no file": lambda m: m.update(imported={"history": None}),
    "flights for contributions as a number": lambda m: m.update(sensitivity=5),
    "correlations as words": lambda m: m.update(correlations=["height_m, speed_m_s"]),
    "a range of one number": lambda m: m.update(ranges={"height_m": [1.0]}),
    "a range of words": lambda m: m.update(ranges={"height_m": ["low", "high"]}),
    "a number that is none": lambda m: m["parameters"].append({"name": "p", "value": float("nan")}),
    "a requirement on no column": lambda m: m["requirements"][0].update(metric="9" * 400),
    "an impossible confidence": lambda m: m["requirements"][0].update(confidence=1e-17),
}


@pytest.mark.parametrize("case", DIRTY)
def test_every_member_of_a_manifest_has_its_type(run, flown, case):
    record = json.loads((flown / "manifest.json").read_bytes())
    DIRTY[case](record)
    put_manifest(run, json.dumps(record).encode())
    for verb in READERS:
        done = asked(verb, run, flown)
        assert done.exit_code == 5, (verb, done.output)
        assert "manifest.json: " in done.output
