"""The keys of a campaign file: its sections as pydantic models, and their JSON schema.

These classes do not depend on a model; `mc_engine.campaign.loading` checks a file against one.
"""

import math
from datetime import date
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, PlainValidator, Tag, WithJsonSchema
from pydantic_core import PydanticCustomError

from mc_engine.model.program import SimulatorSection
from mc_engine.sampling.distributions import Scalar
from mc_engine.section import ReportSection, Section, Share
from mc_engine.status import MOST_CASES

MOST_LEVELS = 1_000_000
MOST_STEPS = 10**12
LONGEST_LINE, LONGEST_NOTE = 300, 5000  # letters
LARGEST = 1e50  # beyond it, squares and quotients of numbers leave the range of float64

DesignName = Literal["mc", "lhs", "sobol", "saltelli", "morris", "grid", "one_at_a_time", "table"]


def _scalar(value: Any) -> Scalar:
    if isinstance(value, bool | str):
        return value
    if isinstance(value, date):  # TOML has dates of its own, with and without time
        return value.isoformat()
    if not isinstance(value, int | float):
        raise PydanticCustomError("scalar", "{shown} is neither a number, nor true or false, nor a word")
    if value != value or abs(value) == math.inf:
        raise PydanticCustomError("finite_number", "not a finite number")
    if abs(value) > LARGEST:  # also of a whole number that no float64 can hold
        raise PydanticCustomError("less_than_equal", "too large", {"le": LARGEST})
    return float(value)


def _not_tiny(value: float) -> float:
    if value < 1.0 / LARGEST:
        raise PydanticCustomError("greater_than", "too small", {"gt": 1.0 / LARGEST})
    return value


def _printable(value: str) -> str:
    """Text of printable characters: none that controls a terminal or is invisible."""
    if not value.replace("\n", "").replace("\t", "").isprintable():
        raise PydanticCustomError("not_printable", "letters that cannot be seen")
    return value


def _one_line(value: str) -> str:
    if "\n" in value:
        raise PydanticCustomError("not_one_line", "more than one line")
    return value


Line = Annotated[str, Field(max_length=LONGEST_LINE), AfterValidator(_printable), AfterValidator(_one_line)]
Note = Annotated[str, Field(max_length=LONGEST_NOTE), AfterValidator(_printable)]
Value = Annotated[
    Any, PlainValidator(_scalar), WithJsonSchema({"anyOf": [{"type": t} for t in ("number", "boolean", "string")]})
]
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(gt=0.0, le=LARGEST), AfterValidator(_not_tiny)]


class CampaignSection(Section):
    """[campaign]: which model, which cases."""

    model: str | None = Field(
        default=None, min_length=1, description='a module such as "campaigns.deorbit", or "model.py" beside this file'
    )
    simulator: str | None = Field(
        default=None, min_length=1, description='in place of model: a module, or "sim.py" beside this file'
    )
    cases: int | None = Field(
        default=None, ge=1, le=MOST_CASES, description="number of cases; grid, one_at_a_time and table need none"
    )
    design: DesignName = Field(description="how the cases are generated")
    seed: int | None = Field(
        default=None,
        ge=0,
        le=2**63 - 1,
        description="any whole number from 0 on; grid, one_at_a_time and table need none",
    )
    table: str | None = Field(
        default=None, min_length=1, description='CSV or Parquet beside this file; for design = "table"'
    )
    max_steps: int | None = Field(
        default=None,
        ge=1,
        le=MOST_STEPS,
        description="most steps of AdaptiveStep; a case that needs more ends as step-limit",
    )
    title: Line = Field(default="", description="one line for the report")
    note: Note = Field(default="", description="remark, shown in the report")


class DispersionSection(Section):
    """Keys that every [dispersion.NAME] may have."""

    unit: Line | None = Field(default=None, description="unit of the numbers here; default: the parameter's own")
    levels: int | None = Field(
        default=None, ge=2, le=MOST_LEVELS, description="equally spaced levels, for grid or one_at_a_time (default: 2)"
    )
    values: list[Value] | None = Field(
        default=None, min_length=1, description="for grid and one_at_a_time: the levels; for discrete: the values"
    )
    source: Line = Field(default="", description="source of the dispersion, shown in the report")
    note: Note = ""


