"""The section [tuning], checked against the model: parameters to be chosen, objectives, constraints."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mc_engine.campaign.inputs import check_value, number
from mc_engine.campaign.parts import check_limits, check_metric
from mc_engine.campaign.reading import Findings, TuningSections
from mc_engine.campaign.sections import ConstraintSection, ObjectiveSection, PublishedPointSection, TunedSection
from mc_engine.model.fields import Setting, inputs_of
from mc_engine.model.simulator import System
from mc_engine.sampling.designs import RANDOM
from mc_engine.suggestions import hint, listed

# columns of a tuning's tables beside those named by parameters, objectives and constraints
OWN_COLUMNS = ("generation", "candidate", "violation", "feasible", "failed_cases", "commonest_failure")


class Tuned(TunedSection):
    """A parameter that may be chosen between lower and upper, in its declared unit."""

    name: str


class Objective(ObjectiveSection):
    """A metric to minimise or maximise: its value in the nominal case, or a quantile over the dispersed cases."""

    name: str

    @property
    def large_is_bad(self) -> bool:
        return self.goal == "minimise"


class Constraint(ConstraintSection):
    """Limits on a metric: on its value in the nominal case, or on a quantile over the dispersed cases."""

    name: str

    @property
    def large_is_bad(self) -> bool:
        return self.at_most is not None


@dataclass(frozen=True)
class Tuning:
    """The search of `mc-engine tune`.  seed None: that of the campaign;  mutation None: 1 / number of parameters."""

    parameters: tuple[Tuned, ...]
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    published: tuple[PublishedPointSection, ...]
    population: int
    generations: int
    patience: int | None
    seed: int | None
    crossover: float
    mutation: float | None

    @property
    def measures(self) -> "tuple[Objective | Constraint, ...]":
        """Objectives, then constraints."""
        return (*self.objectives, *self.constraints)

    @property
    def signs(self) -> np.ndarray:
        """float64[n_objectives]: the factors, 1 or -1, that make all objectives ones to be minimised."""
        return np.array([1.0 if objective.large_is_bad else -1.0 for objective in self.objectives])

    @property
    def nominal(self) -> bool:
        """Whether the nominal case of a candidate is flown."""
        return any(measure.quantile is None for measure in self.measures)

    @property
    def robust(self) -> bool:
        """Whether the dispersed cases of a candidate are flown."""
        return any(measure.quantile is not None for measure in self.measures)


def check_tuning(
    sections: TuningSections | None, model: System, dispersed: list[str], design: str | None, findings: Findings
) -> Tuning | None:
    """The tuning, None without one or if its plain keys could not be read; problems are noted in `findings`."""
    if sections is None:
        return None
    for kind, entries in (("parameter", sections.parameters), ("objective", sections.objectives)):
        if not entries and not any(
            problem.place.startswith(f"{findings.place}.{kind}") for problem in findings.problems
        ):
            findings.add("", f"has no {kind}; [tuning.{kind}.NAME] adds one")
    for name, tuned in sections.parameters.items():
        _check_tuned(name, tuned, model, dispersed, findings.under("parameter", name))
    for name, objective in sections.objectives.items():
        _check_measured(objective, model, dispersed, design, findings.under("objective", name))
    for name, constraint in sections.constraints.items():
        _check_measured(constraint, model, dispersed, design, findings.under("constraint", name))
        check_limits(constraint, findings.under("constraint", name))
        if constraint.quantile is not None and constraint.at_most is not None and constraint.at_least is not None:
            message = "one quantile cannot keep two limits; make two constraints of it"
            findings.under("constraint", name).add("quantile", message)
    _check_names(sections, findings)
    for place, point in sections.published.items():
        _check_values(point.values, sections.objective_names, findings.under(place, "values"))
    head = sections.head
    if head is None:
        return None
    tables = {"parameter", "objective", "constraint", "published"}
    return Tuning(
        parameters=tuple(Tuned(name=name, **section.model_dump()) for name, section in sections.parameters.items()),
        objectives=tuple(Objective(name=name, **section.model_dump()) for name, section in sections.objectives.items()),
        constraints=tuple(
            Constraint(name=name, **section.model_dump()) for name, section in sections.constraints.items()
        ),
        published=tuple(sections.published.values()),
        **head.model_dump(exclude=tables),
    )


def _check_names(sections: TuningSections, findings: Findings) -> None:
    """Parameters, objectives and constraints are columns of the same tables, so that their names must differ."""
    owners = dict.fromkeys(OWN_COLUMNS, "a column of every tuning")
    kinds: dict[str, Mapping[str, object]] = {
        "parameter": sections.parameters,
        "objective": sections.objectives,
        "constraint": sections.constraints,
    }
    for kind, entries in kinds.items():
        for name in entries:
            if name in owners:
                findings.under(kind, name).add("", f"is the name of {owners[name]} already; choose another")
            owners.setdefault(name, f"a{'n' if kind == 'objective' else ''} {kind}")


def _check_tuned(name: str, section: TunedSection, model: System, dispersed: list[str], findings: Findings) -> None:
    item = inputs_of(model).get(name)
    if item is None:
        findings.add(
            "", f"is not a parameter of {model.name}{hint(name, [parameter.name for parameter in model.parameters])}"
        )
        return
    if isinstance(item, Setting):
        findings.add("", "is a setting, which all cases of a batch share; only parameters can be tuned")
        return
    if name in dispersed:
        findings.add("", "is dispersed as well; a parameter is chosen or dispersed, not both")
    for key, value in (("lower", section.lower), ("upper", section.upper)):
        check_value(value, item, findings, key)
    if section.lower >= section.upper:
        findings.add("lower", f"{number(section.lower)} is not below upper = {number(section.upper)}")


def _check_measured(
    section: ObjectiveSection | ConstraintSection,
    model: System,
    dispersed: list[str],
    design: str | None,
    findings: Findings,
) -> None:
    check_metric(section.metric, model, findings)
    if section.quantile is None:
        return
    if not dispersed:
        findings.add(
            "quantile", "is over dispersed cases, and nothing is dispersed; add [dispersion.NAME] or leave it out"
        )
    elif design is not None and design not in RANDOM:
        findings.add("quantile", f'the design "{design}" draws no cases at random; quantiles are for {listed(RANDOM)}')


def _check_values(values: Mapping[str, float], objectives: Iterable[str], findings: Findings) -> None:
    objectives = list(objectives)
    for name in values:
        if name not in objectives:
            findings.add(name, f"is not an objective{hint(name, objectives)}")
    for name in objectives:
        if name not in values:
            findings.add(name, "is missing: a point needs a number for every objective")
