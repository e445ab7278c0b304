"""Measures of a session, computed by hand."""

import math

import numpy as np
import pytest

from dva_sim.kernel.config import validate
from dva_sim.network.transports import Contest, ContestConfig, Fates
from dva_sim.simulation.transports.session_measures import (
    age_in_force,
    applied,
    contest_row,
    flow_rows,
    jain,
    round_trips,
)


def times(*values: float) -> np.ndarray:
    return np.array(values)


def test_what_a_newer_one_has_overtaken_and_what_never_came_is_not_applied():
    arrived = times(1.0, 4.0, 3.0, math.inf, 5.0)
    assert applied(arrived).tolist() == [True, False, True, False, True]


def test_commands_read_at_the_same_moment_are_all_applied():
    assert applied(times(2.0, 2.0, 2.0)).all()


def test_the_age_in_force_of_a_command_a_second_late_by_a_tenth_is_six_tenths():
    made = np.arange(0.0, 12.0)
    assert age_in_force(made, made + 0.1, 2.0, 10.0) == pytest.approx(0.1 + 0.5)


def test_a_lost_command_lets_the_one_before_it_grow_old():
    made = np.arange(0.0, 12.0)
    arrived = made.copy()
    arrived[5] = math.inf
    # half a second on average, and a second more for the one second of the eight
    assert age_in_force(made, arrived, 2.0, 10.0) == pytest.approx(0.5 + 1.0 / 8)


def test_nothing_in_force_at_the_beginning_has_no_age():
    assert math.isnan(age_in_force(times(0.0), times(5.0), 2.0, 10.0))


def test_a_round_trip_lasts_until_the_first_picture_taken_after_the_command_was_applied():
    # applied at 1.2; the picture of 1.1 was too early, that of 1.4 is there at 1.9
    trips = round_trips(times(1.0), times(1.2), times(1.1, 1.4), times(1.6, 1.9))
    assert trips == pytest.approx([0.9])


def test_a_later_picture_stands_in_for_one_that_was_lost():
    trips = round_trips(times(1.0), times(1.2), times(1.3, 1.5), times(math.inf, 2.0))
    assert trips == pytest.approx([1.0])


def test_a_command_that_nothing_shows_any_more_has_no_round_trip():
    assert len(round_trips(times(1.0), times(1.2), times(1.1), times(1.6))) == 0


@pytest.mark.parametrize(
    ("rates", "index"), [([5.0, 5.0], 1.0), ([1.0, 0.0, 0.0, 0.0], 0.25), ([1.0, 3.0], 0.8)]
)
def test_jains_index(rates, index):
    assert jain(rates) == pytest.approx(index)


def row_and_flows():
    """Three commands, one lost, one overtaken; two pictures; a TCP flow that way."""
    commands = Fates([10.0, 11.0, 12.0], [10.2, math.inf, 12.2], [False, True, True])
    pictures = Fates([10.5, 12.5], [10.6, 12.6], [False, False])
    contest = Contest(
        10.0, 20.0, commands, pictures, {"up": 100, "down": 250_000}, {"up": [], "down": [750_000]}
    )
    return contest_row(validate(ContestConfig, {}), contest), flow_rows(contest)


def test_a_row_holds_shares_ages_and_rates():
    row, _ = row_and_flows()
    assert row["commands"] == 3
    assert row["delivered_share"] == pytest.approx(2 / 3)
    assert row["crucial_delivered_share"] == 0.5
    assert row["command_age_mean_s"] == pytest.approx(0.2)
    assert row["command_rate_hz"] == pytest.approx(0.2)
    assert row["round_trip_mean_s"] == pytest.approx(0.6)
    assert row["session_down_bps"] == 200_000
    assert row["bulk_down_bps"] == 600_000
    assert row["bulk_use_down"] == 0.6
    assert row["share_of_fair_down"] == pytest.approx(0.4)  # 0.2 of a half
    assert row["jain_down"] == pytest.approx(0.8)


def test_where_nobody_competes_there_is_no_fairness():
    row, _ = row_and_flows()
    assert all(math.isnan(row[f"{name}_up"]) for name in ("jain", "bulk_use", "share_of_fair"))


def test_each_flow_has_a_row():
    _, flows = row_and_flows()
    assert [(f["way"], f["flow"], f["rate_bps"]) for f in flows] == [
        ("up", "session", 80.0),
        ("down", "session", 200_000.0),
        ("down", "bulk 1", 600_000.0),
    ]
