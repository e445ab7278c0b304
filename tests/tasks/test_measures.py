import math

import numpy as np
import pytest

from dva_sim.tasks.measures import (
    crossover,
    effective_width,
    fit_line,
    fitts_id,
    open_loop,
    steering_id,
    throughput,
)


def test_a_target_three_widths_away_has_an_index_of_two_bits():
    assert fitts_id(amplitude=0.3, width=0.1) == pytest.approx(2.0)


def test_a_tunnel_ten_widths_long_has_an_index_of_ten():
    assert steering_id(length=0.2, width=0.02) == pytest.approx(10.0)


def test_the_effective_width_is_4_133_standard_deviations_of_the_ends():
    assert effective_width([-0.01, 0.0, 0.01]) == pytest.approx(4.133 * 0.01)


def test_throughput_is_bits_over_the_mean_time():
    assert throughput(0.3, 0.1, [0.9, 1.1]) == pytest.approx(2.0)


def test_ends_beyond_the_centre_lengthen_the_effective_amplitude():
    ends = [0.02, 0.03, 0.04]
    wanted = math.log2(0.33 / (4.133 * 0.01) + 1.0)
    assert throughput(0.3, 0.1, [1.0], ends) == pytest.approx(wanted)


@pytest.mark.parametrize("ends", [[0.01], [0.01, 0.01]])
def test_without_a_spread_of_ends_there_is_no_effective_throughput(ends):
    assert math.isnan(throughput(0.3, 0.1, [1.0], ends))


def test_a_line_through_exact_points_explains_everything():
    assert fit_line([0.0, 1.0, 2.0], [1.0, 3.0, 5.0]) == pytest.approx((1.0, 2.0, 1.0))


def test_one_x_makes_no_line():
    with pytest.raises(ValueError, match="two different x"):
        fit_line([1.0, 1.0], [0.0, 2.0])


def test_crossover_and_margin_of_an_integrator_with_delay_are_gain_and_the_rest_of_90_degrees():
    gain, delay = 2.0, 0.25
    frequencies = np.array([0.5, 1.0, 1.9, 2.1, 4.0, 8.0])
    loop = gain / (1j * frequencies) * np.exp(-1j * frequencies * delay)
    found = crossover(frequencies.tolist(), loop)
    assert found.frequency == pytest.approx(2.0, rel=1e-3)
    assert found.phase_margin == pytest.approx(math.pi / 2 - gain * delay, abs=2e-3)


def test_a_margin_knows_no_whole_turns():
    """Phases of 150 and 130 degrees, as they look when the lowest frequency lags by 300 more."""
    angles = np.radians([-450.0, -150.0 - 360.0, -130.0 - 360.0])
    loop = np.array([4.0, 1.5, 0.5]) * np.exp(1j * angles)
    assert abs(crossover([0.1, 1.0, 2.0], loop).phase_margin) < math.pi


@pytest.mark.parametrize("turn", [-1.5, 0.0, 1.5, 3.13, 4.0])
def test_the_margin_does_not_hang_on_the_phase_of_the_lowest_and_noisiest_sine(turn):
    gain, delay = 2.0, 0.25
    frequencies = np.array([0.2, 0.5, 1.0, 2.1, 4.0])
    loop = gain / (1j * frequencies) * np.exp(-1j * frequencies * delay)
    loop[0] *= np.exp(1j * turn)
    margin = crossover(frequencies.tolist(), loop).phase_margin
    assert margin == pytest.approx(math.pi / 2 - gain * delay, abs=0.02)


@pytest.mark.parametrize("delay", [0.1, 0.5, 1.0, 2.0, 4.0])
def test_the_margin_is_never_more_than_half_a_turn(delay):
    frequencies = np.arange(0.2, 4.0, 0.3)
    loop = 2.0 / (1j * frequencies) * np.exp(-1j * frequencies * delay)
    margin = crossover(frequencies.tolist(), loop).phase_margin
    wanted = math.remainder(math.pi / 2 - 2.0 * delay, 2.0 * math.pi)
    assert margin == pytest.approx(wanted, abs=0.05)


def test_the_margin_of_a_loop_measured_with_noise_is_right_within_a_quarter_of_a_radian():
    frequencies = np.array([0.2, 0.5, 1.0, 2.0, 4.0])
    true = 1.5 / (1j * frequencies) * np.exp(-0.4j * frequencies)
    rng = np.random.default_rng(1)
    for _ in range(50):
        noise = rng.normal(size=(2, 5)) @ np.diag([2.0, 0.3, 0.05, 0.05, 0.05])
        found = crossover(frequencies.tolist(), true * np.exp(noise[0] * 0.2 + 1j * noise[1]))
        assert found.phase_margin == pytest.approx(math.pi / 2 - 1.5 * 0.4, abs=0.25)


def test_a_loop_whose_gain_is_never_one_has_no_crossover():
    found = crossover([1.0, 2.0], np.array([0.5 + 0j, 0.2 + 0j]))
    assert math.isnan(found.frequency)


def test_the_open_loop_of_a_known_closed_loop_is_found_at_each_frequency():
    dt, base = 0.02, 2.0 * math.pi / 60.0
    frequencies = [3 * base, 11 * base, 40 * base]
    times = np.arange(0.0, 60.0, dt)
    target = sum(np.sin(w * times) for w in frequencies)
    closed = [1.0 / (1.0 + 1j * w / 2.0) for w in frequencies]  # of an open loop 2 / s
    cursor = sum(
        np.imag(h * np.exp(1j * w * times)) for w, h in zip(frequencies, closed, strict=True)
    )
    loop = open_loop(target, cursor, dt, frequencies)
    assert loop == pytest.approx([2.0 / (1j * w) for w in frequencies], rel=1e-6)
