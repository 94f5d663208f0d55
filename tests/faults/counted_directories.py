"""Small directories of every kind that `verify` knows, with reports and replays in them, and ways to damage them."""

import shutil

import numpy as np
from stones import call
from trapped import trapped

from mc_engine.runner import runner
from mc_engine.store.derived_files import derived_files
from mc_engine.store.object_store import publish
from mc_engine.store.opening import open_store
from mc_engine.store.parts import Column
from mc_engine.store.result_folder import result_files, write_result
from mc_engine.store.run_files import RARE_EVENT, TUNING
from mc_engine.studies.replay_files import write_replay

PAGES = {"report.html": b"<!doctype html>" + 50 * b"a page ", "report.pdf": b"%PDF" + 50 * b" a page"}
TEXTS = {"report.md": b"# A report\n", "report-figures/figure-1.svg": b"<svg>1</svg>"}
HEAD = {
    "created_utc": "2026-04-21T10:15:00Z",
    "campaign": {"name": "c", "title": "C", "model": "m", "digest": "d", "seed": 1, "cases": 4},
    "model": {"name": "m", "title": "M", "source": "nobody", "digest": "e"},
    "provenance": {"packages": {"numpy": "2"}, "git": {"commit": "abc", "dirty": False}},
}


def reported(folder):
    """The directory with a page, a paper and a text with a figure; what they say is of no matter here."""
    derived_files(folder).write(PAGES)
    derived_files(folder).write(TEXTS)
    return folder


def a_run(folder):
    """A run of sixty cases with a table of its own beside the campaign, two replays and reports."""
    store = runner.run(trapped(folder / "campaign", 60), folder / "run", workers=2, chunk=20)
    for case in (3, 17):
        write_replay(store, case, runner.replay(store.path, case).history, b"a picture")
    return reported(store.path)


def a_published_run(folder):
    """A copy of such a run, as an object store holds it."""
    publish(a_run(folder), f"file://{folder}/away")
    return folder / "away"


def a_tuning(folder):
    """A search of four candidates, replaced twice, as after each generation."""
    for flown in (1, 2):
        write_result(folder / "tuning", TUNING, "[campaign]\n", _searched(flown), _candidates())
    return reported(folder / "tuning")


def _searched(flown):
    measure = {"metric": "cost_kg", "quantile": None}
    limit = {"name": "limited", "at_most": 0.5, "at_least": None, "source": "", **measure}
    return {**HEAD, "tuning": {
        "seed": 1, "population": 4, "generations": 2, "flown": flown, "patience": None, "end": "not ended", "cases": 1,
        "crossover": 0.9, "mutation": 0.5,
        "parameters": [{"name": "gain", "lower": 0.0, "upper": 1.0, "nominal": 0.3, "source": "Table 2"}],
        "objectives": [{"name": name, "goal": "minimise", **measure} for name in ("cost", "error")],
        "constraints": [limit],
        "published": [{"name": "Table 8", "values": {"cost": 0.5, "error": 0.5}, "source": "the paper"}],
    }}  # fmt: skip


def _candidates():
    numbers = {name: np.linspace(0.1, 0.4, 4) for name in ("gain", "cost", "error", "limited", "violation")}
    arrays = {
        "candidate": np.arange(4), "generation": np.arange(4) // 2, **numbers, "error": np.linspace(0.4, 0.1, 4),
        "feasible": np.array([True, True, False, True]), "failed_cases": np.arange(4) % 2,
        "commonest_failure": np.array(["", "refused", "", "refused"]),
    }  # fmt: skip
    kinds = {"candidate": "integer", "generation": "integer", "feasible": "switch", "failed_cases": "integer",
             "commonest_failure": "word"}  # fmt: skip
    columns = [Column(name, "", "candidate", name, kinds.get(name, "number")) for name in arrays]
    names = ("generation", "evaluations", "feasible_so_far", "front_size", "least_violation", "dominated_share")
    progress = {name: np.array([0.0, 1.0]) for name in names}
    return {
        "evaluations": (columns, arrays),
        "generations": ([Column(name, "", "generation", name) for name in progress], progress),
        "front": (columns, {name: values[:2] for name, values in arrays.items()}),
    }


def a_rare_event(folder):
    """An estimate of ten cases."""
    level = {"margin": 0.5, "probability": 0.1, "runs": 1, "cases": 10, "accepted": 0.5}
    sigmas = {"mean_sigma": 1.0, "spread_sigma": 0.5, "likeliest_sigma": 2.0, "likeliest": 3.0}
    estimate = {
        "asked": {"method": "subset", "cases_per_level": 10},
        "requirement": {"name": "fuel", "metric": "cost_kg", "share": 0.99, "at_most": 2.5, "at_least": None,
                        "confidence": 0.9, "source": ""},
        "metric": {"name": "cost_kg", "unit": "kg", "description": "cost"},
        "method": "subset", "probability": 1e-3, "lower": 5e-4, "upper": 2e-3, "confidence": 0.95,
        "relative_error": 0.2, "plain_cases": 1e5, "cases": 10, "failed": 3, "no_number": 0,
        "levels": [{**level, "margin": None}, level],
        "inputs": [{"name": "x_m", "unit": "m", "description": "x", **sigmas}], "remarks": ["a remark"],
    }  # fmt: skip
    inputs = [{"name": "x_m", "unit": "m", "description": "x", "distribution": "normal", "bounds": "", "source": ""}]
    columns = [Column("case_id", "", "case", "number", "integer"), Column("weight", "", "case", "what it counts for")]
    tables = {"cases": (columns, {"case_id": np.arange(10), "weight": np.full(10, 0.1)})}
    write_result(
        folder / "rare", RARE_EVENT, "[campaign]\n", {**HEAD, "inputs": inputs, "rare_event": estimate}, tables
    )
    return reported(folder / "rare")


KINDS = {"run": a_run, "tuning": a_tuning, "rare event": a_rare_event, "published run": a_published_run}


def files_of(folder):
    """Every file with a byte in it, by name."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path.stat().st_size)
    return {path.relative_to(folder).as_posix(): path for path in paths}


def verified(kind, folder):
    """What `verify` says of the directory, or of the copy on an object store."""
    return call("verify", f"file://{folder}" if kind == "published run" else folder)


def vouched(folder, kind, name, content):
    """Put another file into a tuning or a rare event, for which the journal vouches, as a forger can."""
    result_files(folder, kind).write({name: content})


def copied(folder, place):
    return shutil.copytree(folder, place, symlinks=True)


def opened(folder):
    """The run, for its writers."""
    return open_store(folder)
