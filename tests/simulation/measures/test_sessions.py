"""Measures of a session, computed by hand."""

import math

import pytest

from dva_sim.kernel.config import validate
from dva_sim.network.transports import Contest, ContestConfig, Fates
from dva_sim.simulation.measures.sessions import (
    contest_row,
    flow_rows,
    jain,
)


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
