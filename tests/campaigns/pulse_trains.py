"""Pulses of a modulator under a constant command in closed form, against which the flown ones are held.

The standard form, with one gain on command and output.  M. J. Sidi, Spacecraft Dynamics and Control (1997),
section 9.3.
"""

import numpy as np


def first_on_time(command, gain, time_constant, on):
    """Time [s] from rest to the first pulse for a constant command; infinite inside the dead band."""
    drive = np.asarray(gain * command, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(drive > on, time_constant * np.log(drive / (drive - on)), np.inf)


def pulse_time(command, gain, time_constant, level, on, off):
    """Length [s] of a pulse for a constant command; infinite where the thruster fires for good."""
    floor = np.asarray(gain * (command - level), dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(floor < off, time_constant * np.log((on - floor) / (off - floor)), np.inf)


def pause_time(command, gain, time_constant, on, off):
    """Length [s] of the pause between pulses for a constant command; infinite inside the dead band."""
    drive = np.asarray(gain * command, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(drive > on, time_constant * np.log((drive - off) / (drive - on)), np.inf)


def dead_band(gain, on):
    """Constant command below which no pulse ever comes."""
    return on / gain
