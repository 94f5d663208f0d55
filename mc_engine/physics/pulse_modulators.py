"""Pulse-width pulse-frequency modulator: a first-order lag and a Schmitt trigger in a feedback loop.

    time_constant y' = input_gain * command - feedback_gain * output - y

The output goes on, to the thruster's level, when y reaches `on` and off again when y falls to `off`.
The standard form has one gain, input_gain = feedback_gain = K.

`lag_rate` is for a model whose trigger is an event of the engine.  `sampled_pulses` needs no events: if the command is
held from sample to sample, the lag is an exponential, and its switching times are known.

Pulses : filtered, the lag's output; output, -1.0, 0.0 or 1.0; age, the time since it last changed [s]; pulses, how many
    have begun; shortest, the shortest that has ended [s], infinite before the first

M. J. Sidi, Spacecraft Dynamics and Control (1997), section 9.3.
"""

from collections import namedtuple

from mc_engine.lanes import any_lane, copysign, exp, floor, log, maximum, minimum, physics, where
from mc_engine.lanes.functions import sign_copied

Pulses = namedtuple("Pulses", "filtered output age pulses shortest")
# a sample while it is followed.  left: what remains of it [s]; rest: exp(-left / time_constant); fired: integral of the
# output so far [s]; drive: where the lag tends to; end: where it will be after `left`; turns: if it switches before
_Sample = namedtuple("_Sample", "pulses left rest fired drive end turns")

SWITCHES_FOLLOWED = 4  # one by one in a sample; by then the lag goes in cycles, of which whole ones are left out
_LAST_SWITCHES = 3  # in less than a cycle there are two; rounding may add one
_SHORT = 1.0 / 32.0  # up to here five terms of the series of `_approach` are exact to 1e-16


@physics
def lag_rate(y, command, output, input_gain, feedback_gain, time_constant):
    """Rate of the lag's output y, in units of the command per second."""
    return (input_gain * command - feedback_gain * output - y) / time_constant


@physics
def at_rest():
    """A modulator before its first sample."""
    return Pulses(0.0, 0.0, 0.0, 0.0, float("inf"))


@physics
def _headed(pulses, left, rest, fired, command, m):
    """The sample that goes on from these pulses until it ends."""
    drive = m.gain * (command - m.level * pulses.output)
    end = drive + (pulses.filtered - drive) * rest
    firing = abs(pulses.output) > 0.5
    turns = (firing & (pulses.output * end <= m.off)) | ((not firing) & (abs(end) >= m.on))
    return _Sample(pulses, left, rest, fired, drive, end, turns)


@physics
def _begun(pulses, command, m, period):
    """The sample before its first switch."""
    zero = 0.0 * command  # spread over the lanes here: plain numbers cost eight lanes 2 % of a flight
    return _headed(pulses, zero + period, zero + m.decay, zero, command, m)


@physics
def _approach(y, threshold, drive, time_constant, turns):
    """(time, stretch) in which the lag gets from y to the threshold on its way to the drive; stretch = exp(time / T).

    T ln(a / b), a and b being what is missing to the drive at first and at last: 2 T atanh(s), s = (a - b) / (a + b).
    Where s is small, as in every sample that is short against T, its series spares the wait for a logarithm.
    Without meaning in lanes that do not turn; to mask the divisors as well takes 5 % of a flight's time.
    """
    a, b = y - drive, threshold - drive
    s = maximum((a - b) / (a + b), 0.0)  # never before the time that has come, whatever the rounding
    stretch = a / b
    z = s * s
    z2 = z * z
    logarithm = 2.0 * s * ((1.0 + z * (1.0 / 3.0)) + z2 * ((0.2 + z * (1.0 / 7.0)) + z2 * (1.0 / 9.0)))
    far = turns & (s > _SHORT)
    if any_lane(far):
        logarithm = where(far, log(stretch), logarithm)
    return time_constant * logarithm, stretch


