"""Covariances of a campaign file: [covariance.NAME] stands for six normal dispersions and their correlations.

The six parameters have the covariance of an orbit message.  For normal deviates the copula with the rank correlation
6 / pi asin(rho / 2) has the linear correlation rho (Pearson 1907, see `mc_engine.sampling.correlation`), so the samples
have the covariance of the message.
"""

from collections.abc import Iterator
from itertools import combinations
from math import asin, pi
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.campaign.orbit_messages import AXES, NO_EPOCH, MessageFault, UncertainState, moment_of, read_message
from mc_engine.campaign.reading import Findings, read, shown
from mc_engine.campaign.sections import CovarianceSection
from mc_engine.model.files import FileFault, open_beside, resolve_beside
from mc_engine.sampling.designs import RANDOM
from mc_engine.suggestions import listed

_MOST_OF_MESSAGE = 2**26  # bytes
_WITHOUT_NORMALS = ("grid", "table")  # designs whose values come from levels or a file
_UNITS = ("km", "km", "km", "km/s", "km/s", "km/s")
_LEAST_EIGENVALUE = 1e-8  # of the matrix of correlations: below it, it is singular for the digits of a message


def spread_covariances(
    document: dict[str, Any], directory: Path, design: str | None, findings: Findings
) -> tuple[str, ...]:
    """Put the dispersions and correlations of every [covariance.NAME] into the document.

    design : that of the campaign, None where it is unknown.
    Returns the files that were read, by their names in `directory`.
    """
    written = document.get("covariance", {})
    if not isinstance(written, dict):
        findings.add("covariance", f"{shown(written)} is not a table; write [covariance.NAME]")
        return ()
    files = []
    for name, raw in written.items():
        section_findings = findings.under("covariance", name)
        section = read(CovarianceSection, raw, section_findings)
        if section is None:
            continue
        files.append(section.file)
        matrix = _matrix(section, directory, section_findings)
        if matrix is not None:
            _add_dispersions(document, section, matrix, design, section_findings)
    return tuple(files)


def _matrix(section: CovarianceSection, directory: Path, findings: Findings) -> np.ndarray | None:
    """The covariance in the axes asked for, or None with what is wrong noted."""
    if section.epoch is not None and moment_of(section.epoch) is None:
        findings.add("epoch", f"{shown(section.epoch)} {NO_EPOCH}")
        return None
    try:
        with open_beside(resolve_beside(directory, section.file), _MOST_OF_MESSAGE) as file:
            text = file.read().decode()
        matrix = _chosen(read_message(text), section).covariance_in(section.frame)
    except (FileFault, MessageFault, UnicodeDecodeError) as fault:
        about = str(fault) if isinstance(fault, FileFault) else f'"{section.file}": {fault}'
        findings.add("file", about)
        return None
    variances = np.diag(matrix)
    if not (variances > 0.0).all():
        axis = AXES[int(np.flatnonzero(~(variances > 0.0))[0])]
        findings.add(
            "file", f'"{section.file}": the variance of {axis} is not above 0; six parameters need six spreads'
        )
        return None
    sigma = np.sqrt(variances)
    if np.linalg.eigvalsh(matrix / np.outer(sigma, sigma))[0] <= _LEAST_EIGENVALUE:
        findings.add("file", f'"{section.file}": the covariance is not positive definite')
        return None
    return np.asarray(matrix)


def _chosen(states: list[UncertainState], section: CovarianceSection) -> UncertainState:
    """The covariance at the epoch asked for; where there is but one, it needs none."""
    if section.epoch is None:
        if len(states) > 1:
            raise MessageFault(f'has {len(states)} covariances; say which with epoch = "{states[0].epoch}"')
        return states[0]
    chosen = [state for state in states if moment_of(state.epoch) == moment_of(section.epoch)]
    if not chosen:
        raise MessageFault(
            f"has no covariance at {section.epoch}; it has {', '.join(state.epoch for state in states[:5])}"
        )
    if len(chosen) > 1:
        raise MessageFault(f"has {len(chosen)} covariances at {section.epoch}; leave only one of them in the file")
    return chosen[0]


def _add_dispersions(
    document: dict[str, Any], section: CovarianceSection, matrix: np.ndarray, design: str | None, findings: Findings
) -> None:
    dispersions, correlations = document.setdefault("dispersion", {}), document.setdefault("correlation", [])
    if not isinstance(dispersions, dict) or not isinstance(correlations, list):
        return  # which the reader of those sections says
    source = section.source or f"{section.file}, {section.frame} axes"
    ranks = list(_rank_correlations(section.parameters, matrix, source))
    if design in _WITHOUT_NORMALS or (ranks and design not in (None, *RANDOM)):
        findings.add("", f'the design "{design}" takes no covariance; covariances are for {listed(RANDOM)}')
        ranks = []
    if design in _WITHOUT_NORMALS:
        return
    for name, sigma, unit in zip(section.parameters, np.sqrt(np.diag(matrix)), _UNITS, strict=True):
        if name in dispersions:
            findings.add("parameters", f'"{name}" has a dispersion already; leave one of the two out')
            continue
        dispersions[name] = {"dist": "normal", "sigma": float(sigma), "unit": unit, "source": source}
    correlations.extend(ranks)


def _rank_correlations(names: list[str], matrix: np.ndarray, source: str) -> Iterator[dict[str, Any]]:
    sigma = np.sqrt(np.diag(matrix))
    for i, j in combinations(range(len(names)), 2):
        if matrix[i, j] != 0.0:
            rank = 6.0 / pi * asin(0.5 * float(matrix[i, j] / (sigma[i] * sigma[j])))
            yield {"between": [names[i], names[j]], "rank": rank, "source": source}
