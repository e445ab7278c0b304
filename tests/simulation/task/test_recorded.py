"""Drives over a recorded link."""

import math

import numpy as np
import pytest

from dva_sim.simulation.task import build, play
from dva_sim.simulation.task.recorded_delays import FrameStream, RecordedChannel, RecordedDelays

STRAIGHT = {
    "model": "task",
    "task": {"kind": "course", "points_m": [[0, 0], [6, 0], [9, 3]], "width_m": 2.0},
    "device": {"kind": "joystick", "rate_hz": 20},
    "frames": {"rate_hz": 10},
    "plant": {"speed_mps": 0.5, "width_m": 0.6},
    "practice": 0,
    "horizon_s": 120,
}


def stream(period: float, *delays: float) -> FrameStream:
    return FrameStream(period, np.array(delays))


def steady(delay: float) -> RecordedDelays:
    """Always the same delay, both ways [s]."""
    return RecordedDelays(stream(0.05, *[delay] * 40), stream(0.1, *[delay] * 20))


def test_a_message_has_the_delay_of_the_recorded_one_made_when_it_is_or_just_before():
    recorded = stream(0.1, 0.01, 0.02, 0.03)
    assert [recorded.delay_at(t) for t in (0.0, 0.1, 0.25)] == [0.01, 0.02, 0.03]


def test_at_its_end_a_recording_goes_on_from_its_beginning():
    assert stream(0.1, 0.01, 0.02, 0.03).delay_at(0.3) == 0.01


def test_a_channel_gives_what_has_arrived_and_nothing_that_never_did():
    channel = RecordedChannel(stream(0.1, 0.05, math.inf, 0.05), 0.0, 0.01)
    for number in range(3):
        channel.put(0.1 * number, number)
    assert channel.take(0.059) == []
    assert channel.take(0.06) == [0]
    assert channel.take(5.0) == [2]


def test_what_a_newer_one_has_overtaken_is_thrown_away():
    channel = RecordedChannel(stream(0.1, 0.5, 0.1), 0.0, 0.0)
    channel.put(0.0, "old")
    channel.put(0.1, "new")
    assert channel.take(0.2) == ["new"]
    assert channel.take(1.0) == []


@pytest.mark.parametrize("delay", [0.0, 0.25])
def test_a_drive_over_a_steady_recording_is_the_drive_over_that_delay(delay):
    link = {"link": {"up": {"delay_s": delay}, "down": {"delay_s": delay}}}
    plain = play(build(STRAIGHT | link), 3)
    recorded = play(build(STRAIGHT), 3, steady(delay))
    assert recorded == plain


def test_a_recording_in_which_nothing_arrives_leads_nowhere():
    nothing = RecordedDelays(stream(0.05, math.inf), stream(0.1, math.inf))
    assert play(build(STRAIGHT), 3, nothing)[0]["completed"] == 0.0


def test_no_recording_reaches_the_oracle():
    oracle = build(STRAIGHT | {"operator": {"strategy": "oracle"}})
    assert play(oracle, 3, steady(2.0)) == play(oracle, 3)