@physics
def _switched(sample, command, m):
    """The sample after the next switch, where there is one."""
    pulses, turns = sample.pulses, sample.turns
    firing = abs(pulses.output) > 0.5
    threshold = where(firing, pulses.output * m.off, sign_copied(m.on, sample.end))
    spent, stretch = _approach(pulses.filtered, threshold, sample.drive, m.time_constant, turns)
    spent = where(turns, where(spent < sample.left, spent, sample.left), 0.0)
    age, fired = pulses.age + spent, sample.fired + pulses.output * spent
    ends, begins = turns & firing, turns & (not firing)
    pulses = Pulses(
        where(turns, threshold, pulses.filtered),
        where(ends, 0.0, where(begins, sign_copied(1.0, sample.end), pulses.output)),
        where(turns, 0.0, age),
        where(begins, pulses.pulses + 1.0, pulses.pulses),
        where(ends & (age < pulses.shortest), age, pulses.shortest),
    )
    rest = where(turns, minimum(sample.rest * stretch, 1.0), sample.rest)
    return _headed(pulses, sample.left - spent, rest, fired, command, m)


@physics
def _without_cycles(sample, command, m):
    """The sample without all whole cycles in its remaining time, where it has just switched and will again.

    A cycle is a pulse and a pause, as long as the lag takes between its thresholds; after it all is as it was before.
    """
    pulses, push = sample.pulses, m.gain * abs(command)
    pull = push - m.gain * m.level
    cycling = sample.turns & (push > m.on) & (pull < m.off)
    pulse = m.time_constant * log(where(cycling, (m.on - pull) / (m.off - pull), 2.0))
    pause = m.time_constant * log(where(cycling, (push - m.off) / (push - m.on), 2.0))
    n = where(cycling, floor(sample.left / (pulse + pause)), 0.0)
    some = n > 0.0
    left = where(some, maximum(sample.left - n * (pulse + pause), 0.0), sample.left)
    rest = where(some, exp(-left / m.time_constant), sample.rest)
    shortest = where(some & (pulse < pulses.shortest), pulse, pulses.shortest)
    pulses = Pulses(pulses.filtered, pulses.output, pulses.age, pulses.pulses + n, shortest)
    return _headed(pulses, left, rest, sample.fired + copysign(n * pulse, command), command, m)


@physics
def _ended(sample, period):
    """(pulses, mean) at the end of the sample; no number where the command was none: it would leave the output on."""
    pulses, left = sample.pulses, sample.left
    fired = sample.fired + pulses.output * left
    after = Pulses(sample.end, pulses.output, pulses.age + left, pulses.pulses, pulses.shortest)
    return after, where(sample.end == sample.end, fired * (1.0 / period), sample.end)


@physics
def sampled_pulses(x, y, z, command_x, command_y, command_z, m, period):
    """(x, y, z, mean_x, mean_y, mean_z): the modulators of three axes after a sample of length `period` [s].

    Each command is held; each modulator fires in both directions.  mean : of the output over the sample, -1 to 1.
    m : gain, of the standard form, on command and output; level, on, off, time_constant [s];
        decay = exp(-period / time_constant).
    Switching times are exact: the lag moves from y to its drive d as d + (y - d) exp(-t / time_constant).  A sample may
    contain any number of switches.  Three axes are computed at once, because a processor that waits for the division of
    one axis can compute the others.
    """
    a, b, c = _begun(x, command_x, m, period), _begun(y, command_y, m, period), _begun(z, command_z, m, period)
    for _ in range(SWITCHES_FOLLOWED):
        if not any_lane(a.turns | b.turns | c.turns):
            break
        a, b, c = _switched(a, command_x, m), _switched(b, command_y, m), _switched(c, command_z, m)
    if any_lane(a.turns | b.turns | c.turns):
        a, b, c = _without_cycles(a, command_x, m), _without_cycles(b, command_y, m), _without_cycles(c, command_z, m)
        for _ in range(_LAST_SWITCHES):
            a, b, c = _switched(a, command_x, m), _switched(b, command_y, m), _switched(c, command_z, m)
    x, mean_x = _ended(a, period)
    y, mean_y = _ended(b, period)
    z, mean_z = _ended(c, period)
    return x, y, z, mean_x, mean_y, mean_z
