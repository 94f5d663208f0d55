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

    probability: Share = Field(default=0.9973, ge=0.5, description="of tolerance limits and percentiles")
    confidence: Share = Field(default=0.90, ge=0.5, description="with which each bound holds")
