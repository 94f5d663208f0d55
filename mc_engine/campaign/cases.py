"""The case table: the inputs of any cases of a campaign, each a function of (campaign, seed, case_id) alone."""

from typing import Any

import numpy as np

from mc_engine.campaign.dispersions import Dispersion
from mc_engine.campaign.inputs import number
from mc_engine.campaign.loading import Campaign, refuse_no_campaign
from mc_engine.campaign.parts import rank_pairs
from mc_engine.campaign.sensitivity_design import DESIGN as PICK_FREEZE
from mc_engine.campaign.sensitivity_design import companion_table, names_a_draw, upstream_ids
from mc_engine.errors import CampaignError, Problem
from mc_engine.model.fields import Setting
from mc_engine.sampling.designs import BY_LEVELS, EXTENSIBLE, grid_levels, one_at_a_time_levels, unit_cube
from mc_engine.sampling.distributions import column, quantiles
from mc_engine.status import MOST_CASES
from mc_engine.units import convert

_UNITLESS_KEYS = ("log_sigma", "alpha", "beta")
_SIGMAS = ("sigma", "three_sigma")
_SIGMA_DIGITS = 5


def case_table(campaign: Campaign, case_ids: np.ndarray) -> dict[str, np.ndarray]:
    """The dispersed inputs of any cases of a campaign, without flying them.

    campaign : Campaign
    case_ids : int64[n], numbers of the cases, in any order.  Of a design that can be extended ("mc", "sobol",
        "saltelli", "morris") they may exceed the campaign's number, up to the 10^9 cases of the largest campaign: they
        are then cases of a campaign with more cases.

    Returns a dict with one column per dispersion, in file order and declared units: float64[n], bool[n], or object[n]
    of words.  A row depends on (campaign, seed, case_id) alone.

    Raises CampaignError for a case that the campaign does not have, or whose upstream run has yet to be flown.

    >>> table = case_table(load_campaign("minimal"), np.array([0, 17]))
    >>> table["pitch_error_deg"].round(3).tolist()
    [1.003, -1.985]
    """
    ids = _checked_ids(campaign, case_ids)
    if campaign.upstream is not None:
        rows = upstream_ids(campaign, ids)
        inputs = {name: values[rows] for name, values in campaign.upstream.table.items()}
        return inputs if campaign.design == "table" else {**inputs, **_random_table(campaign, ids)}
    if campaign.design == "table":
        return {name: values[ids] for name, values in campaign.table.items()}
    if campaign.design in BY_LEVELS:
        levels_of = grid_levels if campaign.design == "grid" else one_at_a_time_levels
        indices = levels_of([len(dispersion.levels) for dispersion in campaign.dispersions], ids)
        # The nominal value stands last, where index -1 finds it.
        return {
            dispersion.name: column([*dispersion.levels, campaign.nominal[dispersion.name]])[index]
            for dispersion, index in zip(campaign.dispersions, indices, strict=True)
        }
    return _random_table(campaign, ids)


def _checked_ids(campaign: Campaign, case_ids: np.ndarray) -> np.ndarray:
    refuse_no_campaign(campaign)
    try:
        given = np.atleast_1d(case_ids)
    except ValueError:  # of lists in a list
        given = np.array([case_ids], dtype=object)
    items = [] if given.dtype.kind in "iu" else given.tolist()
    wrong = [item for item in items if type(item) is not int]  # whole numbers beyond 64 bits are objects to NumPy
    if given.ndim > 1 or wrong:
        one: Any = next(iter(wrong or given.tolist()), [])
        message = f"a case is a whole number from 0 to {campaign.cases - 1}, and {one!r} is none"
        raise CampaignError(campaign.name, [Problem("", message)])
    if campaign.first is not None:
        message = f'has yet to be flown; `mc-engine run` flies "{campaign.first.name}" before this campaign'
        raise CampaignError(campaign.name, [Problem("inputs.from", message)])
    n_cases = MOST_CASES if is_endless(campaign) else campaign.cases
    beyond = given >= n_cases  # before the conversion, in which the largest unsigned numbers become negative
    if (others := given[(given < 0) | beyond]).size:
        last = n_cases - 1 if beyond.any() else campaign.cases - 1
        raise CampaignError(campaign.name, [Problem("", f"there is no case {others[0]}; they are 0 to {last}")])
    return given.astype(np.int64)


def is_endless(campaign: Campaign) -> bool:
    """Whether the design also defines cases beyond the campaign's number, those of a campaign with more cases."""
    return campaign.design in EXTENSIBLE and campaign.upstream is None


