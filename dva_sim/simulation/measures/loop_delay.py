"""Loop delay from a picture's capture to its effect, as a sum of stages that is checked.

At each moment of a drive a command is in force that rests on pictures captured some time ago.
How long ago, averaged over the time that commands were in force, is the observation-to-effect
delay. It is found twice. *Measured*: the time of capture travels with what is wanted through hand
and filter into each command, so that the delay is read off. *As a sum*: each stage is taken from
its own records, at the same moments and with the same weights, since means add up only then.
What holds a value (a frame until the next, a command until the next) counts once, at its place.
The motors are in both with their time constant.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dva_sim.kernel.measure import Measure
from dva_sim.kernel.recorder import Applied, DriveLog
from dva_sim.network.age_in_force import AgesOverTime
from dva_sim.simulation.measures.commands import (
    AGE_IN_FORCE,
    COMMAND_AGE_MEAN,
    COMMAND_AGE_P50,
    COMMAND_AGE_P95,
    NAN,
    Floats,
    Row,
    mean,
    percentiles,
)

QUANTILES = (5, 25, 50, 75, 95)

_MEANINGS = {
    "frame": "time that a picture has been acted on, until the next one comes",
    "downlink": "sending of a picture until the operator sees it",
    "human": "seeing until wanting",
    "hand": "lag of the hand",
    "filter": "age that the phone's filter adds",
    "sampling": "time since the command in force took effect",
    "pattern": "making of a command until it may be sent",
    "uplink": "sending of a command until it arrives",
    "processing": "arrival at the robot until the command takes effect",
    "motor": "time constant of the motors",
}
STAGES = tuple(_MEANINGS)
COLUMNS = (
    COMMAND_AGE_MEAN,
    Measure("command_age_p05_s", "percentile 5 of this age"),
    Measure("command_age_p25_s", "percentile 25 of this age"),
    COMMAND_AGE_P50,
    Measure("command_age_p75_s", "percentile 75 of this age"),
    COMMAND_AGE_P95,
    AGE_IN_FORCE,
    *(Measure(f"delay_{stage}_s", meaning) for stage, meaning in _MEANINGS.items()),
    Measure("frame_age_mean_s", "age of the picture that the person reacts to: frame and downlink"),
    Measure(
        "loop_delay_mean_s",
        "observation to effect, as the sum of the stages `delay_*_s`",
        title="observation-to-effect delay (sum of its stages)",
    ),
    Measure(
        "loop_delay_measured_s",
        "the same, measured as a whole",
        title="observation-to-effect delay, measured",
    ),
)

_COUNT = 64
_LEFT = np.linspace(1.0, 0.0, _COUNT + 1)
# How long ago, in time constants, a first-order lag got what it holds: the mean of each of equal
# shares of it, so that the mean of all is one (the integral of -log v is v - v log v).
_REMEMBERED = -_COUNT * np.diff(_LEFT - _LEFT * np.log(np.maximum(_LEFT, 1e-300)))
_REMEMBERED /= _REMEMBERED.mean()


class Driven(NamedTuple):
    """A drive as far as its commands had an effect.

    Attributes:
        log: Log of the drive.
        applied: Commands that took effect before its end.
        hold: Time for which each of them was in force, shape `(n,)` [s].
    """

    log: DriveLog
    applied: Sequence[Applied]
    hold: Floats


def driven(log: DriveLog, end: float) -> Driven:
    """Return the commands made in a drive that took effect until `end` [s], and for how long.

    Commands of the previous drive that arrive late are left out.
    """
    start = math.inf if log.started is None else log.started
    applied = [a for a in log.applied if a.issued >= start and a.time <= end]
    times = np.array([*(a.time for a in applied), end])
    until = np.array([a.until for a in applied])
    return Driven(log, applied, np.maximum(np.minimum(times[1:], until) - times[:-1], 0.0))


def command_ages(drives: Sequence[Driven]) -> Row:
    """Age of commands at application (made to effect), and in force (averaged over time)."""
    ages = np.array([a.time - a.issued for drive in drives for a in drive.applied])
    hold = np.concatenate([drive.hold for drive in drives])
    row = {"command_age_mean_s": mean(ages)} | percentiles("command_age", ages, QUANTILES)
    return row | {"age_in_force_mean_s": AgesOverTime(ages, hold).mean}


def delay_budget(drives: Sequence[Driven], motor: float) -> Row:
    """Return the mean of each stage, their sum, and the measured total.

    Nothing (nan) where no command rests on a picture: nobody tilts, or the filter is frozen.

    Args:
        drives: Those of one event.
        motor: Time constant of the robot's motors [s].
    """
    parts = [_stages(drive) for drive in drives if drive.log.intents and drive.applied]
    *stages, measured, hold = np.concatenate([np.empty((0, len(STAGES) + 1)), *parts]).T
    motor = motor if hold.any() else NAN
    means = [*(_mean(stage, hold) for stage in stages), motor]
    row: Row = {f"delay_{name}_s": mean for name, mean in zip(STAGES, means, strict=True)}
    row["frame_age_mean_s"] = row["delay_frame_s"] + row["delay_downlink_s"]
    row["loop_delay_mean_s"] = sum(means)
    row["loop_delay_measured_s"] = _mean(measured, hold) + motor
    return row


def _stages(drive: Driven) -> Floats:
    """Return for each command its stages but the motors, the measured whole, and its weight [s].

    The pictures behind a command are looked up at the moments that the hand still remembers
    when the filter takes its value. Commands from before the first picture are left out.

    Returns:
        Shape `(n, 11)`: the stages in order, the whole, the time in force.
    """
    log = drive.log
    hold = drive.hold
    made = np.array([(a.issued, a.sent, a.arrived, a.time) for a in drive.applied])
    issued, sent, arrived, time = made.T
    sample_age, captured = np.array([(a.sample_age, a.captured) for a in drive.applied]).T
    moments = (issued - sample_age)[:, np.newaxis] - log.hand_lag * _REMEMBERED
    # What is wanted at a moment is followed after it.
    number = np.searchsorted([intent.time for intent in log.intents], moments, side="left") - 1
    taken, shown, intended = np.moveaxis(np.array(log.intents)[number], -1, 0)
    columns = (
        *(s.mean(axis=1) for s in (moments - intended, shown - taken, intended - shown)),
        *(np.full(len(hold), log.hand_lag), sample_age, hold / 2),
        *(sent - issued, arrived - sent, time - arrived),
        *(time + hold / 2 - captured, hold),
    )
    table = np.stack(columns, axis=1)
    complete: Floats = table[number[:, -1] >= 0]
    return complete


def _mean(values: Floats, weights: Floats) -> float:
    """Return the weighted mean; nan where nothing has a weight."""
    total = float(weights.sum())
    return float((values * weights).sum() / total) if total else NAN
