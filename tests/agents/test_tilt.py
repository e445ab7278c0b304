"""The phone: filters with their faults, mapping, and when a command is sent."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dva_sim.agents.tilt import FILTERS, Phone, PhoneProfile
from dva_sim.agents.tilt.filters import BatchMedian, MovingMedian

QUIET = {"noise_mps2": 0.0, "bias_mps2": 0.0, "tremor_mps2": 0.0}
SAMPLES_IN_200_MS = 7  # at 34 Hz


def phone(hand_lag: float = 0.0, **settings: object) -> Phone:
    profile = PhoneProfile(**{**QUIET, **settings})  # type: ignore[arg-type]
    return Phone(profile, hand_lag, np.random.default_rng(1))


def batches(filter_: BatchMedian, levels: list[float], fresh: int) -> list[float]:
    """The speed level after each batch of `fresh` samples of one level."""
    out = []
    for level in levels:
        for _ in range(fresh):
            filter_.add((level, 0.0))
        out.append(filter_.value()[0])
    return out


def test_with_few_fresh_samples_a_copying_median_stays_frozen_at_zero() -> None:
    assert batches(BatchMedian(), [2, 8, 2, 8], SAMPLES_IN_200_MS) == [0, 0, 0, 0]


def test_with_few_fresh_samples_sorting_in_place_ratchets_up_and_never_comes_down() -> None:
    values = batches(BatchMedian(in_place=True), [2] * 5 + [8] * 5 + [2] * 20, SAMPLES_IN_200_MS)
    assert values[4] == 2
    assert values[9:] == [8] * 21


def test_with_a_full_buffer_both_follow() -> None:
    for in_place in (False, True):
        assert batches(BatchMedian(in_place=in_place), [2, 8, 2], 20) == [2, 8, 2]


def test_the_median_of_20_lets_a_quarter_of_the_noise_through() -> None:
    rng, filter_ = np.random.default_rng(3), BatchMedian()
    values = []
    for _ in range(4000):
        for sample in rng.normal(size=20):
            filter_.add((sample, 0.0))
        values.append(filter_.value()[0])
    assert 0.21 < np.std(values) < 0.28


def test_a_moving_median_takes_out_a_single_outlier() -> None:
    filter_ = MovingMedian()
    for level in (1, 1, 50, 1, 1):
        filter_.add((level, level))
    assert filter_.value() == (1, 1)


@pytest.mark.parametrize(("filter_", "low", "high"), [("median20-copy", 0.44, 0.545)])
def test_the_dissertation_filter_alone_costs_about_half_a_second(
    filter_: str, low: float, high: float
) -> None:
    """Mean age of the tilt in force, for slow tilting at 34 Hz and 0.5 s; samples and hold."""
    app = phone(filter=filter_, send="on_change", speed_step_mps2=1.0, turn_step_mps2=1.0)
    app.pick_up(0.0)
    rate, errors, value, due = 0.2, [], 0.0, app.next_look(0.0, 10.0)
    for now in np.arange(0.0, 60.0, 0.01):
        app.ask(now, 0.0, math.radians(10 + 10 * math.sin(rate * now)))
        if now >= due:
            command = app.look(now)
            value = value if command is None else math.degrees(command.turn_rate)
            due = app.next_look(now, 10.0)
        errors.append((now, value))
    times, values = np.array(errors[1000:]).T
    lags = np.arange(0.2, 0.9, 0.01)
    misfit = [np.mean((10 + 10 * np.sin(rate * (times - lag)) - values) ** 2) for lag in lags]
    # Three stale zeros of twenty pull the median down; the lag is what is asked for here.
    best = lags[int(np.argmin(misfit))]
    assert low - 0.15 < best < high + 0.15


def test_full_tilt_is_half_a_metre_and_pi_sixths_and_backwards_is_zero() -> None:
    app = phone(filter="none")
    app.pick_up(0.0)
    app.ask(0.0, 5.0, math.radians(80))
    command = app.look(1.0)
    assert command is not None
    assert command.speed == pytest.approx(0.5)
    assert command.turn_rate == pytest.approx(math.pi / 6)
    app.ask(1.0, -1.0, -math.radians(80))
    command = app.look(2.0)
    assert command is not None
    assert command.speed == 0.0
    assert command.turn_rate == pytest.approx(-math.pi / 6)


def test_an_unchanged_value_is_sent_again_only_by_an_app_that_keeps_alive() -> None:
    for send, again in (("on_change", False), ("keep_alive", True)):
        app = phone(filter="none", send=send)
        app.pick_up(0.0)
        app.ask(0.0, 0.3, 0.0)
        assert app.look(0.5) is not None
        assert (app.look(1.0) is not None) == again


def test_a_batch_is_looked_at_after_20_samples_or_the_longest_delay() -> None:
    short = phone(filter="median20-copy", send="on_change", max_delay_s=0.5)
    long = phone(filter="median20-copy", send="on_change", max_delay_s=2.0)
    assert short.next_look(0.0, 10.0) == 0.5
    assert long.next_look(0.0, 10.0) == pytest.approx(20 / 34)


def test_how_often_the_app_looks_does_not_change_the_samples() -> None:
    noisy = {"noise_mps2": 0.05, "bias_mps2": 0.08, "tremor_mps2": 0.06}
    seldom, often = (phone(0.15, filter="median5", **noisy) for _ in range(2))
    for app in (seldom, often):
        app.pick_up(0.0)
        app.ask(0.0, 0.3, 0.2)
    for tick in range(1, 100):
        often.look(tick / 10)
    assert seldom.look(10.0) == often.look(10.0)


def test_a_hand_closes_63_percent_of_a_step_in_its_time_constant() -> None:
    app = phone(hand_lag=0.2, filter="none", sample_rate_hz=1000)
    app.pick_up(0.0)
    app.ask(0.0, 0.0, 0.5)
    command = app.look(0.2)
    assert command is not None
    assert command.turn_rate == pytest.approx(0.5 * (1 - math.exp(-1)), rel=0.01)


def test_every_filter_answers_before_any_sample_has_come() -> None:
    for make in FILTERS.values():
        assert make().value() == (0.0, 0.0)
