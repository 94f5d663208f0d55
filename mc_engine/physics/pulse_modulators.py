"""Pulse-width pulse-frequency modulator: a first-order lag and a Schmitt trigger in a feedback loop.

    time_constant y' = input_gain * command - feedback_gain * output - y

The output goes on, to the thruster's level, when y reaches `on` and off again when y falls to `off`.
The standard form has one gain, input_gain = feedback_gain = K.

M. J. Sidi, Spacecraft Dynamics and Control (1997), section 9.3.
"""

import numpy as np

from mc_engine.lanes import physics


@physics
def lag_rate(y, command, output, input_gain, feedback_gain, time_constant):
    """Rate of the lag's output y, in units of the command per second."""
    return (input_gain * command - feedback_gain * output - y) / time_constant


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
