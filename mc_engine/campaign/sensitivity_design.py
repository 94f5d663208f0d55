"""The section [sensitivity]: a pick-freeze design, flown besides the run, for first-order and total Sobol' indices.

Its cases are a separate campaign, the companion, in blocks (see `statistics.pick_freeze`): groups of inputs are
exchanged between independent points drawn from the campaign's distributions.  A group is one dispersion, the
dispersions that a [sensitivity.group] names or that are correlated, the cases of the upstream run, or the random draws:
noise made in flight and the parameters that select a draw.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.campaign.dispersions import Dispersion
from mc_engine.campaign.parts import Correlation, rank_pairs
from mc_engine.campaign.reading import Findings, name_fault
from mc_engine.campaign.sections import MOST_CASES, HistoriesSection, SensitivitySection
from mc_engine.model.fields import Parameter
from mc_engine.model.simulator import Simulator, System
from mc_engine.sampling.block_layout import NOMINAL, RANDOM_DRAWS, A, BlockLayout
from mc_engine.sampling.correlation import correlated, gaussian_copula
from mc_engine.sampling.designs import BY_LEVELS, IN_BLOCKS, sobol_key
from mc_engine.sampling.distributions import quantiles
from mc_engine.sampling.sobol import MAX_DIMENSIONS, scrambled_sobol
from mc_engine.sampling.streams import uniform_columns, uniforms
from mc_engine.suggestions import hint

if TYPE_CHECKING:
    from mc_engine.campaign.loading import Campaign

DESIGN = "pick_freeze"
_POINTS = ("a", "b", "c")
_CASES_OF = "cases of "  # and the name of the campaign before: the group of its cases
_NOISE = 2**50  # where no case of a run draws its noise


@dataclass(frozen=True)
class SensitivityDesign:
    """cases : base cases, one for each block.  groups : dispersions by group; each is in exactly one group."""

    cases: int
    groups: Mapping[str, tuple[str, ...]]

    @property
    def layout(self) -> BlockLayout:
        """The arrangement of the rows of a block."""
        repeated = (RANDOM_DRAWS,) if RANDOM_DRAWS in self.groups else ()
        held = repeated if self.groups.get(RANDOM_DRAWS) else ()  # noise made in flight has no nominal value
        return BlockLayout(tuple(self.groups), repeated, held)

    @property
    def flights(self) -> int:
        """How many cases the companion has."""
        return self.cases * self.layout.size


def check_sensitivity(
    section: SensitivitySection | None,
    model: System,
    dispersions: Sequence[Dispersion],
    faulty: frozenset[str],
    correlations: Sequence[Correlation],
    design: str | None,
    upstream: str | None,
    findings: Findings,
) -> SensitivityDesign | None:
    """The design that [sensitivity] asks for, None without one.

    faulty : dispersions with mistakes of their own.  upstream : name of the campaign flown before.
    """
    if section is None:
        return None
    if design in (*BY_LEVELS, *IN_BLOCKS) or (design == "table" and upstream is None):
        why = "has cases for the contributions itself" if design in IN_BLOCKS else "draws nothing from distributions"
        findings.add("", f'the design "{design}" {why}; [sensitivity] is for mc, lhs, sobol')
        return None
    problems = len(findings.problems)
    groups = dict(_groups(section, model, dispersions, faulty, correlations, findings.under("group")))
    if upstream is not None:
        groups = {_CASES_OF + upstream: (), **groups}
    chosen = SensitivityDesign(section.cases, groups)
    if not groups and not faulty:
        findings.add("", "there is no dispersion whose contribution could be computed")
    elif chosen.flights > MOST_CASES:
        findings.add(
            "cases", f"{section.cases} with {len(groups)} groups are {chosen.flights} flights; at most {MOST_CASES}"
        )
    return chosen if len(findings.problems) == problems else None


def _groups(
    section: SensitivitySection,
    model: System,
    dispersions: Sequence[Dispersion],
    faulty: frozenset[str],
    correlations: Sequence[Correlation],
    findings: Findings,
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Each group with its dispersions, in the order of the file; the random draws last."""
    names = [dispersion.name for dispersion in dispersions]
    draws = [name for name in names if names_a_draw(model, name)]
    chosen: dict[str, str] = {}  # the group that the file puts a dispersion in
    for group, members in section.group.items():
        _check_group(group, members, names, findings)
        for name in members:
            if name in faulty:
                continue
            if name not in names:
                findings.add(group, f'"{name}" is not dispersed{hint(name, names)}')
            elif name in draws:
                findings.add(group, f'"{name}" names a random draw; it is in the group "{RANDOM_DRAWS}"')
            elif name in chosen:
                findings.add(group, f'"{name}" is in the group "{chosen[name]}" already')
            else:
                chosen[name] = group
    home = {name: chosen.get(name, name) for name in names}  # the group of each dispersion
    for pair in correlations:  # inputs that are correlated have no contributions of their own
        first, second = home[pair.first], home[pair.second]
        joined = f"{first}, {second}" if first != second else first
        home = {name: joined if group in (first, second) else group for name, group in home.items()}
    for group in dict.fromkeys(home[name] for name in names if name not in draws):
        yield group, tuple(name for name in names if home[name] == group)
    if draws or (model.may_draw if isinstance(model, Simulator) else model.control is not None):
        yield RANDOM_DRAWS, tuple(draws)


