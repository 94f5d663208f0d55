"""Pulse-width pulse-frequency modulator: a first-order lag and a Schmitt trigger in a feedback loop.

    time_constant y' = input_gain * command - feedback_gain * output - y

The output goes on, to the thruster's level, when y reaches `on` and off again when y falls to `off`.
The standard form has one gain, input_gain = feedback_gain = K.

`lag_rate` is for a model whose trigger is an event of the engine.  `sampled_pulses` needs none: under a command that
is held from sample to sample the lag is an exponential, and its switching times are known.

M. J. Sidi, Spacecraft Dynamics and Control (1997), section 9.3.
"""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import any_lane, copysign, log, maximum, minimum, physics, where

# filtered: the lag's output; output: -1.0, 0.0 or 1.0; age: time since it last changed [s];
# pulses: how many have begun; shortest: the shortest that has ended [s], infinite before
Pulses = namedtuple("Pulses", "filtered output age pulses shortest")

SWITCHES_PER_SAMPLE = 8  # at most; the hysteresis keeps switches apart, so that a usual sample has one or none


@physics
def lag_rate(y, command, output, input_gain, feedback_gain, time_constant):
    """Rate of the lag's output y, in units of the command per second."""
    return (input_gain * command - feedback_gain * output - y) / time_constant


@physics
def at_rest():
    """A modulator before its first sample."""
    return Pulses(0.0, 0.0, 0.0, 0.0, float("inf"))


@physics
def _held(pulses, command, rest, gain, level, on, off):
    """(drive, end, turns): where the lag tends to, what it reaches by `rest`, and whether it meets its threshold."""
    drive = gain * (command - level * pulses.output)
    end = drive + (pulses.filtered - drive) * rest
    firing = abs(pulses.output) > 0.5
    return drive, end, (firing & (pulses.output * end <= off)) | ((not firing) & (abs(end) >= on))


@physics
def sampled_pulses(pulses, command, gain, level, on, off, time_constant, period, decay):
    """(pulses, mean) after a sample of length `period` [s] under a held command; fires in both directions.

    mean : the output's mean over the sample, -1 to 1.  decay : exp(-period / time_constant).
    gain : of the standard form, on command and output.  Switching times are exact: the lag goes from y to its drive d
    as d + (y - d) exp(-t / time_constant).
    """
    left, rest, fired = period, decay, 0.0 * command
    drive, end, turns = _held(pulses, command, rest, gain, level, on, off)
    for _ in range(SWITCHES_PER_SAMPLE):
        if not any_lane(turns):
            break
        firing = abs(pulses.output) > 0.5
        threshold = where(firing, pulses.output * off, copysign(on, end))
        # exp(t / time_constant) at the switch; never before the time that has come, whatever the rounding
        stretch = where(turns, (pulses.filtered - drive) / where(turns, threshold - drive, 1.0), 1.0)
        stretch = maximum(stretch, 1.0)
        spent = minimum(time_constant * log(stretch), left)
        left, rest, fired = left - spent, minimum(rest * stretch, 1.0), fired + pulses.output * spent
        age = pulses.age + spent
        ends, begins = turns & firing, turns & (not firing)
        pulses = Pulses(
            where(turns, threshold, pulses.filtered),
            where(ends, 0.0, where(begins, copysign(1.0, end), pulses.output)),
            where(turns, 0.0, age),
            where(begins, pulses.pulses + 1.0, pulses.pulses),
            where(ends, minimum(age, pulses.shortest), pulses.shortest),
        )
        drive, end, turns = _held(pulses, command, rest, gain, level, on, off)
    fired = fired + pulses.output * left
    after = Pulses(end, pulses.output, pulses.age + left, pulses.pulses, pulses.shortest)
    return after, fired * (1.0 / period)


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


def shortest_pulse(gain, time_constant, level, on, off):
    """Length [s] of the shortest pulse that a steady command brings, about that of a command near zero.

    -T ln(1 - h / (K U)), h = on - off: the usual estimate, for the lag falling from h to 0 with a drive of -K U.
    """
    return -time_constant * np.log(1.0 - np.asarray(on - off, dtype=float) / (gain * level))
