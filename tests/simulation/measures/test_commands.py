"""Commands that took effect, and what answered them, by hand."""

import math

import numpy as np
import pytest

from dva_sim.simulation.measures.commands import applied, restricted_mean, round_trips


def times(*values: float) -> np.ndarray:
    return np.array(values)


def test_what_a_newer_one_has_overtaken_and_what_never_came_is_not_applied():
    arrived = times(1.0, 4.0, 3.0, math.inf, 5.0)
    assert applied(arrived).tolist() == [True, False, True, False, True]


def test_commands_read_at_the_same_moment_are_all_applied():
    assert applied(times(2.0, 2.0, 2.0)).all()


def test_a_round_trip_lasts_until_the_first_picture_taken_after_the_command_was_applied():
    # applied at 1.2; the picture of 1.1 was too early, that of 1.4 is there at 1.9
    trips = round_trips(times(1.0), times(1.2), times(1.1, 1.4), times(1.6, 1.9))
    assert trips == pytest.approx([0.9])


def test_a_later_picture_stands_in_for_one_that_was_lost():
    trips = round_trips(times(1.0), times(1.2), times(1.3, 1.5), times(math.inf, 2.0))
    assert trips == pytest.approx([1.0])


def test_a_command_that_nothing_shows_any_more_has_no_round_trip():
    assert len(round_trips(times(1.0), times(1.2), times(1.1), times(1.6))) == 0


def test_what_never_came_counts_the_whole_horizon():
    assert restricted_mean([10.0, math.nan], 30.0) == 20.0
    assert math.isnan(restricted_mean([], 30.0))
