"""Accelerometers: what a part does to gravity, with the numbers of its data sheet."""

import math
from typing import Any

import numpy as np
import pytest

from dva_sim.agents.tilt import Accelerometer, AccelerometerPart, load_part
from dva_sim.agents.tilt.accelerometer import GRAVITY
from dva_sim.kernel.resources import available

MG = GRAVITY / 1000


def sensor(
    seed: int = 1, rate_hz: float | None = None, jitter: float = 0.0, **part: Any
) -> Accelerometer:
    made = AccelerometerPart(**{"noise_mg": 0.0, **part})
    return Accelerometer(made, np.random.default_rng(seed), None, rate_hz=rate_hz, jitter=jitter)


def samples(of: Accelerometer, count: int) -> np.ndarray:
    return np.array([of.sample(0.0, 0.0) for _ in range(count)])


def test_a_perfect_part_tells_gravity_by_pitch_and_roll():
    part = sensor()
    assert part.sample(0.0, 0.0) == pytest.approx((0.0, 0.0, GRAVITY))
    assert part.sample(math.pi / 6, 0.0) == pytest.approx((GRAVITY / 2, 0.0, GRAVITY * 0.8660254))
    for pitch, roll in [(0.3, -0.2), (-0.5, 0.7)]:
        assert math.hypot(*part.sample(pitch, roll)) == pytest.approx(GRAVITY)


def test_the_noise_of_a_density_grows_with_the_root_of_the_bandwidth():
    for bandwidth in (25.0, 100.0):
        part = sensor(noise_mg=None, noise_density_ug=400, bandwidth_hz=bandwidth)
        spread = np.std(samples(part, 20_000), axis=0)
        assert spread == pytest.approx(0.4 * MG * math.sqrt(bandwidth), rel=0.03)


def test_the_output_comes_in_steps_and_ends_at_the_range():
    part = sensor(resolution_mg=4.0, noise_mg=5.0)
    steps = samples(part, 1000) / (4.0 * MG)
    assert np.allclose(steps, np.round(steps))
    narrow = sensor(offset_mg=800.0, range_g=1.0)
    assert np.abs(samples(narrow, 1)).max() <= GRAVITY


def test_offsets_differ_between_copies_by_as_much_as_the_data_sheet_says():
    offsets = np.array([sensor(seed, offset_mg=50.0).offset for seed in range(700)])
    assert np.std(offsets) == pytest.approx(50 * MG, rel=0.05)


def test_a_session_is_warmer_or_colder_than_the_one_before_by_five_kelvin():
    part, levels = sensor(offset_mg_per_k=0.5), []
    for _ in range(2000):
        part.begin_session()
        levels.append(part.sample(0.0, 0.0)[0])
    assert np.std(levels) == pytest.approx(0.5 * 5 * MG, rel=0.05)


def test_the_drift_grows_with_the_root_of_time():
    ends = []
    for seed in range(300):
        walk = samples(sensor(seed, rate_hz=2.0, drift_mg_per_sqrt_min=2.0), 481)
        ends.append((walk[120, 0] - walk[0, 0], walk[480, 0] - walk[0, 0]))
    after_a_minute, after_four = np.std(ends, axis=0)
    assert after_a_minute == pytest.approx(2 * MG, rel=0.12)
    assert after_four == pytest.approx(4 * MG, rel=0.12)


def test_samples_come_at_the_rate_and_jitter_around_it_without_overtaking():
    part = sensor(rate_hz=34.0, jitter=0.1)
    times = np.cumsum([part.interval() for _ in range(34_000)])
    late = times - np.arange(1, 34_001) / 34
    assert np.diff(times).min() > 0
    assert np.std(late) == pytest.approx(0.1 / 34, rel=0.03)
    assert times[-1] == pytest.approx(1000.0, abs=0.02)


def test_the_size_of_a_block_of_random_numbers_changes_no_number():
    part = AccelerometerPart(noise_mg=3.0, drift_mg_per_sqrt_min=1.0, offset_mg_per_k=0.5)
    rows = []
    for block in (1, 7, 256):
        one = Accelerometer(
            part, np.random.default_rng(5), None, rate_hz=34.0, jitter=0.1, block=block
        )
        rows.append([(*one.sample(0.1, 0.2), one.interval()) for _ in range(600)])
    assert rows[0] == rows[1] == rows[2]


def test_the_same_copy_is_in_all_runs_of_its_owner():
    part = AccelerometerPart(noise_mg=1.0, offset_mg=50.0)
    runs = [
        Accelerometer(part, np.random.default_rng(run), np.random.default_rng(9)).offset
        for run in (1, 2)
    ]
    assert runs[0] == runs[1]


@pytest.mark.parametrize("name", sorted(available("agents/accelerometers")))
def test_every_part_says_where_its_numbers_are_from(name):
    part = load_part(name)
    assert part.data_sheet or part.noise == 0.0
    assert part.noise < 0.05