def _check_group(group: str, members: Sequence[str], dispersed: Sequence[str], findings: Findings) -> None:
    """Note a name that the group cannot have, and a group without members.  Names may have blanks inside."""
    if (sentence := name_fault(group.replace(" ", "_"))) or group != group.strip():
        findings.add("", sentence or f'"{group}" begins or ends with a blank')
    elif group == RANDOM_DRAWS or group.startswith(_CASES_OF):
        findings.add(group, "is what the engine calls a group of its own; choose another name")
    elif group in dispersed and group not in members:
        findings.add(group, "is the name of a dispersion outside the group; choose another name")
    if not members:
        findings.add(group, "has no members; name dispersions, or leave the group out")


def names_a_draw(model: System, name: str) -> bool:
    """Whether an input only selects a random draw, as a seed does."""
    item = model.input(name)
    return isinstance(item, Parameter) and item.random_draw


def companion(campaign: "Campaign") -> "Campaign":
    """The campaign of the additional flights for `campaign`, which has a [sensitivity]."""
    assert campaign.sensitivity is not None  # the caller looked
    asked = "/".join((campaign.digest, DESIGN, *campaign.sensitivity.layout.held))
    digest = sha256(asked.encode()).hexdigest()
    retention = HistoriesSection(nominal=campaign.retention.nominal, rows=campaign.retention.rows)
    cases = campaign.sensitivity.flights
    return replace(campaign, design=DESIGN, cases=cases, digest=digest, retention=retention, looks=(), tuning=None)


def sensitivity_record(campaign: "Campaign") -> dict[str, Any]:
    """The record of the design in the manifest of a companion; its `cases` are those of the run it belongs to."""
    assert campaign.sensitivity is not None  # the caller looked
    chosen = campaign.sensitivity
    groups = [{"name": name, "members": list(members)} for name, members in chosen.groups.items()]
    layout = chosen.layout
    record = {"base_cases": chosen.cases, "groups": groups, "repeated": layout.repeated, "held": layout.held}
    return {**record, "design": campaign.design, "cases": campaign.cases}


def _blocks(campaign: "Campaign", case_ids: np.ndarray) -> tuple[BlockLayout, np.ndarray, np.ndarray]:
    assert campaign.sensitivity is not None  # a companion has one
    layout = campaign.sensitivity.layout
    block, row = np.divmod(np.asarray(case_ids, dtype=np.int64), layout.size)
    return layout, block, row


def companion_table(campaign: "Campaign", case_ids: np.ndarray) -> dict[str, np.ndarray]:
    """The dispersions of cases of a companion, in declared units.  case_ids : int64[n]."""
    layout, block, row = _blocks(campaign, case_ids)
    assert campaign.sensitivity is not None  # a companion has one
    names = [dispersion.name for dispersion in campaign.dispersions]
    pairs = rank_pairs(campaign.correlations)
    blocks, at = np.unique(block, return_inverse=True)  # the rows of a block share its points
    points = [_point_columns(campaign, names, pairs, k, blocks) for k in range(len(_POINTS))]
    table = {}
    for place, dispersion in enumerate(campaign.dispersions):
        group = next(name for name, members in campaign.sensitivity.groups.items() if dispersion.name in members)
        taken = layout.points(group)[row]
        u = np.choose(taken, [columns[place][at] for columns in points], mode="clip")
        assert dispersion.distribution is not None  # of a random design
        drawn, nominal = quantiles(dispersion.distribution, u), campaign.nominal[dispersion.name]
        table[dispersion.name] = np.where(taken == NOMINAL, nominal, drawn) if group in layout.held else drawn
    return table


def _point_columns(
    campaign: "Campaign", names: Sequence[str], pairs: tuple[tuple[str, str, float], ...], k: int, blocks: np.ndarray
) -> list[np.ndarray]:
    """Uniform numbers of the k-th point of each block, a column a dispersion, correlated as the campaign's.

    A and B are one point of a scrambled Sobol' sequence with twice the dimensions; C, and inputs that select a random
    draw, are random numbers.
    """
    streams = [f"{name}/{DESIGN} {_POINTS[k]}" for name in names]
    columns = list(uniform_columns(campaign.seed, streams, blocks))
    in_sequence = [
        place
        for place, name in enumerate(names)
        if k < 2 and 2 * place + k < MAX_DIMENSIONS and not names_a_draw(campaign.model, name)
    ]
    keys = [sobol_key(f"{campaign.seed}/{streams[place]}") for place in in_sequence]
    points = scrambled_sobol(keys, [2 * place + k for place in in_sequence], blocks)
    for place, column in zip(in_sequence, points, strict=True):
        columns[place] = column
    return correlated(gaussian_copula, columns, names, pairs)


def noise_ids(campaign: "Campaign", case_ids: np.ndarray) -> np.ndarray:
    """int64[n]: the addresses of the noise made in flight: for a run its cases, for a companion those of its points."""
    if campaign.design != DESIGN:
        return case_ids
    layout, block, row = _blocks(campaign, case_ids)
    point = layout.points(RANDOM_DRAWS)[row] if RANDOM_DRAWS in layout.groups else np.zeros_like(row)
    return _NOISE + len(_POINTS) * block + np.where(point == NOMINAL, A, point)


def upstream_ids(campaign: "Campaign", case_ids: np.ndarray) -> np.ndarray:
    """int64[n]: the upstream cases from which cases take inputs; for a companion they are drawn with replacement."""
    if campaign.design != DESIGN or campaign.upstream is None:
        return case_ids
    layout, block, row = _blocks(campaign, case_ids)
    points = layout.points(_CASES_OF + campaign.upstream.name)[row]
    draws = [uniforms(campaign.seed, f"upstream/{DESIGN} {point}", block) for point in _POINTS]
    return (np.choose(points, draws) * campaign.upstream.rows.n_cases).astype(np.int64)
