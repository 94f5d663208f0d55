"""Published values of a model's source, kept as a table beside the model: `published.toml`.

[[published]]
quantity = "semi-major axis of the desired path"
published = 6431.5            # a number, or words
unit = "km"
source = "Table 2"
column = "desired_semi_major_axis_km"    # and/or ours = 6431.4934
at = { ve_pct = -20.0 }       # inputs of the case to compare with
tolerance = 0.05
status = "legible"

A number of many cases says which, and reports hold it against the same number of a run with these dispersions:

statistic = "standard deviation"         # or "mean", "farthest"
of = "q1"                     # column
over = ["inertia_x_factor"]   # the inputs that are dispersed, all of them
cases = 100                   # how many cases the source has, where the number depends on it
"""

import tomllib
from pathlib import Path
from typing import Any

from mc_engine.errors import ModelError

_KEYS = {"quantity", "published", "unit", "source", "column", "ours", "at", "tolerance", "status", "note"}
_KEYS |= {"statistic", "of", "over", "cases"}
_NEEDED = {"quantity", "published"}


def read_published(path: Path) -> tuple[dict[str, Any], ...]:
    """The records of a published.toml; ModelError names a record with an unknown or missing key."""
    records = tomllib.loads(path.read_text(encoding="utf-8")).get("published", [])
    for number, record in enumerate(records, start=1):
        wrong = sorted(record.keys() - _KEYS) + sorted(f"no {key}" for key in _NEEDED - record.keys())
        if wrong:
            raise ModelError(f"{path.name}, record {number}: {', '.join(wrong)}; known are {', '.join(sorted(_KEYS))}")
    return tuple(records)
