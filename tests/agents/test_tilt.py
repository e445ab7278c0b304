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


def mean_age_in_force(slots: int) -> float:
    """Mean age of what stands at the filter's output, looked at every 0.5 s, 34 samples a second.

    The input is a ramp of one per second, so that the output lags by exactly its age.
    """
    filter_, rate, look = BatchMedian(slots), 34, 0.5
    lags = []
    for batch in range(200):
        first, end = math.ceil(batch * look * rate), math.ceil((batch + 1) * look * rate)
        for sample in range(first + 1, end + 1):
            filter_.add((sample / rate, 0.0))
        seen_at = (batch + 1) * look
        lags.append(seen_at - filter_.value()[0] + look / 2)
    return float(np.mean(lags[5:]))


def test_the_dissertation_filter_alone_costs_about_half_a_second() -> None:
    """0.47 s if the 17 samples of 0.5 s filled the buffer; three stale slots make it 0.515 s."""
    assert mean_age_in_force(17) == pytest.approx(0.47, abs=0.03)
    assert mean_age_in_force(20) == pytest.approx(0.515, abs=0.03)


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
