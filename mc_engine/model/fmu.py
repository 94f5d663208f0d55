"""FMUs as simulators: the table [simulator] of a campaign file, checked against the FMU that it names.

FMI 2 and 3, co-simulation and model exchange, through the package fmpy.  All errors in the names of variables are found
here, before any flight and without running code of the FMU.
"""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from math import isclose
from pathlib import Path
from typing import Any

from mc_engine.extras import how_to_install
from mc_engine.model.program import (
    PROGRAM_KEYS,
    NumberSection,
    Origin,
    Problems,
    SimulatorSection,
    add_file,
    described_simulator,
    refuse_keys,
    refuse_names,
)
from mc_engine.model.simulator import Simulator
from mc_engine.suggestions import hint

CO_SIMULATION, MODEL_EXCHANGE = "co-simulation", "model-exchange"
MOST_STEPS = 10_000_000
_SOLVER_TOLERANCE = 1e-8
_NUMBERS = ("Real", "Integer", "Boolean", "Enumeration", "Float", "Int", "UInt")  # what types of variables begin with


@dataclass(frozen=True)
class Fmu:
    """How an FMU is flown.

    content : the file.  interface : CO_SIMULATION or MODEL_EXCHANGE.  step_s : between two rows of a history.
    parameters : variable by parameter.  metrics : (variable, what is taken of it, level) by metric.  outputs : variable
    by output.
    """

    content: bytes
    interface: str
    stop_time_s: float
    step_s: float
    solver_tolerance: float
    parameters: Mapping[str, str]
    metrics: Mapping[str, tuple[str, str, float]]
    outputs: Mapping[str, str]


def fmu_simulator(section: SimulatorSection, directory: Path, problems: Problems) -> Simulator | None:
    """The simulator that a campaign file describes, or None with the mistakes added to `problems` by key."""
    assert section.fmu is not None  # the caller looked
    if find_spec("fmpy") is None:
        problems.append(("fmu", f"needs a package that is missing: {how_to_install('fmu')}"))
        return None
    refuse_keys(section, PROGRAM_KEYS, "of a program; leave it out beside `fmu`", problems)
    contents: dict[Path, bytes] = {}
    add_file(section.fmu, "fmu", directory, contents, problems)
    content = next(iter(contents.values()), b"")
    description = _description(section.fmu, content, problems) if contents else None
    if description is None or problems:
        return None
    variables = {variable.name: variable for variable in description.modelVariables}
    parameters = {name: _bound(f"parameter.{name}", name, entry, variables, problems)
                  for name, entry in section.parameter.items()}  # fmt: skip
    for name, variable in parameters.items():
        if not problems and not _is_settable(variables[variable]):
            problems.append((f"parameter.{name}", f'"{variable}" is computed by the FMU, and cannot be set'))
    metrics = {name: _taken(name, entry, variables, problems) for name, entry in section.metric.items()}
    outputs = {
        name: _bound(f"output.{name}", name, entry, variables, problems) for name, entry in section.output.items()
    }
    interface = _interface(section, description, problems)
    refuse_names(section, problems)
    stop, step = _times(section, description, interface, problems)
    tolerance = section.solver_tolerance or _experiment(description, "tolerance") or _SOLVER_TOLERANCE
    if problems:
        return None
    fmu = Fmu(content, interface, stop, step, tolerance, parameters, metrics, outputs)
    return described_simulator(
        section, section.fmu, Path(section.fmu).stem, Origin(directory, contents), problems, fmu=fmu
    )


