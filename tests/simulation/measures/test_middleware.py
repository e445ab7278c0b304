"""Commands and pictures over middleware, by hand."""

import math

import numpy as np
import pytest

from dva_sim.simulation.measures.middleware import command_row, picture_row
from dva_sim.simulation.middleware.run import Window

WINDOW = Window(0.0, 2.0, 6.0)


def row(made, applied):
    arrays = (np.array(made, dtype=float), np.array(applied, dtype=float))
    return command_row(*arrays, WINDOW, max_age_s=1.0, watchdog_s=1.0)


def test_commands_in_step_are_as_old_as_the_link_and_half_a_period():
    made = np.arange(0.0, 6.0, 0.1)
    found = row(made, made + 0.05)
    assert found["command_rate_hz"] == pytest.approx(10.0, abs=0.3)
    assert found["command_age_p95_s"] == pytest.approx(0.05)
    assert found["age_in_force_mean_s"] == pytest.approx(0.1)
    assert found["age_in_force_p50_s"] == pytest.approx(0.1)
    assert found["age_in_force_p95_s"] == pytest.approx(0.145)
    assert found["longest_gap_s"] == pytest.approx(0.1)
    assert (found["false_stops"], found["too_old_share"]) == (0, 0.0)


def test_what_arrives_after_a_newer_one_is_outdated():
    found = row([1.0, 3.0, 2.0, 4.0], [3.0, 3.5, 3.6, 4.5])
    assert found["outdated_share"] == 0.25
    assert found["command_rate_hz"] == 0.75


def test_silence_counts_from_the_edges_of_the_window_and_stops_the_robot_each_time():
    found = row([1.0, 4.0], [1.5, 4.5])
    assert found["longest_gap_s"] == pytest.approx(2.5)
    assert found["false_stops"] == 2
    assert found["command_rate_hz"] == pytest.approx(0.25)


def test_where_nothing_ever_arrives_the_age_is_that_of_the_run():
    found = row([], [])
    assert found["age_in_force_p50_s"] == pytest.approx(4.0)
    assert found["too_old_share"] == 1.0
    assert found["longest_gap_s"] == 4.0
    assert math.isnan(found["command_age_p50_s"])


def test_pictures_count_when_they_are_shown_in_the_window():
    found = picture_row(np.array([1.0, 2.0, 5.9]), np.array([1.5, 2.1, 6.2]), WINDOW)
    assert found["picture_rate_hz"] == 0.25
    assert found["picture_age_p50_s"] == pytest.approx(0.1)
