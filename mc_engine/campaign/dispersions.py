"""The dispersions of a campaign: which input varies, by which distribution or levels, and the source of the numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.campaign.distribution_keys import DispersionContext, build_distribution, checked_values, refuse_no_spread
from mc_engine.campaign.inputs import about, check_value, number, within_rounding
from mc_engine.campaign.reading import Findings
from mc_engine.campaign.sections import DISTRIBUTIONS, DispersionSection
from mc_engine.model.fields import Parameter, Setting
from mc_engine.sampling.designs import BY_LEVELS
from mc_engine.sampling.distributions import Constant, Discrete, Distribution, Scalar
from mc_engine.suggestions import hint, listed
from mc_engine.units import UNITS, compatible, convert

# Keys that are plain numbers or no numbers; all others have the unit of the dispersion.
_WITHOUT_UNIT = {"dist", "unit", "levels", "source", "note", "log_sigma", "alpha", "beta", "weights", "file", "column"}


@dataclass(frozen=True)
class Dispersion:
    """One dispersed input: `spec` as written in the file, and its distribution in the unit of the parameter.

    distribution : for the random designs.  levels : for "grid" and "one_at_a_time", one value for each level.
    """

    name: str
    dist: str | None
    spec: Mapping[str, Any]
    source: str
    note: str
    distribution: Distribution | None = None
    levels: tuple[Scalar, ...] = ()


def build_dispersion(
    name: str,
    section: DispersionSection,
    item: Parameter | Setting,
    nominal: Scalar,
    design: str,
    directory: Path,
    findings: Findings,
) -> Dispersion:
    """The dispersion that a section [dispersion.NAME] describes.

    Problems are noted in `findings`; the result must not be used then.
    """
    spec = {
        key: value for key, value in section.model_dump(exclude_none=True).items() if key in section.model_fields_set
    }
    before = len(findings.problems)
    context = DispersionContext(item, nominal, design, _own_unit(section, item, findings), directory, findings)
    _check_keys_fit(spec, design, context)
    distribution = None
    levels: tuple[Scalar, ...] = ()
    if len(findings.problems) == before and design != "table":
        distribution = build_distribution(context)
        if len(findings.problems) == before and design in BY_LEVELS:
            levels = _levels(context, distribution)
    return Dispersion(name, spec.get("dist"), spec, section.source, section.note, distribution, levels)


def _own_unit(section: DispersionSection, item: Parameter | Setting, findings: Findings) -> SimpleNamespace:
    """All keys of the section, those with a unit converted to that of the parameter."""
    options = section.model_dump()
    unit = options["unit"]
    if unit is not None and unit not in compatible(item.unit):
        quantity = UNITS[item.unit].quantity
        meaning = "plain numbers" if quantity == "number" else quantity
        absolute = "; spreads are absolute: convert a percentage of the nominal value" if unit == "%" else ""
        findings.add("unit", f'"{unit}" is not a unit of {meaning}{hint(unit, compatible(item.unit))}{absolute}')
        unit = None
    if unit is not None:
        options = {key: _converted(key, value, unit, item) for key, value in options.items()}
    return SimpleNamespace(**{"dist": None, **options})


def _converted(key: str, value: Any, unit: str, item: Parameter | Setting) -> Any:
    if key in _WITHOUT_UNIT or isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, list):
        return [_converted(key, number, unit, item) for number in value]
    return within_rounding(convert(value, unit, item.unit), item)


def _check_keys_fit(spec: Mapping[str, Any], design: str, context: DispersionContext) -> None:
    """Note keys that this design, or this kind of input, does not use."""
    findings, dist = context.findings, spec.get("dist")
    if design == "table":
        for key in [key for key in spec if key not in ("unit", "source", "note")]:
            findings.add(
                key, 'the design "table" takes its values from a file; only unit, source and note may stand here'
            )
        return
    if design in BY_LEVELS:
        if "values" in spec and "levels" in spec:
            findings.add("levels", "there are values already; give one of the two")
        _check_level_keys(spec, findings)
    elif dist is None:
        findings.add("dist", f'is missing; the design "{design}" needs one of {listed(DISTRIBUTIONS)}')
    else:
        for key in [key for key in ("levels", "values") if key in spec and (key, dist) != ("values", "discrete")]:
            other = ', and values for dist = "discrete"' if key == "values" else ""
            findings.add(key, f'the design "{design}" has no levels; they are for grid and one_at_a_time{other}')
    if isinstance(context.item, Setting) and dist not in (None, "discrete", "constant"):
        own = f", or disperse {context.item.dispersed_by}" if context.item.dispersed_by else ""
        findings.add("dist", f'"{dist}" does not fit a setting, which all cases of a batch share; use "discrete"{own}')


def _check_level_keys(spec: Mapping[str, Any], findings: Findings) -> None:
    """Note keys that say nothing of the levels of an axis."""
    dist = spec.get("dist")
    if dist == "constant":
        for key in [key for key in ("levels", "values") if key in spec]:
            findings.add(key, "belongs to an axis of several levels; a constant has one, its value")
    elif dist not in (None, "discrete") and "values" in spec:
        findings.add("values", f'do not go with dist = "{dist}"; leave one of the two out')
    elif dist is None and "values" in spec:
        for key in [key for key in ("mean", "half_range", "three_sigma", "lower", "upper") if key in spec]:
            findings.add(key, "belongs to levels = n; values already say it all")


def _levels(context: DispersionContext, distribution: Distribution | None) -> tuple[Scalar, ...]:
    """The values that the designs "grid" and "one_at_a_time" use."""
    keys = context.keys
    if isinstance(distribution, Discrete):
        return distribution.values
    if isinstance(distribution, Constant):
        return (distribution.value,)
    if keys.values is not None:
        return tuple(value for value in checked_values(context) if value is not None)
    if isinstance(context.item, Setting):
        context.findings.add("values", "is missing; a setting takes its levels from values = [...]")
        return ()
    if keys.levels is None and context.design == "grid":
        context.findings.add("", "needs values = [...] or levels = n for the grid")
        return ()
    return _equal_steps(context, distribution)


def _equal_steps(context: DispersionContext, distribution: Distribution | None) -> tuple[float, ...]:
    span = _span(context, distribution)
    if span is None:
        return ()
    refuse_no_spread(*span, context.findings)
    for value in span:
        check_value(value, context.item, context.findings, "")
    # One dispersion at a time goes to its low and its high end unless more is asked for.
    return tuple(np.linspace(*span, context.keys.levels or 2).tolist())


def _span(context: DispersionContext, distribution: Distribution | None) -> tuple[float, float] | None:
    """Lowest and highest level: the bounds, or where the distribution has none, three sigma."""
    keys = context.keys
    if distribution is not None:
        return distribution.span
    reaches = [reach for reach in (keys.half_range, keys.three_sigma) if reach is not None]
    bounds = [bound for bound in (keys.lower, keys.upper) if bound is not None]
    if len(bounds) == 2 and not reaches and keys.mean is None:
        if bounds[0] < bounds[1]:
            return bounds[0], bounds[1]
        context.findings.add("lower", f"{number(bounds[0])} is not below upper = {number(bounds[1])}")
    elif len(reaches) == 1 and not bounds:
        centre = float(context.nominal) if keys.mean is None else keys.mean
        return about(centre, reaches[0], context.item)
    else:
        context.findings.add("", "needs lower and upper, or half_range, or three_sigma, and only one of these")
    return None
