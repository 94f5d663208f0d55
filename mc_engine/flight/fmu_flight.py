"""Flights of an FMU, through the package fmpy: one instance, which is reset between cases."""

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.model.fmu import CO_SIMULATION, Fmu
from mc_engine.model.simulator import Refuse

# what a variable of each type can hold
_WHOLE = {"Boolean": (0, 1), "Integer": (-(2**31), 2**31 - 1), "Enumeration": (-(2**31), 2**31 - 1)}
_WHOLE |= {f"Int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)}
_WHOLE |= {f"UInt{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)}


class FmuFlight:
    """Flies the cases of one process.

    home : folder in which the FMU is unpacked.  Raises ModelError where it cannot be loaded or gives no instance.
    """

    def __init__(self, fmu: Fmu, home: Path):
        import fmpy

        self._fmu, self._home = fmu, home
        self._instance: Any = None
        archive = io.BytesIO(fmu.content)
        try:
            fmpy.extract(archive, home)
            self._description = fmpy.read_model_description(str(home))
            self._types = {variable.name: variable.type for variable in self._description.modelVariables}
            self._instance = self._ready()
        except Exception as error:  # fmpy has errors of many kinds
            text = str(error).replace(str(archive), "the archive")
            raise ModelError(f"the FMU cannot be started: {text}") from None

    def fly(self, inputs: Mapping[str, Any], case: object) -> tuple[dict[str, float], dict[str, np.ndarray]]:
        """Metrics and history of one case.  Raises what fmpy does where the FMU reports an error."""
        import fmpy

        fmu = self._fmu
        metrics = [variable for variable, _, _ in fmu.metrics.values()]
        start = {variable: self._checked(name, inputs[name]) for name, variable in fmu.parameters.items()}
        instance = self._ready()  # after an error it is begun anew
        table = fmpy.simulate_fmu(
            str(self._home),
            start_time=0.0,
            stop_time=fmu.stop_time_s,
            step_size=fmu.step_s,
            output_interval=fmu.step_s,
            relative_tolerance=fmu.solver_tolerance,
            start_values=start,
            output=[*metrics, *fmu.outputs.values()],
            model_description=self._description,
            fmu_instance=instance,
        )
        self._instance = instance
        time = np.asarray(table["time"])
        history = {variable: np.asarray(table[variable], dtype=np.float64) for variable in table.dtype.names}
        results = {
            name: taken(time, history[variable], what, level) for name, (variable, what, level) in fmu.metrics.items()
        }
        return results, {"t_s": time, **{name: history[variable] for name, variable in fmu.outputs.items()}}

    def _checked(self, name: str, value: float) -> float:
        """The value of a parameter; Refuse for one that the type of its variable would change."""
        variable = self._fmu.parameters[name]
        kind = self._types[variable]
        low, high = _WHOLE.get(kind, (-math.inf, math.inf))
        if kind in _WHOLE and not (value == int(value) and low <= value <= high):
            raise Refuse(f'{name} is {value:.15g}, and "{variable}" is a whole number from {low} to {high} ({kind})')
        return value

    def _ready(self) -> Any:
        """The instance, as if no case had been flown; a new one where the FMU cannot be reset."""
        from fmpy.simulation import instantiate_fmu

        instance, self._instance = self._instance, None
        if instance is not None:
            try:
                instance.reset()
            except Exception:  # fmpy has errors of many kinds
                instance.freeInstance()
            else:
                return instance
        kind = "CoSimulation" if self._fmu.interface == CO_SIMULATION else "ModelExchange"
        return instantiate_fmu(str(self._home), self._description, kind)


def taken(time: np.ndarray, values: np.ndarray, what: str, level: float) -> float:
    """What is taken of the history of a variable.

    what : "final", "max", "min", "time_of_max", or "crossing": the first time at which the variable reaches the level
    or passes it, linear between two rows; NaN if it never does.  Extremes and their times are NaN if a value is NaN.
    """
    if what == "final":
        return float(values[-1])
    if what == "time_of_max":
        largest = np.argmax(values)  # of the first NaN, if there is one
        return float("nan") if np.isnan(values[largest]) else float(time[largest])
    if what != "crossing":
        return float(values.max() if what == "max" else values.min())
    side = np.sign(values - level)
    away = np.flatnonzero(side)
    if not away.size:
        return float("nan")
    later = np.flatnonzero(side[away[0] :] != side[away[0]])
    if not later.size:
        return float("nan")
    k = away[0] + later[0]
    part = (level - values[k - 1]) / (values[k] - values[k - 1])
    return float(time[k - 1] + part * (time[k] - time[k - 1]))