class LevelsDispersion(DispersionSection):
    """Without dist: levels of an input for grid and one_at_a_time, or unit and source of a column for table."""

    mean: Number | None = None
    half_range: Positive | None = None
    three_sigma: Positive | None = None
    lower: Number | None = None
    upper: Number | None = None


class NormalDispersion(DispersionSection):
    dist: Literal["normal"]
    mean: Number | None = Field(default=None, description="default: the nominal value")
    sigma: Positive | None = Field(default=None, description="standard deviation, before truncation")
    three_sigma: Positive | None = Field(default=None, description="three standard deviations, in place of sigma")
    lower: Number | None = Field(default=None, description="the distribution is truncated below it")
    upper: Number | None = Field(default=None, description="the distribution is truncated above it")


class UniformDispersion(DispersionSection):
    """Needs lower and upper, or half_range about mean."""

    dist: Literal["uniform"]
    mean: Number | None = Field(default=None, description="middle, for half_range; default: the nominal value")
    half_range: Positive | None = Field(default=None, description="half of upper - lower")
    lower: Number | None = Field(default=None, description="smallest value")
    upper: Number | None = Field(default=None, description="largest value")


class TriangularDispersion(DispersionSection):
    """Needs lower and upper, or half_range about mode."""

    dist: Literal["triangular"]
    mode: Number | None = Field(default=None, description="most probable value; default: the nominal value")
    half_range: Positive | None = Field(default=None, description="half of upper - lower")
    lower: Number | None = Field(default=None, description="smallest value")
    upper: Number | None = Field(default=None, description="largest value")


class LognormalDispersion(DispersionSection):
    """Needs median and log_sigma (standard deviation of ln x), or mean and sigma (of x itself)."""

    dist: Literal["lognormal"]
    median: Positive | None = Field(default=None, description="default: the nominal value")
    log_sigma: Annotated[float, Field(gt=0.0, le=10.0)] | None = None
    mean: Positive | None = Field(default=None, description="default: the nominal value")
    sigma: Positive | None = None
    lower: Number | None = Field(default=None, description="the distribution is truncated below it")
    upper: Number | None = Field(default=None, description="the distribution is truncated above it")


class BetaDispersion(DispersionSection):
    """Between lower and upper, density (x - lower)^(alpha - 1) (upper - x)^(beta - 1)."""

    dist: Literal["beta"]
    alpha: float = Field(gt=0.0, le=1e12, description="a positive number")  # beyond, SciPy computes no quantiles
    beta: float = Field(gt=0.0, le=1e12, description="a positive number")
    lower: Number = Field(description="smallest value")
    upper: Number = Field(description="largest value")


class ExponentialDispersion(DispersionSection):
    """Values from origin on; the mean is origin + scale."""

    dist: Literal["exponential"]
    scale: Positive = Field(description="mean distance from origin, before truncation")
    origin: Number | None = Field(default=None, description="smallest value; default: the nominal value")
    lower: Number | None = Field(default=None, description="the distribution is truncated below it")
    upper: Number | None = Field(default=None, description="the distribution is truncated above it")


class DiscreteDispersion(DispersionSection):
    dist: Literal["discrete"]
    values: list[Value] = Field(min_length=1, description="the values, one of which each case has")
    weights: list[Annotated[float, Field(ge=0.0, le=LARGEST)]] | None = Field(
        default=None, description="relative probabilities of the values; default: equal; need not sum to 1"
    )


class EmpiricalDispersion(DispersionSection):
    dist: Literal["empirical"]
    file: str = Field(min_length=1, description="CSV or Parquet beside this file; each case has one of its numbers")
    column: str | None = Field(default=None, description="the column, if the file has more than one")
    lower: Number | None = Field(default=None, description="smaller numbers of the file are left out")
    upper: Number | None = Field(default=None, description="larger numbers of the file are left out")


class ConstantDispersion(DispersionSection):
    dist: Literal["constant"]
    value: Value = Field(description="the value of all cases")


