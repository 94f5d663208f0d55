"""Position and velocity with their covariance from CCSDS orbit messages: OPM and OEM in keyword notation (KVN).

The state and the 6x6 covariance are read, in the units of the standard, km and km/s.  XML, manoeuvres, and the
covariance of parameters beyond position and velocity are not supported.

CCSDS 502.0-B-3, Orbit Data Messages (2023), sections 3 (OPM), 5 (OEM) and 7 (KVN syntax).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from mc_engine.numbers_in_text import is_real

AXES = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
LOCAL = ("RTN", "TNW")
_ROTATING = ("ITRF", "GRC", "TDR")  # how the names of Earth-fixed frames begin; their velocities are relative
NO_EPOCH = "is not an epoch such as 2026-01-31T12:00:00"
_REPEATED = "MAN_"  # how the keywords of an OPM begin that each of its manoeuvres has again
_SAME = {"RSW": "RTN", "RIC": "RTN"}  # other names of the same axes
_ENTRIES = tuple((f"C{row}_{column}", i, j) for i, row in enumerate(AXES) for j, column in enumerate(AXES[: i + 1]))
_UNITS = {name: "km/s" if name.endswith("DOT") else "km" for name in AXES}  # of keywords, which may be written out
_UNITS |= {name: ("km**2", "km**2/s", "km**2/s**2")[(i > 2) + (j > 2)] for name, i, j in _ENTRIES}


class MessageFault(Exception):
    """An error in a message, as one sentence; the reader of the campaign file adds the location."""


@dataclass(frozen=True)
class UncertainState:
    """One epoch of a message.

    epoch : as the message writes it.  state : float64[6] of position and velocity [km, km/s] in `frame`, or None where
    an ephemeris has none at this epoch.  covariance : float64[6, 6] [km^2, km^2/s, km^2/s^2] in the axes of
    `covariance_frame`.
    """

    epoch: str
    frame: str
    state: np.ndarray | None
    covariance_frame: str
    covariance: np.ndarray

    def covariance_in(self, frame: str) -> np.ndarray:
        """The covariance in other axes: "RTN", "TNW", or the frame of the state itself.

        The local axes are taken as inertial, as they are at the epoch: position and velocity are rotated by the same
        matrix, without the rate of the axes.  MessageFault for any other frames, and for local axes without a state.
        """
        wanted = _plain_frame(frame)
        if wanted == self.covariance_frame:
            return self.covariance
        turn = self._axes(wanted) @ self._axes(self.covariance_frame).T
        both = np.kron(np.eye(2), turn)
        return both @ self.covariance @ both.T

    def _axes(self, frame: str) -> np.ndarray:
        """float64[3, 3]: rows are the axes of `frame` in the frame of the state."""
        if frame == self.frame:
            return np.eye(3)
        if frame not in LOCAL:
            raise MessageFault(
                f"axes {frame} cannot be had from a covariance in {self.covariance_frame} and a state in {self.frame}; "
                f"RTN, TNW and {self.frame} can"
            )
        if self.state is None:
            raise MessageFault(f"there is no state at {self.epoch} to lay the axes {frame} along")
        if self.frame.startswith(_ROTATING):
            raise MessageFault(
                f"the axes {frame} need an inertial velocity; that of the state is relative to {self.frame}, which "
                f"rotates with the Earth: give the state in an inertial frame"
            )
        r, v = self.state[:3], self.state[3:]
        normal = np.cross(r, v)
        if not np.linalg.norm(normal) > 0.0:
            raise MessageFault(f"the state at {self.epoch} is no orbit: position and velocity are parallel")
        first, last = (r if frame == "RTN" else v), normal / np.linalg.norm(normal)
        first = first / np.linalg.norm(first)
        return np.array([first, np.cross(last, first), last])


def read_message(text: str) -> list[UncertainState]:
    """Every covariance of an OPM or OEM, in the order of the text; MessageFault with the line if it is invalid."""
    lines = [(number, line.strip()) for number, line in enumerate(text.lstrip("\ufeff").splitlines(), start=1)]
    lines = [(number, line) for number, line in lines if line and not line.startswith("COMMENT")]
    first = lines[0][1].partition("=")[0].strip() if lines else ""
    if first == "CCSDS_OPM_VERS":
        return [_opm(lines)]
    if first == "CCSDS_OEM_VERS":
        states = list(_oem(lines))
        if not states:
            raise MessageFault("the ephemeris has no covariance (COVARIANCE_START)")
        return states
    raise MessageFault("is no orbit message: its first line is neither CCSDS_OPM_VERS = ... nor CCSDS_OEM_VERS = ...")


def _opm(lines: list[tuple[int, str]]) -> UncertainState:
    facts: dict[str, tuple[int, str]] = {}
    for number, line in lines:
        key, equals, value = (part.strip() for part in line.partition("="))
        if not equals:
            raise MessageFault(f'line {number}: "{line[:40]}" is not KEYWORD = value')
        if key in facts and not key.startswith(_REPEATED):
            raise MessageFault(f"line {number}: {key} is there already, in line {facts[key][0]}; leave one of them out")
        value, _, unit = value.removesuffix("]").partition("[")
        if unit and key in _UNITS and unit.replace(" ", "").replace("^", "**").lower() != _UNITS[key]:
            raise MessageFault(f"line {number}: {key} is in [{unit}]; the standard has it in [{_UNITS[key]}]")
        facts[key] = (number, value.rstrip())
    missing = [
        name for name in ("EPOCH", "REF_FRAME", *AXES, *(entry for entry, _, _ in _ENTRIES)) if name not in facts
    ]
    if missing:
        raise MessageFault(f"{missing[0]} is missing; a state and its covariance are needed")
    frame = _plain_frame(facts["REF_FRAME"][1])
    matrix = np.empty((6, 6))
    for name, i, j in _ENTRIES:
        matrix[i, j] = matrix[j, i] = _finite_number(*facts[name])
    state = np.array([_finite_number(*facts[name]) for name in AXES])
    of_matrix = _plain_frame(facts["COV_REF_FRAME"][1]) if "COV_REF_FRAME" in facts else frame
    return UncertainState(facts["EPOCH"][1], frame, state, of_matrix, matrix)


def _oem(lines: list[tuple[int, str]]) -> Iterator[UncertainState]:
    """Every covariance, with the state of its segment at the same epoch.

    Without a COV_REF_FRAME of its own, each covariance is in the frame of the segment.
    """
    frame, own, epoch = "", "", ""
    states: dict[datetime, np.ndarray] = {}
    inside = False
    rows: list[list[float]] = []
    for number, line in lines:
        key, equals, value = (part.strip() for part in line.partition("="))
        if line == "META_START":
            states = {}
        elif line in ("COVARIANCE_START", "COVARIANCE_STOP"):
            _check_rows(number, rows)
            inside, own, epoch, rows = line.endswith("START"), frame, "", []
        elif key == "REF_FRAME":
            frame = _plain_frame(value)
        elif inside and key == "COV_REF_FRAME":
            own = _plain_frame(value)
        elif inside and key == "EPOCH":
            _check_rows(number, rows)
            epoch, rows = value, []
        elif inside and not equals:
            if len(rows) == 6:
                raise MessageFault(f"line {number}: a seventh row; a covariance has six, the next begins with EPOCH")
            rows.append([_finite_number(number, word) for word in line.split()])
            if len(rows[-1]) != len(rows):
                raise MessageFault(f"line {number}: {len(rows[-1])} numbers; row {len(rows)} of a covariance has "
                                   f"{len(rows)}")  # fmt: skip
            if len(rows) == 6:
                lower = np.array([row + [0.0] * (6 - len(row)) for row in rows])
                matrix = lower + np.tril(lower, -1).T
                yield UncertainState(epoch, frame, states.get(_moment(number, epoch)), own, matrix)
                own = frame  # of the next one, which may name another, before or after its epoch
        elif not equals and len(line.split()) in (7, 10):
            when, *numbers = line.split()
            states[_moment(number, when)] = np.array([_finite_number(number, word) for word in numbers[:6]])
    _check_rows(lines[-1][0], rows)


def _check_rows(line: int, rows: list[list[float]]) -> None:
    """MessageFault where a covariance ends before its sixth row."""
    if len(rows) not in (0, 6):
        raise MessageFault(f"line {line}: the covariance before has {len(rows)} of its six rows; give all six")


def _plain_frame(name: str) -> str:
    return _SAME.get(name.strip().upper(), name.strip().upper())


def _finite_number(line: int, text: str) -> float:
    if not (is_real(text) and np.isfinite(value := float(text))):
        raise MessageFault(f'line {line}: "{text}" is not a finite number')
    return value


def _moment(line: int, text: str) -> datetime:
    """An epoch, for comparison within one message only; MessageFault with the line if it is none."""
    moment = moment_of(text)
    if moment is None:
        raise MessageFault(f'line {line}: "{text}" {NO_EPOCH}')
    return moment


def moment_of(text: str) -> datetime | None:
    """An epoch, calendar date or day of the year; None if the text is none."""
    plain = re.sub(r"(\.[0-9]{6})[0-9]+$", r"\1", text.rstrip("Z"))  # to the microsecond
    for form in ("%Y-%m-%dT%H:%M:%S.%f", "%Y-%m-%dT%H:%M:%S", "%Y-%jT%H:%M:%S.%f", "%Y-%jT%H:%M:%S"):
        try:
            return datetime.strptime(plain, form)
        except ValueError:
            continue
    return None
