"""The founding document's app, held to its listing (figures 5.7 and 5.8) line by line."""

import math
from collections import deque
from statistics import median

import numpy as np
import pytest

from dva_sim.agents.tilt import PhoneProfile
from dva_sim.agents.tilt.calibration import Calibration
from dva_sim.agents.tilt.measured import MeasuredTilt
from dva_sim.kernel.config import validate
from dva_sim.kernel.resources import find
from dva_sim.kernel.yaml_files import load_yaml

RATE, LAST = 33.0, 25.0
FLAT = Calibration()


def printed(name: str, **changes: object) -> PhoneProfile:
    data = {**load_yaml(find(name, "agents/phones")).data, **changes}
    return validate(PhoneProfile, data)


def felt(level: float, turn: float) -> tuple[float, float, float]:
    """Acceleration of a tilt with these readings [m/s^2]."""
    return 0.35 * level, 0.12 * turn, 9.8


def samples() -> list[tuple[float, float, float]]:
    """Times, levels and turns of a hand that swings beyond what the app can send."""
    times = np.arange(1, round(LAST * RATE)) / RATE
    swing = [(6.0 + 7.0 * math.sin(0.9 * t), 35.0 * math.sin(0.6 * t)) for t in times.tolist()]
    return [(t, *reading) for t, reading in zip(times.tolist(), swing, strict=True)]


def by_the_listing(takes: float, queues: bool, max_delay: float = 0.5) -> list[tuple[float, ...]]:
    """Times, speeds and turn rates that the listing sends, each answered after `takes` [s]."""
    speeds, turns, counter, last_update, last_key = [0.0] * 20, [0.0] * 20, 0, 0.0, None
    free, sent = 0.0, []
    for at, raw_level, raw_turn in samples():
        if at < free and not queues:
            continue  # no sample is taken: the callback has not returned
        now = max(at, free)  # a sample that has queued is worked off as soon as it can be
        speeds[counter] = min(max(raw_level, 0.0), 10.0) * 0.05
        turns[counter] = min(max(raw_turn, -30.0), 30.0)
        counter += 1
        if counter < 20 and now - last_update < max_delay - 1e-9:
            continue
        speed, turn = median(speeds), median(turns)
        counter = 0
        if (key := (round(speed / 0.05), int(turn))) != last_key:
            sent.append((now, speed, math.radians(turn)))
            now = free = now + takes  # the call returns with the reply
        last_update, last_key = now, key
    return sent


def by_our_app(profile: PhoneProfile, takes: float) -> list[tuple[float, ...]]:
    """Commands of our app, driven as the sender drives it."""
    app, sent, free = MeasuredTilt(profile, (0.0, 0.0, 9.8), 1.0 / RATE), [], math.inf
    app.pick_up(0.0)

    def look(now: float) -> None:
        nonlocal free
        command = app.look(now)
        if command is not None:
            sent.append((now, command.speed, command.turn_rate))
            app.hold()
            free = now + takes

    waiting = deque(samples())
    while waiting or not math.isinf(free):
        if not waiting or free <= waiting[0][0]:
            now, free = free, math.inf
            app.release(now)
            look(now)
            continue
        at, level, turn = waiting.popleft()
        app.sample(at, felt(level, turn))
        if math.isinf(free):
            look(at)
    return sent


@pytest.mark.parametrize("takes", [0.05, 0.7, 1.0])
@pytest.mark.parametrize("reading", ["drops", "queues"])
def test_each_reading_sends_what_the_listing_sends_and_when(reading, takes):
    expected = by_the_listing(takes, queues=reading == "queues")
    ours = by_our_app(printed(f"dissertation-{reading}"), takes)
    assert len(ours) == len(expected) > 12
    assert np.array(ours) == pytest.approx(np.array(expected), abs=1e-9)


def test_only_the_queue_falls_behind_and_only_if_a_reply_takes_longer_than_20_samples():
    """20 samples at 33 Hz are 0.61 s."""

    def age_at_the_end(name: str, takes: float) -> float:
        app, ages, free = MeasuredTilt(printed(name), (0.0, 0.0, 9.8), 1.0 / RATE), [], 0.0
        app.pick_up(0.0)
        for at, level, turn in samples():
            if app.waits and at >= free:
                app.release(at)
            app.sample(at, felt(level, turn))
            command = app.look(at) if at >= free else None
            if command is not None:
                ages.append(command.sample_age)
                app.hold()
                free = at + takes
        return max(ages[-3:])

    assert age_at_the_end("dissertation-queues", 0.3) < 1.0
    assert age_at_the_end("dissertation-drops", 1.5) < 1.0
    assert age_at_the_end("dissertation-queues", 1.5) > 5.0


@pytest.mark.parametrize(("limits", "speed"), [("before_filter", 0.45), ("after_mapping", 0.5)])
def test_ten_eights_and_ten_twelves_are_limited_before_the_median_as_figure_5_7_has_it(
    limits, speed
):
    profile = printed("dissertation-drops", limits=limits, max_delay_s=5.0)
    app = MeasuredTilt(profile, (0.0, 0.0, 9.8), 1.0 / RATE)
    app.pick_up(0.0)
    for number in range(20):
        app.sample((number + 1) / RATE, felt(8.0 if number % 2 else 12.0, 0.0))
    command = app.look(20 / RATE)
    assert command is not None
    assert command.speed == pytest.approx(speed)


@pytest.mark.parametrize(("values_at", "taken"), [("delay", True), ("sample", False)])
def test_a_value_is_taken_when_a_sample_arrives_not_at_the_delay_itself(values_at, taken):
    """At 33 Hz the 17th sample comes at 0.515 s, after the delay of 0.5 s."""
    app = MeasuredTilt(printed("dissertation-drops", values_at=values_at), (0, 0, 9.8), 1 / RATE)
    app.pick_up(0.0)
    for number in range(1, 17):
        app.sample(number / RATE, felt(8.0, 0.0))
    app.look(0.51)
    assert (app.values == 1) == taken
    app.sample(17 / RATE, felt(8.0, 0.0))
    app.look(17 / RATE)
    assert (app.values, app.samples) == ((1, 16) if taken else (1, 17))