DISTRIBUTIONS: dict[str, type[DispersionSection]] = {
    "normal": NormalDispersion,
    "uniform": UniformDispersion,
    "triangular": TriangularDispersion,
    "lognormal": LognormalDispersion,
    "beta": BetaDispersion,
    "exponential": ExponentialDispersion,
    "discrete": DiscreteDispersion,
    "empirical": EmpiricalDispersion,
    "constant": ConstantDispersion,
}


class CorrelationSection(Section):
    """[[correlation]]: rank correlation of one pair of dispersions; all entries together make one matrix."""

    between: list[str] = Field(min_length=2, max_length=2, description="the names of two dispersions")
    rank: float = Field(gt=-1.0, lt=1.0, description="Spearman rank correlation, between -1 and 1")
    source: Line = ""
    note: Note = ""


class CovarianceSection(Section):
    """[covariance.NAME]: the covariance of an orbit message as normal dispersions of six parameters."""

    file: str = Field(min_length=1, description="a CCSDS OPM or OEM (KVN) beside this file")
    parameters: list[str] = Field(
        min_length=6, max_length=6, description="the parameters of position and velocity, in the order of the axes"
    )
    frame: str = Field(
        min_length=1, description="axes of the parameters: RTN, TNW, or the frame of the message's state"
    )
    epoch: str | None = Field(default=None, description="epoch of the covariance, if an OEM has more than one")
    source: Line = ""
    note: Note = ""


class RequirementSection(Section):
    """[requirement.NAME]: a limit on a metric: at_most, at_least or both."""

    metric: str = Field(description="a metric of the model")
    at_most: Number | None = Field(default=None, description="upper limit of the metric")
    at_least: Number | None = Field(default=None, description="lower limit of the metric")
    share: Share = Field(default=0.9973, description="required probability of being inside the limits")
    confidence: Share = Field(default=0.90, description="confidence of its demonstration by the cases")
    source: Line = ""
    note: Note = ""


class WorstSection(Section):
    """`worst` in [retention.histories]: the worst cases of a metric; a table in braces, or a list of such tables."""

    metric: str = Field(description="a metric of the model")
    count: int = Field(default=5, ge=1, le=1000, description="number of worst cases")
    side: Literal["largest", "smallest"] | None = Field(
        default=None,
        description="default: the smallest margins to a limit; without a requirement, the largest values",
    )


Worst = Annotated[
    Annotated[WorstSection, Tag("one")] | Annotated[list[WorstSection], Tag("many")],
    Discriminator(lambda value: "many" if isinstance(value, list) else "one"),
]


class HistoriesSection(Section):
    """[retention.histories]: the cases whose time histories are saved."""

    nominal: bool = Field(default=True, description="the nominal case")
    first: int = Field(default=0, ge=0, le=100_000, description="number of cases, from the first one on")
    cases: list[Annotated[int, Field(ge=0)]] = Field(default_factory=list, description="case numbers")
    rows: int = Field(default=1500, ge=10, le=1_000_000, description="approximate number of rows of each history")
    worst: Worst | None = Field(default=None, description="the worst cases of a metric")

    @property
    def worst_of(self) -> list[WorstSection]:
        """The tables of `worst`, as a list."""
        return [self.worst] if isinstance(self.worst, WorstSection) else self.worst or []


class RetentionSection(Section):
    """[retention]: what is saved besides the table of cases."""

    histories: HistoriesSection = Field(default_factory=HistoriesSection)


class TunedSection(Section):
    """[tuning.parameter.NAME]: the range in which a parameter may be chosen."""

    lower: Number = Field(description="smallest value that the search may choose")
    upper: Number = Field(description="largest value that the search may choose")
    source: Line = ""
    note: Note = ""


class ObjectiveSection(Section):
    """[tuning.objective.NAME]: a metric to be minimised or maximised."""

    metric: str = Field(description="a metric of the model")
    goal: Literal["minimise", "maximise"] = "minimise"
    quantile: Share | None = Field(
        default=None, description="optimise this quantile over the dispersed cases; default: the nominal case"
    )
    note: Note = ""


