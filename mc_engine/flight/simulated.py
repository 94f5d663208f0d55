"""The `Flyer` of simulators: each worker has its cases flown in a process of its own."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import Campaign
from mc_engine.errors import ModelError
from mc_engine.flight.case_process import CaseEnded, CaseProcess, give_back, take
from mc_engine.flight.case_worker import Order, Setup, folder_name, settle
from mc_engine.flight.flyer import (
    NOMINAL_NOISE,
    Columns,
    Copies,
    Flyer,
    Inputs,
    Process,
    RunStopped,
    never,
    other_bits,
    refused_among_first,
)
from mc_engine.flight.program_flight import Flown, flown
from mc_engine.model.fields import Setting, inputs_of
from mc_engine.model.record import Refusals
from mc_engine.model.simulator import Simulator
from mc_engine.numbers_in_text import counted
from mc_engine.safe_path import safe_environment
from mc_engine.status import NOT_FINITE, OK, REFUSED, STATUS_NAME
from mc_engine.store.case_rows import Row, RowLog

_FEW_MINUTES = 360.0  # s, a tenth of an hour
_TOGETHER = 64  # cases of a batch, where one may end the worker of all
_TRIED, _ALIKE = 4, 1e-6  # cases of the batch that `check` flies; relative difference that rounding may make


def about(number: float, unit: str) -> str:
    """The number with two digits, without an exponent up to a million: 120 s."""
    return f"{float(f'{number:.2g}'):g} {unit}"


class SimulatorFlyer(Flyer):
    """A Python function, a program or an FMU."""

    def __init__(self, campaign: Campaign):
        assert isinstance(campaign.model, Simulator)  # the caller looked
        self._campaign, self.simulator = campaign, campaign.model
        self.keeps_rows = not self.simulator.batch  # a batch is one piece of work, as a chunk of a model is
        self.batch = _TOGETHER if self.simulator.batch else 1
        if self.keeps_rows:
            self.smallest_chunk = 1  # its cases may take long: no worker waits while others have cases left
        self.most_workers = self.simulator.slots
        self.tolerance = None if self.simulator.deterministic else self.simulator.tolerance
        self._names = [metric.name for metric in self.simulator.metrics]
        described = campaign.text if self.simulator.is_described else ""  # its table, which the digest leaves out
        around = frozenset(safe_environment().items())  # a process keeps the environment that it was started in
        self._key = (self.simulator.reference, str(campaign.directory), self.digest(), campaign.seed, described, around)

    def fly(
        self,
        inputs: Inputs,
        noise: np.ndarray,
        log: RowLog | None = None,
        keep: Path | None = None,
        stopped: Callable[[], bool] = never,
    ) -> Columns:
        flight = _Flight(self, inputs, noise, keep, stopped, log)
        flight.fly()
        return flight.results

    def refusals(self, inputs: Inputs, n: int) -> list[str]:
        """Why each case cannot be flown whose inputs are outside what the simulator accepts; else empty."""
        refusals = Refusals.none(n)
        for item in inputs_of(self.simulator).values():
            if isinstance(item, Setting) and (item.choices or item.date or isinstance(item.default, bool)):
                continue
            column = np.broadcast_to(np.asarray(inputs[item.name]), n)
            refusals.add(np.isnan(column), f"{item.name} is not a number")
            refusals.add(np.isinf(column), f"{item.name} is infinite")
            outside = f"{item.name} is outside {item.low:g} to {item.high:g} {item.unit}".rstrip()
            refusals.add(~((column >= item.low) & (column <= item.high)), outside)
        return list(refusals.reason)

    def histories(
        self, inputs: Inputs, noise: np.ndarray, rows: int, stopped: Callable[[], bool] = never
    ) -> Iterator[tuple[Columns, Columns]]:
        columns = {name: np.broadcast_to(np.asarray(value), len(noise)) for name, value in inputs.items()}
        for case in range(len(noise)):
            own = {name: column[[case]] for name, column in columns.items()}
            yield self._history(own, noise[[case]], rows, stopped)

    def _history(
        self, columns: Columns, noise: np.ndarray, rows: int, stopped: Callable[[], bool]
    ) -> tuple[Columns, Columns]:
        found: list[Columns] = []
        flight = _Flight(self, columns, noise, None, stopped, on_history=found.append)
        flight.fly()
        names = ["t_s", *(output.name for output in self.simulator.outputs)]
        history = found[0] if found and found[0] else {name: np.empty(0) for name in names}
        every = max(1, -(-len(history["t_s"]) // rows))
        chosen = np.arange(len(history["t_s"]))
        chosen = chosen[(chosen % every == 0) | (chosen == len(chosen) - 1)]
        return flight.results, {name: values[chosen] for name, values in history.items()}

    def digest(self) -> str:
        return self.simulator.digest()

    def make_ready(self) -> None:
        """Nothing: each worker starts a process of its own."""

    def start(self) -> None:
        self.give_back(self.process())

    def faults(self) -> list[str]:
        if self.simulator.fly is None and not self.simulator.is_described:
            why = "has no function `fly`, no command and no FMU; `mc-engine import` reads results from elsewhere"
            return [f"{self.simulator.reference}: {why}"]
        return []  # all else that is wrong with a simulator is found where it is loaded

    def refuse_faults(self) -> None:
        for sentence in self.faults():
            raise ModelError(sentence)

    def faults_in_flight(self, process: Process) -> list[str]:
        row = self._flown(np.array([NOMINAL_NOISE]), {})[0]
        if row["status"] == STATUS_NAME[OK]:
            return []
        return [f"the nominal case ends as {row['status']}: {row['reason']}"]

    def _flown(self, noise: np.ndarray, table: Columns) -> list[Row]:
        columns = self.fly(full_inputs(self._campaign, table), noise)
        return [{name: column[k] for name, column in columns.items()} for k in range(len(noise))]

    def second_look(self, copies_of: Copies) -> tuple[list[str], list[str]]:
        """Whether it is deterministic as declared; metrics that no input moves, seconds a case, hours for the campaign.

        The nominal and one dispersed case are flown in two processes, which differ in what was flown before; in the
        second one from the copies, as `replay` and `extend` do.
        """
        ids = np.array([0])
        table = {} if self._campaign.first is not None else case_table(self._campaign, ids)
        nominal = np.array([NOMINAL_NOISE])
        histories: list[Columns] = []
        flight = _Flight(self, self._campaign.nominal, nominal, None, never, on_history=histories.append)
        flight.fly()  # starts the process
        begin = time.perf_counter()
        first, dispersed = self._flown(nominal, {})[0], self._flown(ids, table)[0]
        seconds = (time.perf_counter() - begin) / 2
        self.process().end()  # before another starts, which may need its licence
        with nullcontext() if self.simulator.is_described else copies_of(self._campaign) as copies:
            again = self if copies is None else SimulatorFlyer(replace(self._campaign, directory=copies))
            dispersed_again, first_again = again._flown(ids, table)[0], again._flown(nominal, {})[0]
        if again is not self and first["status"] == STATUS_NAME[OK] != first_again["status"]:
            why = str(first_again["reason"]).replace(f"{copies}{os.sep}", "")
            return [f"from the copies of its files that a run keeps, as `replay` and `extend` fly it, the nominal case "
                    f"ends as {first_again['status']}: {why}; name files that it reads in `data`"], []  # fmt: skip
        pairs = (first, first_again), (dispersed, dispersed_again)
        other = [name for name in self._names if any(other_bits(a[name], b[name]) for a, b in pairs)]
        beyond = [name for name in other if any(self.differs(a[name], b[name]) for a, b in pairs)]
        faults = self._not_as_declared(beyond)
        lines = ["deterministic: two flights of two cases, in two processes, give the same bits"]
        if other:
            lines = [f"not deterministic, as declared: {', '.join(other)} differ between two flights of a case"]
        still = [name for name in self._names if first[name] == dispersed[name]]
        moved = any(column[0] != self._campaign.nominal[name] for name, column in table.items())
        if moved and still and dispersed["status"] == first["status"] == STATUS_NAME[OK]:
            lines.append(f"the same in the nominal and in case 0: {', '.join(still)}; does an input move it?")
        if self.simulator.batch:
            faults += self._of_a_batch()
        if dispersed["status"] != STATUS_NAME[OK]:
            lines.append(f"case 0 ends as {dispersed['status']}: {dispersed['reason']}")
        lines += refused_among_first(self._campaign, self.refusals)
        if flight.left_out:
            lines.append(f"not saved, as no declared outputs: the columns {', '.join(flight.left_out)} of the history")
        if self.simulator.outputs and not any(histories):
            lines.append("no time histories are saved, because the nominal case gives none of its declared outputs")
        asked = self._campaign.retention
        if not self.simulator.outputs and (asked.first or asked.cases or asked.worst_of):
            lines.append("no time histories are saved, because the simulator declares no outputs")
        return faults, [*lines, self._duration(seconds)]

    def _duration(self, seconds: float) -> str:
        """How long a case takes, and the campaign on this machine."""
        cores = os.cpu_count() or 1
        workers = min(cores, self.most_workers or cores)
        whole = seconds * -(-self._campaign.cases // workers)  # a worker flies a case alone
        takes = about(whole / 3600.0, "hours") if whole > _FEW_MINUTES else about(whole, "s")
        cases = counted(self._campaign.cases, "case")
        return f"{seconds:.3g} s a case, {takes} for {cases} on {counted(workers, 'worker')}"

    def _not_as_declared(self, metrics: list[str]) -> list[str]:
        """One sentence if metrics differ between two flights of a case, and may not."""
        fix = "draw from case.rng or case.seed, and keep nothing from one case to the next"
        if not self.simulator.fly:
            fix = "seed it by {seed}"
        by, rest = "", "or `replay` finds other bits; where they differ by rounding alone, set deterministic to false, "
        rest += "and a tolerance"
        if not self.simulator.deterministic:
            by, rest = f" by more than the tolerance of {self.simulator.tolerance:g}", "or set a larger one"
        who = f"{', '.join(metrics)} differ between two flights of a case{by}"
        return [f"not deterministic: {who}; {fix}, {rest}"] if metrics else []

    def _of_a_batch(self) -> Iterator[str]:
        """One sentence if some cases have other results in a batch than each alone, or it fails as a whole."""
        ids = np.arange(min(_TRIED, self._campaign.cases))
        table = {} if self._campaign.first is not None else case_table(self._campaign, ids)
        flight = _Flight(self, full_inputs(self._campaign, table), ids, None, never)
        flight.fly()
        rows = [{name: column[[k]] for name, column in flight.columns.items()} for k in range(len(ids))]
        alone = [self.fly(row, ids[[k]]) for k, row in enumerate(rows)]
        well = all(row["status"][0] == STATUS_NAME[OK] for row in alone)
        if flight.split and well:
            yield f"a batch of {len(ids)} fails, each of its cases alone does not: {flight.split}"
        differing = [
            name
            for name in self._names
            if not np.allclose(flight.results[name], [row[name][0] for row in alone], _ALIKE, 0.0, equal_nan=True)
        ]
        if differing:
            yield (
                f"not independent: {', '.join(differing)} differ between a batch of {len(ids)} and its cases flown "
                "alone; return one number a case, in the order of the inputs, with nothing that cases share"
            )

    def process(self, stopped: Callable[[], bool] = never) -> CaseProcess:
        """A process of this simulator, from those that wait or new."""
        return take(self._key, self._setup, stopped)

    def give_back(self, process: CaseProcess) -> None:
        give_back(self._key, process)

    def _setup(self) -> Setup:
        simulator, folder = self.simulator, str(self._campaign.directory)
        sent = replace(simulator, sources=None, figures=(), published=()) if simulator.is_described else None
        of_program = simulator.program is not None  # which is limited itself, and not what starts it
        memory = None if of_program else simulator.memory_limit_mib
        return Setup(simulator.reference, folder, self._key[2], self._campaign.seed, sent, memory)


class _Flight:
    """The cases of one call.

    columns : their inputs, a value for each case.  results : their columns, filled as cases end.
    left_out : columns of the last history.  split : why the first batch failed that was flown again by halves, or empty
    """

    def __init__(
        self,
        flyer: SimulatorFlyer,
        inputs: Inputs,
        noise: np.ndarray,
        keep: Path | None,
        stopped: Callable[[], bool],
        log: RowLog | None = None,
        on_history: Callable[[Columns], None] | None = None,
    ):
        self._flyer, self._noise = flyer, noise
        self.columns: Columns = {name: np.broadcast_to(np.asarray(value), len(noise)) for name, value in inputs.items()}
        self._keep, self._stopped, self._log, self._on_history = keep, stopped, log, on_history
        self.left_out: tuple[str, ...] = ()
        self.split = ""
        simulator = flyer.simulator
        self._limit_s = simulator.time_limit_s if simulator.program is None else None  # which keeps its own
        n, self._names = len(noise), [metric.name for metric in simulator.metrics]
        self.results: Columns = {name: np.full(n, "", dtype=object) for name in ("status", "reason")}
        self.results |= {metric.name: np.full(n, np.nan) for metric in simulator.metrics}

    def fly(self) -> None:
        """Fly all cases whose inputs are inside what the simulator accepts."""
        reasons = self._flyer.refusals(self.columns, len(self._noise))
        for place, reason in enumerate(reasons):
            if reason:
                self._put(place, Flown(REFUSED, reason, {}, {}))
        able = [place for place, reason in enumerate(reasons) if not reason]
        if self._flyer.simulator.batch:
            self.fly_together(able)
        else:
            self.fly_in_turn(able)

    def _put(self, place: int, flown: Flown) -> None:
        for name, value in flown.row(self._names).items():
            self.results[name][place] = value

    def fly_in_turn(self, places: list[int]) -> None:
        """Cases one after another; one that ends the process costs itself."""
        left = list(places)
        while left:
            if self._stopped():
                raise RunStopped
            process = self._flyer.process(self._stopped)
            try:
                for reply in process.replies(self._order(left), len(left), self._limit_s, self._stopped):
                    self._take(left.pop(0), reply)
            except CaseEnded as end:
                self._record_ended(left.pop(0), end, process)
            except BaseException:
                process.end()
                raise
            else:
                self._flyer.give_back(process)

    def fly_together(self, places: list[int]) -> None:
        """Cases as one batch; where it fails as a whole, by halves, until the case is found."""
        if not places:
            return
        process = self._flyer.process(self._stopped)
        limit = None if self._limit_s is None else self._limit_s * len(places)
        try:
            reply = next(process.replies(self._order(places), 1, limit, self._stopped))
        except CaseEnded as end:
            if len(places) == 1:
                self._record_ended(places[0], end, process)
                return
            process.end()
            reply = flown(end.status, end.reason)
        except BaseException:
            process.end()
            raise
        else:
            self._flyer.give_back(process)
        if isinstance(reply, Flown) and len(places) == 1:
            self._take(places[0], reply)
        elif isinstance(reply, Flown):
            self.split = self.split or reply.reason
            half = len(places) // 2
            self.fly_together(places[:half])
            self.fly_together(places[half:])
        else:
            self._take_batch(places, *reply)

    def _take_batch(self, places: list[int], metrics: Columns, shared: Flown) -> None:
        lost = np.zeros(len(places), dtype=bool)
        for metric in self._flyer.simulator.metrics:
            column = metrics[metric.name]
            lost |= np.isinf(column) if metric.sometimes else ~np.isfinite(column)
        well = np.array(places)[~lost]
        self.results["status"][well] = STATUS_NAME[OK]
        for name, column in metrics.items():
            self.results[name][well] = column[~lost]
        for k in np.flatnonzero(lost).tolist():
            values = {name: float(column[k]) for name, column in metrics.items()}
            self._put(places[k], Flown(NOT_FINITE, self._flyer.simulator.lost_metric(values), {}, {}))
        self.left_out = shared.left_out
        if self._on_history is not None:
            self._on_history(shared.history)

    def _take(self, place: int, reply: Flown) -> None:
        self._put(place, reply)
        self.left_out = reply.left_out
        if self._on_history is not None:
            self._on_history(reply.history)

    def _record_ended(self, place: int, end: CaseEnded, process: CaseProcess) -> None:
        """Record a case that ended its process, and keep what it left behind."""
        if self._stopped() or not threading.main_thread().is_alive():  # ended with the engine, not by the case
            process.end()
            raise RunStopped
        noise, rule = int(self._noise[place]), self._flyer.simulator.keep
        inputs = {name: column[[place]].tolist()[0] for name, column in self.columns.items()}
        process.end(lambda work: settle(rule, work, folder_name(noise), -1, self._keep, inputs))
        ended = flown(end.status, end.reason)
        self._put(place, ended)
        if self._log is not None:
            log = self._log.at([place])
            log.add(0, ended.row(self._names))
            log.close()

    def _order(self, places: list[int]) -> Order:
        columns = {name: column[places] for name, column in self.columns.items()}
        keep = None if self._keep is None else str(self._keep.absolute())  # cases may change their folder
        log = None if self._log is None else self._log.at(places)
        return Order(columns, self._noise[places], self._on_history is not None, keep, log)