def _random_table(campaign: Campaign, ids: np.ndarray) -> dict[str, np.ndarray]:
    if campaign.design == PICK_FREEZE:
        return companion_table(campaign, ids)
    names = [dispersion.name for dispersion in campaign.dispersions]
    pairs = rank_pairs(campaign.correlations)
    cube = unit_cube(campaign.design, campaign.seed, names, ids, campaign.cases, pairs)
    table = {}
    for dispersion, u in zip(campaign.dispersions, cube, strict=True):
        assert dispersion.distribution is not None  # a loaded campaign has one for every random design
        table[dispersion.name] = quantiles(dispersion.distribution, u)
    return table


def full_inputs(campaign: Campaign, table: dict[str, np.ndarray]) -> dict[str, Any]:
    """Every parameter and setting: its column of `table` if there is one, else its nominal value."""
    return {**campaign.nominal, **table}


def dispersion_records(campaign: Campaign) -> list[dict[str, Any]]:
    """One plain record for each dispersion, for manifest and report: name, unit, nominal, distribution, bounds, source.

    random_draw : true for a dispersion that only selects a random draw; absent for all others.
    choices : of a setting that is a word, the words in the model's order; absent for all others.
    """
    records = []
    for dispersion in campaign.dispersions:
        item = campaign.model.input(dispersion.name)
        records.append(
            {
                "name": dispersion.name,
                "unit": item.unit,
                "description": item.description,
                "nominal": campaign.nominal[dispersion.name],
                "distribution": _distribution_text(campaign, dispersion, item.unit),
                "bounds": _bounds_text(dispersion, item.unit),
                "source": dispersion.source,
                "note": dispersion.note,
                **({"random_draw": True} if names_a_draw(campaign.model, dispersion.name) else {}),
                **({"choices": list(item.choices)} if isinstance(item, Setting) and item.choices else {}),
            }
        )
    return records


def _distribution_text(campaign: Campaign, dispersion: Dispersion, unit: str) -> str:
    """Such as "normal, 3σ = 20 %", in the words of the campaign file and the unit of the input's row.

    A sigma has five digits at most, since it may come from a covariance, or from another unit.
    """
    if campaign.design == "table":
        return f"column of {campaign.table_path.name}" if campaign.table_path else ""
    if dispersion.levels:
        levels = [_scalar_text(value) for value in dispersion.levels]
        inside = levels if len(levels) <= 6 else [levels[0], levels[1], "...", levels[-1]]
        return _with_unit(f"{len(levels)} level{'s' if len(levels) > 1 else ''}: {', '.join(inside)}", unit)
    signs = {"three_sigma": "3σ", "sigma": "σ", "log_sigma": "σ of ln", "half_range": "±"}
    keys = ("mean", "median", "mode", "origin", "sigma", "three_sigma", "log_sigma", "half_range", "scale")
    parts = [str(dispersion.dist)]
    for key in (*keys, "alpha", "beta", "value", "values", "weights", "file", "column"):
        if key in dispersion.spec:
            plain = key in (*_UNITLESS_KEYS, "weights", "file", "column")
            given = dispersion.spec[key] if plain else _in_unit(dispersion, dispersion.spec[key], unit)
            text = f"{given:.{_SIGMA_DIGITS}g}" if key in _SIGMAS else _scalar_text(given)
            value = _with_unit(text, "" if plain else unit)
            parts.append(f"±{value}" if key == "half_range" else f"{signs.get(key, key)} = {value}")
    if dispersion.dist == "exponential" and "origin" not in dispersion.spec:
        parts.insert(1, f"origin = {_with_unit(_scalar_text(campaign.nominal[dispersion.name]), unit)}")
    return ", ".join(parts)


def _bounds_text(dispersion: Dispersion, unit: str) -> str:
    """Such as "-10 to 10 %", or empty where the file sets no bounds, or levels, whose ends are named."""
    if dispersion.levels:
        return ""
    lower, upper = (_in_unit(dispersion, dispersion.spec.get(key), unit) for key in ("lower", "upper"))
    if lower is not None and upper is not None:
        return _with_unit(f"{number(lower)} to {number(upper)}", unit)
    if lower is not None:
        return f"from {_with_unit(number(lower), unit)}"
    return f"up to {_with_unit(number(upper), unit)}" if upper is not None else ""


def _in_unit(dispersion: Dispersion, value: Any, unit: str) -> Any:
    """A number (or list of numbers) of the campaign file in `unit`; words and switches as they are."""
    if isinstance(value, list):
        return [_in_unit(dispersion, item, unit) for item in value]
    written = dispersion.spec.get("unit", unit)
    other = isinstance(value, int | float) and not isinstance(value, bool) and written != unit
    return convert(float(value), written, unit) if other else value


def _scalar_text(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_scalar_text(item) for item in value)
    if isinstance(value, bool):
        return str(value).lower()
    return number(value) if isinstance(value, int | float) else str(value)


def _with_unit(text: str, unit: str) -> str:
    return f"{text} {unit}" if unit else text