def _description(name: str, content: bytes, problems: Problems) -> Any:
    """The model description; None with what is wrong with the file noted."""
    import fmpy

    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            names = archive.namelist()
        description = fmpy.read_model_description(io.BytesIO(content))
    except Exception as error:  # fmpy has errors of many kinds
        problems.append(("fmu", f'"{name}" is no FMU that can be read: {" ".join(str(error).split())[:300]}'))
        return None
    if not description.fmiVersion.startswith(("2.", "3.")):
        problems.append(("fmu", f'"{name}" is of FMI {description.fmiVersion}; FMI 2 and 3 can be flown'))
        return None
    built = sorted({entry.split("/")[1] for entry in names if entry.startswith("binaries/") and entry.count("/") > 1})
    here = fmpy.platform if description.fmiVersion.startswith("2.") else fmpy.platform_tuple
    if here not in built:
        on = f"is built for {', '.join(built)}" if built else "has no binaries"
        problems.append(("fmu", f'"{name}" {on}, and this machine is {here}; export it for this one'))
        return None
    return description


def _bound(key: str, name: str, section: NumberSection, variables: Mapping[str, Any], problems: Problems) -> str:
    """The variable of a number, a scalar one."""
    wanted = section.variable or name
    if wanted not in variables:
        near = hint(wanted, variables)
        problems.append((f"{key}.variable", f'the FMU has no variable "{wanted}"{near}'))
    elif variables[wanted].shape or variables[wanted].dimensions:
        problems.append((f"{key}.variable", f'"{wanted}" is an array, and must be one number'))
    elif not variables[wanted].type.startswith(_NUMBERS):
        problems.append((f"{key}.variable", f'"{wanted}" is a {variables[wanted].type}, and no number'))
    return wanted


def _is_settable(variable: Any) -> bool:
    from fmpy.simulation import settable_in_initialization_mode, settable_in_instantiated

    return bool(settable_in_instantiated(variable) or settable_in_initialization_mode(variable))


def _taken(name: str, section: Any, variables: Mapping[str, Any], problems: Problems) -> tuple[str, str, float]:
    take = section.take or "final"
    if take == "crossing" and section.level is None:
        problems.append((f"metric.{name}", "is a crossing; give the `level`"))
    if take != "crossing" and section.level is not None:
        problems.append((f"metric.{name}.level", f'is of a crossing, and `take` is "{take}"'))
    return _bound(f"metric.{name}", name, section, variables, problems), take, section.level or 0.0


def _interface(section: SimulatorSection, description: Any, problems: Problems) -> str:
    has = {CO_SIMULATION: description.coSimulation, MODEL_EXCHANGE: description.modelExchange}
    built = [name for name, there in has.items() if there is not None]
    if not built or section.interface not in (None, *built):
        problems.append(("interface", f"the FMU has {' and '.join(built) or 'neither of the two'}"))
    return section.interface or next(iter(built), CO_SIMULATION)


def _times(section: SimulatorSection, description: Any, interface: str, problems: Problems) -> tuple[float, float]:
    """(end of the flight, step between two rows), by default of the FMU's own experiment."""
    stop = section.stop_time_s or _experiment(description, "stopTime")
    if stop is None:
        problems.append(("stop_time_s", "is missing, and the FMU proposes none"))
        return 1.0, 1.0
    if section.stop_time_s is None and (start := _experiment(description, "startTime")):
        message = f"is missing; the FMU proposes {start:g} to {stop:g} s, and a flight begins at 0 s"
        problems.append(("stop_time_s", message))
    step = section.step_s or _experiment(description, "stepSize") or stop / 1000.0
    if not step <= stop <= MOST_STEPS * step:
        problems.append(
            ("step_s", f"{step:g} must be at most {stop:g}, the end, and give {MOST_STEPS:,} steps at most")
        )
    elif interface == CO_SIMULATION and not isclose((steps := round(stop / step)) * step, stop, rel_tol=1e-9):
        cosimulation = description.coSimulation
        if cosimulation is not None and not cosimulation.canHandleVariableCommunicationStepSize:
            better = f"{stop / steps:.12g} s would fit"
            problems.append(
                ("step_s", f"the FMU takes steps of one length, and {step:g} s do not divide {stop:g} s; {better}")
            )
    return stop, step


def _experiment(description: Any, name: str) -> float | None:
    value = getattr(description.defaultExperiment, name, None)
    return None if value is None else float(value)
