"""A tuning made up for tests of the reports: objectives x and (1 - x) + y of a choice (x, y), both to be small."""

import numpy as np

from mc_engine.store.parts import Column
from mc_engine.store.result_folder import write_result
from mc_engine.store.run_files import TUNING
from mc_engine.studies.genetic_search import non_dominated
from mc_engine.studies.tuning_folder import UNFINISHED, open_tuning


def synthetic_tuning(path, limit=0.5, n=300, failed=0, third=False, end="all generations"):
    """The record of a search whose constraint allows y up to `limit`; below 0 nothing is feasible.

    failed : of each generation's 10 candidates, those with failed cases; if all have some, none has a number.
    """
    x, y = np.random.Generator(np.random.Philox(key=4)).random((2, n))
    columns = [
        Column("candidate", "", "candidate", "number", "integer"),
        Column("generation", "", "candidate", "generation", "integer"),
        Column("gain", "", "tuned", "x"),
        Column("delay_s", "s", "tuned", "y"),
        Column("cost", "N m s", "objective", "impulse; the nominal case"),
        Column("error", "s", "objective", "1 - x + y; the nominal case"),
        *([Column("spread", "", "objective", "x y")] if third else []),
        Column("limited", "s", "constraint", "y; the nominal case"),
        Column("violation", "", "candidate", "excess"),
        Column("feasible", "", "candidate", "inside", "switch"),
        Column("failed_cases", "", "candidate", "failed", "integer"),
        Column("commonest_failure", "", "candidate", "why", "word"),
    ]
    excess = np.full(n, np.inf) if failed == 10 else np.maximum(0.0, (y - limit) / (abs(limit) or 1.0))
    arrays = {
        "candidate": np.arange(n), "generation": np.arange(n) // 10, "gain": x, "delay_s": y, "cost": x,
        "error": 1.0 - x + y, "limited": y, "violation": excess, "feasible": excess == 0.0,
        "failed_cases": np.arange(n) % 10 < failed,
        "commonest_failure": np.where(np.arange(n) % 10 < failed, "refused: too far", ""),
    }  # fmt: skip
    arrays |= {"spread": x * y} if third else {}
    objectives = ["cost", "error", *(["spread"] if third else [])]
    values = np.column_stack([np.where(excess == 0.0, arrays[name], np.nan) for name in objectives])
    front = np.flatnonzero(non_dominated(values))
    front = front[np.argsort(x[front])]
    steps = np.arange(n // 10)
    generations = {
        "generation": steps, "evaluations": 10 * (steps + 1), "feasible_so_far": np.cumsum(excess == 0.0)[9::10],
        "front_size": steps, "least_violation": np.minimum.accumulate(excess)[9::10],
        "dominated_share": steps / (np.nan if end == UNFINISHED else n),
    }  # fmt: skip
    tables = {
        "evaluations": (columns, arrays),
        "generations": ([Column(name, "", "generation", name) for name in generations], generations),
        "front": (columns, {name: values[front] for name, values in arrays.items()}),
    }
    write_result(path, TUNING, "", manifest(objectives, limit, n, end), tables)
    return open_tuning(path)


def manifest(objectives, limit, n, end):
    """What the engine knows of the search."""
    measured = {"quantile": None}
    return {
        "created_utc": "2026-04-21T10:15:00Z",
        "campaign": {"name": "test", "title": "A made-up search", "model": "m", "digest": "d", "seed": 1, "cases": 1},
        "model": {"name": "m", "title": "M", "source": "nobody", "digest": "e"},
        "tuning": {
            "seed": 1, "population": 10, "generations": n // 10, "flown": n // 10, "patience": None,
            "end": end, "cases": 1, "crossover": 0.9, "mutation": 0.5,
            "parameters": [
                {"name": name, "lower": 0.0, "upper": 1.0, "nominal": 0.3, "source": "Table 2"}
                for name in ("gain", "delay_s")
            ],
            "objectives": [{"name": name, "metric": name, "goal": "minimise", **measured} for name in objectives],
            "constraints": [
                {"name": "limited", "metric": "delay_s", "at_most": limit, "at_least": None, "source": "Table 5",
                 **measured},
            ],
            "published": [
                {"name": "Table 8", "values": {name: 0.9 for name in objectives}, "source": "the paper"},
                {"name": "Table 9", "values": {name: -0.9 for name in objectives}, "source": "another paper"},
            ],
        },
    }  # fmt: skip
