"""The file of the design "table": one row for each case, one column for each dispersed parameter.

Every problem is noted with file, row and column; nothing is raised.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mc_engine.campaign.dispersions import Dispersion
from mc_engine.campaign.inputs import accepted_range, check_value, number, within_rounding
from mc_engine.campaign.reading import Findings
from mc_engine.campaign.sections import CampaignSection
from mc_engine.campaign.tables_beside import numbers, read_columns, switches, words
from mc_engine.model.fields import Parameter, Setting, inputs_of
from mc_engine.model.files import FileFault, resolve_beside
from mc_engine.model.simulator import System
from mc_engine.suggestions import hint
from mc_engine.units import compatible, convert

_CASE_ID = "case_id"  # `mc-engine sample` writes it; here it may only count the rows


def cases_of_table(
    section: CampaignSection | None,
    model: System,
    dispersions: tuple[Dispersion, ...],
    directory: Path,
    findings: Findings,
) -> tuple[Path | None, dict[str, np.ndarray]]:
    """(path, columns) of the file that `table` names; (None, {}) for any other design, and where the file is wrong."""
    section_findings = findings.under("campaign", "table")
    if section is None or (section.design != "table" and section.table is None):
        return None, {}
    if section.design != "table":
        section_findings.add("", f'the design "{section.design}" reads no table; it is for design = "table"')
    elif section.table is None:
        section_findings.add("", "is missing: CSV or Parquet beside this file, a case a row")
    else:
        try:
            path = resolve_beside(directory, section.table)
            units = {
                dispersion.name: dispersion.spec["unit"] for dispersion in dispersions if "unit" in dispersion.spec
            }
            return path, read_case_table(path, model, units, section_findings)
        except FileFault as fault:
            section_findings.add("", str(fault))
    return None, {}


def read_case_table(path: Path, model: System, units: Mapping[str, str], findings: Findings) -> dict[str, np.ndarray]:
    """Column name -> values in declared units: float64[n], object[n] of words, or bool[n].

    units : of the columns that are not in their parameter's own unit.
    """
    items = inputs_of(model)
    table: dict[str, np.ndarray] = {}
    try:
        columns = read_columns(path)
    except FileFault as fault:
        findings.add("", str(fault))
        return table
    for name, cells in columns.items():
        try:
            if name == _CASE_ID:
                _check_case_ids(path, cells)
            elif name in items:
                table[name] = _checked_values(path, items[name], cells, units.get(name))
            else:
                findings.add("", f'the column "{name}" is not a parameter of {model.name}{hint(name, items)}')
        except FileFault as fault:
            findings.add("", str(fault))
            if name in items:  # the column is there; its cells are of no use
                table[name] = np.full(len(cells), np.nan)
    if table and not len(next(iter(table.values()))):
        findings.add("", f'"{path.name}" has no rows below its first line')
    elif not table and not findings.problems:
        findings.add("", f'"{path.name}" has no column of a parameter')
    return table


def _check_case_ids(path: Path, cells: np.ndarray) -> None:
    ids = numbers(path, _CASE_ID, cells)
    wrong = np.flatnonzero(ids != np.arange(len(ids)))
    if wrong.size:
        row = wrong[0]
        raise FileFault(f'"{path.name}", row {row + 1}: case_id is {number(ids[row])}; rows are numbered 0, 1, 2, ...')


def _checked_values(path: Path, item: Parameter | Setting, cells: np.ndarray, unit: str | None) -> np.ndarray:
    if isinstance(item, Setting) and item.choices:
        return words(path, item.name, cells, item.choices)
    if isinstance(item, Setting) and isinstance(item.default, bool):
        return switches(path, item.name, cells)
    if isinstance(item, Setting) and item.date:
        return _dates(path, item, cells)
    values = numbers(path, item.name, cells)
    if unit is not None:
        if unit not in compatible(item.unit):
            return values  # noted with the dispersion; without a unit they have no range
        values = convert(values, unit, item.unit)
        outside = (values < item.low) | (values > item.high)
        values[outside] = [within_rounding(value, item) for value in values[outside].tolist()]
    faults = {f"is not within {accepted_range(item)}": ~((values >= item.low) & (values <= item.high))}
    if isinstance(item, Setting) and item.whole:
        faults["is not a whole number"] = values != np.trunc(values)
    for fault, wrong in faults.items():
        if wrong.any():
            row = int(np.argmax(wrong))
            raise FileFault(f'"{path.name}", row {row + 1}, column "{item.name}": {number(values[row])} {fault}')
    return values


def _dates(path: Path, item: Setting, cells: np.ndarray) -> np.ndarray:
    """object[n]: the cells as dates of the setting."""
    findings = Findings()
    dates = [check_value(str(cell), item, findings, "") for cell in cells]
    if findings.problems:
        row = dates.index(None)
        raise FileFault(f'"{path.name}", row {row + 1}, column "{item.name}": {findings.problems[0].message}')
    return np.array(dates, dtype=object)


def table_dispersions(
    table: Mapping[str, np.ndarray], dispersions: tuple[Dispersion, ...], findings: Findings
) -> tuple[Dispersion, ...]:
    """One dispersion per column, with the source that the campaign file gives it; none where the table is wrong."""
    declared = {dispersion.name: dispersion for dispersion in dispersions}
    for name in declared if table else ():
        if name not in table:
            findings.under("dispersion").add(name, f"the table has no such column{hint(name, table)}")
    return tuple(declared.get(name, Dispersion(name, None, {}, "", "")) for name in table)