class ConstraintSection(Section):
    """[tuning.constraint.NAME]: a limit on a metric: at_most, at_least or both."""

    metric: str = Field(description="a metric of the model")
    at_most: Number | None = None
    at_least: Number | None = None
    quantile: Share | None = Field(
        default=None, description="limit this quantile over the dispersed cases; default: the nominal case"
    )
    source: Line = ""
    note: Note = ""


class PublishedPointSection(Section):
    """[[tuning.published]]: a published solution, drawn in the figures of the front."""

    name: Line = Field(min_length=1, description="name of the point in the report")
    values: dict[str, Number] = Field(description="the value of every objective, by the objective's name")
    source: Line = ""


class TuningSection(Section):
    """[tuning]: parameters, objectives, constraints and settings of the search by `mc-engine tune` (NSGA-II)."""

    parameter: dict[str, TunedSection] = Field(default_factory=dict)
    objective: dict[str, ObjectiveSection] = Field(default_factory=dict)
    constraint: dict[str, ConstraintSection] = Field(default_factory=dict)
    published: list[PublishedPointSection] = Field(default_factory=list)
    population: int = Field(default=48, ge=4, le=100_000, description="candidates in a generation")
    generations: int = Field(default=60, ge=1, le=100_000, description="number of generations, including the first")
    patience: int | None = Field(
        default=None, ge=1, description="stop after this many generations in a row without progress; default: never"
    )
    seed: int | None = Field(default=None, ge=0, le=2**32 - 1, description="of the search; default: that of [campaign]")
    crossover: float = Field(default=0.9, ge=0.0, le=1.0, description="probability that two parents are crossed")
    mutation: float | None = Field(
        default=None,
        gt=0.0,
        le=1.0,
        description="probability that a parameter mutates; default: 1 / number of tuned parameters",
    )


AnyDispersion = (
    LevelsDispersion | NormalDispersion | UniformDispersion | TriangularDispersion | LognormalDispersion
    | BetaDispersion | ExponentialDispersion | DiscreteDispersion | EmpiricalDispersion | ConstantDispersion
)  # fmt: skip


class InputsSection(Section):
    """[inputs]: parameters that every case takes from the case with the same number in another run, flown before."""

    source: str = Field(alias="from", min_length=1, description='a run, or the campaign to be flown first: "deorbit"')
    columns: dict[str, str] = Field(
        default_factory=dict,
        description="parameter = column of that run; not needed for results with the name of a parameter",
    )
    note: Note = ""


class SensitivitySection(Section):
    """[sensitivity]: additional flights, from which the contributions of the inputs to each metric are computed."""

    cases: int = Field(ge=32, le=10_000_000, description="base cases; each is flown twice, and once for each group")
    group: dict[str, list[str]] = Field(default_factory=dict, description="dispersions analysed together, by group")


class CampaignFile(Section):
    """A campaign of mc-engine: a model, the dispersions of its inputs, and the requirements on its results."""

    campaign: CampaignSection = Field(description="the table [campaign] with model, design, ...")
    parameters: dict[str, Value] = Field(default_factory=dict, description="other nominal values and settings")
    dispersion: dict[str, AnyDispersion] = Field(default_factory=dict, description="dispersed inputs, by parameter")
    correlation: list[CorrelationSection] = Field(default_factory=list, description="of pairs of dispersions")
    covariance: dict[str, CovarianceSection] = Field(default_factory=dict, description="from orbit messages, by name")
    inputs: InputsSection | None = Field(default=None, description="inputs taken from another run, case by case")
    requirement: dict[str, RequirementSection] = Field(default_factory=dict, description="limits on metrics, by name")
    retention: RetentionSection = Field(default_factory=RetentionSection, description="time histories to save")
    sensitivity: SensitivitySection | None = Field(default=None, description="contributions of the inputs")
    simulator: SimulatorSection | None = Field(default=None, description="a program or FMU, in place of a model")
    report: ReportSection = Field(default_factory=ReportSection, description="probability and confidence of the report")
    tuning: TuningSection | None = Field(default=None, description="search for the best parameters by `mc-engine tune`")


def schema() -> dict[str, Any]:
    """The JSON schema of a campaign file, for editors that complete and check TOML."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **CampaignFile.model_json_schema()}
