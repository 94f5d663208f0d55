"""Base class and types shared by the sections of a campaign file and the records of a manifest."""

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

from mc_engine.numbers_in_text import LEAST_SHARE


def _not_an_end(share: float) -> float:
    if not LEAST_SHARE <= share <= 1.0 - LEAST_SHARE:
        raise PydanticCustomError("nearly_an_end", "nearly 0 or 1", {"least": LEAST_SHARE})
    return share


Share = Annotated[float, Field(gt=0.0, lt=1.0), AfterValidator(_not_an_end)]


class Section(BaseModel):
    """A table of the campaign file: unknown keys, values of another type and infinite numbers are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True, defer_build=True)


class ReportSection(Section):
    """[report]: probability and confidence of the statistics in a report; requirements have their own."""

    probability: Share = Field(default=0.9973, ge=0.5, description="probability of tolerance limits and percentiles")
    confidence: Share = Field(default=0.90, ge=0.5, description="confidence of each bound")

    @property
    def outer(self) -> tuple[float, float]:
        """The percentiles (0 to 1) between which a case lies with the probability."""
        return round(0.5 * (1.0 - self.probability), 12), round(0.5 * (1.0 + self.probability), 12)

    @property
    def low(self) -> float:
        """The percentile (0 to 1) above which a case lies with the probability."""
        return round(1.0 - self.probability, 12)

    @property
    def percentiles(self) -> tuple[float, ...]:
        """The percentiles in a report, ascending, each once: with a probability of 50 % three are the median."""
        return tuple(sorted({*self.outer, self.low, 0.5, self.probability}))

    @property
    def two_sided(self) -> float:
        """The confidence of an interval whose bounds each hold with the confidence."""
        return 2.0 * self.confidence - 1.0
