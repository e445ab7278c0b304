"""Filters: what they smooth, how old their values are, and where the dissertation's sticks."""

import math

import numpy as np
import pytest

from dva_sim.agents.tilt.filters import (
    BatchMedian,
    Filter,
    GuardedFilter,
    MovingMedian,
    known_filters,
    load_filter,
)

PERIOD = 1 / 34
SAMPLES_IN_200_MS = 7  # at 34 Hz


def made(name: str, **options: object) -> Filter:
    return load_filter(name, options)(PERIOD)


def batches(filter_: Filter, levels: list[float], fresh: int) -> list[float]:
    """The speed level after each batch of `fresh` samples of one level."""
    out = []
    for level in levels:
        for _ in range(fresh):
            filter_.add((level, 0.0))
        out.append(filter_.value()[0])
    return out


def test_with_few_fresh_samples_a_copying_median_stays_frozen_at_zero():
    step = [2.0] * 10 + [8.0] * 10 + [2.0] * 10
    assert set(batches(made("median20-copy"), step, SAMPLES_IN_200_MS)) == {0.0}


def test_with_few_fresh_samples_sorting_in_place_ratchets_up_and_never_comes_down():
    step = [2.0] * 5 + [8.0] * 5 + [2.0] * 20
    values = batches(made("median20-inplace"), step, SAMPLES_IN_200_MS)
    assert values[4] == 2
    assert values[9:] == [8] * 21


def test_with_a_full_buffer_both_follow():
    for name in ("median20-copy", "median20-inplace"):
        assert batches(made(name), [2, 8, 2], 20) == [2, 8, 2]


def test_the_median_of_20_lets_a_quarter_of_the_noise_through():
    rng, filter_ = np.random.default_rng(3), made("median20-copy")
    values = []
    for _ in range(4000):
        for sample in rng.normal(size=20).tolist():
            filter_.add((sample, 0.0))
        values.append(filter_.value()[0])
    assert 0.21 < np.std(values) < 0.28


def mean_age_in_force(slots: int) -> float:
    """Mean age of what stands at the output when a sample comes; looked at each 17 samples."""
    filter_, fresh, ages, value = BatchMedian(PERIOD, slots), 17, [], 0.0
    for number in range(200 * fresh):
        filter_.add((number * PERIOD, 0.0))  # an input of one per second lags by its age
        if number % fresh == fresh - 1:
            value = filter_.value()[0]
        ages.append(number * PERIOD - value)
    return float(np.mean(ages[10 * fresh - 1 : -1]))


def test_the_dissertation_filter_alone_costs_about_half_a_second():
    """0.47 s if the 17 samples of 0.5 s filled the buffer; three stale slots make it 0.515 s."""
    assert mean_age_in_force(17) == pytest.approx(16 / 34)
    assert mean_age_in_force(20) == pytest.approx(17.5 / 34)


@pytest.mark.parametrize(
    ("name", "options", "samples"),
    [
        ("none", {}, 0.0),
        ("median", {"window": 5}, 2.0),
        ("median", {"window": 9}, 4.0),
        ("one_pole", {"time_constant_s": 0.3}, 0.3 / PERIOD - 0.5),
    ],
)
def test_a_filter_lags_behind_a_rising_input_by_its_age(name, options, samples):
    filter_ = made(name, **options)
    for number in range(500):
        filter_.add((float(number), -float(number)))
    assert filter_.value() == pytest.approx((499 - filter_.age, filter_.age - 499))
    assert filter_.age == pytest.approx(samples, abs=0.02)


@pytest.mark.parametrize(("fresh", "age"), [(20, 9.5), (17, 9.5), (11, 9.5)])
def test_stale_slots_make_a_median_as_old_as_if_its_buffer_were_full(fresh, age):
    filter_ = made("median20-copy")
    for number in range(1, 50 * fresh + 1):
        filter_.add((float(number), 0.0))
        if number % fresh == 0:
            value = filter_.value()[0]
    assert number - value == filter_.age == age


def test_a_frozen_median_grows_older_and_older():
    filter_, ages = made("median20-copy"), []
    for _ in range(3):
        batches(filter_, [5.0], SAMPLES_IN_200_MS)
        ages.append(filter_.age)
    assert ages == [7, 14, 21]


def test_a_moving_median_takes_out_a_single_outlier():
    filter_ = made("median")
    for level in (1, 1, 50, 1, 1):
        filter_.add((level, level))
    assert filter_.value() == (1, 1)


def test_one_pole_closes_63_percent_of_a_step_in_its_time_constant():
    filter_ = made("one_pole", time_constant_s=10 * PERIOD)
    filter_.add((0.0, 0.0))
    for _ in range(10):
        filter_.add((1.0, 2.0))
    assert filter_.value() == pytest.approx((1 - math.exp(-1), 2 - 2 * math.exp(-1)))


def test_every_filter_answers_before_any_sample_has_come():
    for name in known_filters():
        assert made(name).value() == (0.0, 0.0)


def test_a_filter_of_a_users_file_is_found(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from dva_sim.agents.tilt import Filter\n"
        "class Half(Filter):\n"
        "    def __init__(self, period, share=0.5):\n"
        "        super().__init__(period)\n"
        "        self.share, self.now = share, (0.0, 0.0)\n"
        "    def add(self, sample):\n"
        "        self.now = sample[0] * self.share, sample[1] * self.share\n"
        "    def value(self):\n"
        "        return self.now\n"
    )
    filter_ = load_filter("mine.py:Half", {"share": 0.25}, tmp_path)(PERIOD)
    filter_.add((4.0, 8.0))
    assert filter_.value() == (1.0, 2.0)


class Tiring(MovingMedian):
    """Takes three samples, and no other one."""

    taken = 0

    def add(self, sample: tuple[float, float]) -> None:
        self.taken += 1
        if self.taken > 3:
            raise RuntimeError("is tired")
        super().add(sample)


def test_a_users_filter_that_takes_no_more_samples_lets_the_phone_stand():
    guarded = GuardedFilter(Tiring(0.03), 0.03)
    for _ in range(3):
        guarded.add((6.0, 12.0))
    assert guarded.value() == (6.0, 12.0)
    guarded.add((6.0, 12.0))
    assert guarded.value() == (0.0, 0.0)
    assert (guarded.failures, guarded.first_failure) == (1, "RuntimeError: is tired")
