"""The hand: it lags, trembles between 8 and 12 Hz, errs by a share, and has limits."""

import math

import numpy as np
import pytest

from dva_sim.agents.tilt.hand import Hand

RATE = 200.0


def still(seed: int = 1, **settings: float) -> Hand:
    return Hand(settings.pop("lag", 0.0), np.random.default_rng(seed), tremor=0.0, **settings)


def pitches(hand: Hand, pitch: float, seconds: float, rate: float = RATE) -> np.ndarray:
    steps = round(seconds * rate)
    return np.array([hand.step(pitch, 0.0, 1 / rate)[0] for _ in range(steps)])


@pytest.mark.parametrize("rate", [34.0, 100.0, 200.0])
def test_it_closes_63_percent_of_a_step_in_its_lag(rate):
    way = pitches(still(lag=0.5), 0.2, 0.5, rate)
    assert way[-1] == pytest.approx(0.2 * (1 - 1 / math.e), rel=0.01)


def test_most_of_the_tremor_lies_between_8_and_12_hz():
    hand = Hand(0.15, np.random.default_rng(2), tremor=0.004)
    shakes = pitches(hand, 0.0, 400.0)
    power = np.abs(np.fft.rfft(shakes)) ** 2
    hertz = np.fft.rfftfreq(shakes.size, 1 / RATE)
    within = power[(hertz >= 8) & (hertz <= 12)].sum() / power.sum()
    smooth = np.convolve(power, np.ones(200), "same")
    assert within == pytest.approx(0.70, abs=0.05)
    assert 9.0 < hertz[np.argmax(smooth)] < 11.0
    assert np.std(shakes) == pytest.approx(0.004, rel=0.05)


def test_the_size_of_tremor_and_error_does_not_depend_on_the_rate_of_looking():
    for rate in (34.0, 150.0):
        shakes = pitches(Hand(0.15, np.random.default_rng(3), tremor=0.004), 0.0, 200.0, rate)
        errors = pitches(still(3, lag=0.15, motor_noise=0.1), 0.3, 900.0, rate)[100:]
        assert np.std(shakes) == pytest.approx(0.004, rel=0.07)
        assert np.std(errors) == pytest.approx(0.1 * 0.3 / math.sqrt(2), rel=0.15)


def test_the_error_of_aiming_is_a_share_of_the_tilt_and_nothing_at_rest():
    hand = still(4, lag=0.1, motor_noise=0.1)
    assert set(pitches(hand, 0.0, 10.0)) == {0.0}
    small = np.std(pitches(still(5, lag=0.1, motor_noise=0.1), 0.1, 300.0)[200:])
    large = np.std(pitches(still(5, lag=0.1, motor_noise=0.1), 0.4, 300.0)[200:])
    assert large == pytest.approx(4 * small)


def test_it_tilts_no_farther_and_no_faster_than_it_can():
    way = pitches(still(max_tilt=0.5, max_speed=2.0), 3.0, 1.0)
    assert way.max() == pytest.approx(0.5)
    assert np.diff(way).max() == pytest.approx(2.0 / RATE)


def test_the_size_of_a_block_of_random_numbers_changes_no_number():
    ways = [
        pitches(Hand(0.15, np.random.default_rng(6), motor_noise=0.05, block=block), 0.3, 5.0)
        for block in (1, 7, 256)
    ]
    assert np.array_equal(ways[0], ways[1])
    assert np.array_equal(ways[0], ways[2])
