import math

import numpy as np
import pytest

from dva_sim.simulation.task.movement_laws import (
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
    """The phase of the lowest frequency is noise here, which shifts the others by a turn."""
    loop = np.array([4.0, 1.5, 0.5]) * np.exp(1j * np.radians([80.0, -160.0, -150.0]))
    assert 20.0 < math.degrees(crossover([0.1, 1.0, 2.0], loop).phase_margin) < 30.0


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
