"""The data of a tuning's report: the tables, the goals, and the front that is drawn."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.numbers_in_text import digits_within
from mc_engine.studies.tuning_folder import TuningRecord
from reports.text.numbers import axis_label, exact, given_percent, number, with_unit, words


class Tuned:
    """A tuning with the data for its report.  name : of the directory, as written in commands in the report."""

    def __init__(self, record: TuningRecord, name: str):
        self.record = record
        self.name = name
        self.manifest = record.manifest
        self.plan: Mapping[str, Any] = record.manifest["tuning"]
        self.evaluations, self.front = record.evaluations, record.front
        self.units: Mapping[str, str] = record.evaluations.attrs["units"]
        self.descriptions: Mapping[str, str] = record.evaluations.attrs["descriptions"]

    @cached_property
    def objectives(self) -> list[str]:
        return [objective["name"] for objective in self.plan["objectives"]]

    @cached_property
    def constraints(self) -> list[str]:
        return [constraint["name"] for constraint in self.plan["constraints"]]

    @cached_property
    def parameters(self) -> list[str]:
        return [parameter["name"] for parameter in self.plan["parameters"]]

    @cached_property
    def signs(self) -> np.ndarray:
        """1 for an objective that is to be small, -1 for one to be large."""
        return np.array([1.0 if objective["goal"] == "minimise" else -1.0 for objective in self.plan["objectives"]])

    @cached_property
    def best(self) -> pd.DataFrame:
        """The front; without a feasible candidate, what would be the front if there were no constraints."""
        if self.record.feasible:
            return self.front
        complete = self.evaluations[np.isfinite(self.evaluations[self.objectives]).all(axis=1)]
        values = self.signs * complete[self.objectives].to_numpy()
        beaten = [((values <= row).all(axis=1) & (values < row).any(axis=1)).any() for row in values]
        return complete[~np.array(beaten, dtype=bool)].sort_values(self.objectives[0], kind="stable")

    def label(self, name: str) -> str:
        return axis_label(words(name, self.units[name]), self.units[name])

    def ends(self, name: str) -> tuple[str, str]:
        """The smallest and the largest value on the front, in digits that tell them apart."""
        ends = float(self.best[name].min()), float(self.best[name].max())
        digits = digits_within(*ends, least=4)
        return number(ends[0], digits), number(ends[1], digits)


def inside(values: np.ndarray, constraint: Mapping[str, Any]) -> np.ndarray:
    low, high = constraint["at_least"], constraint["at_most"]
    return (values >= (-np.inf if low is None else low)) & (values <= (np.inf if high is None else high))


def limit_words(tuned: Tuned, constraint: Mapping[str, Any]) -> str:
    limits = [("at least", constraint.get("at_least")), ("at most", constraint.get("at_most"))]
    texts = [
        f"{word} {with_unit(exact(limit), tuned.units[constraint['name']])}"
        for word, limit in limits
        if limit is not None
    ]
    return f"{' and '.join(texts)}{quantile_words(constraint)}"


def metric_words(tuned: Tuned, measure: Mapping[str, Any]) -> str:
    """The metric of an objective or a constraint in words."""
    return words(measure["metric"], tuned.units[measure["name"]])


def quantile_words(measure: Mapping[str, Any]) -> str:
    return "" if measure["quantile"] is None else f" ({given_percent(measure['quantile'])} quantile)"
