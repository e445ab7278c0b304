import dataclasses

import pytest

from dva_sim.network.condition import RESULTS, Condition
from dva_sim.network.exchange import Exchange

CONDITION = Condition("pub", 1, warm_s=1, dur_s=4)
ASKING = Condition("req", 1, timeout_ms=500, attempts=3, warm_s=1, dur_s=4)


def run() -> Exchange:
    """Six commands, one a second from 10 s on; 1 is lost, 2 comes twice, 5 never."""
    issued = [10.0, 11.0, 12.0, 13.0, 14.0, 15.0]
    applied = [(0, 10.5), (2, 12.5), (2, 12.75), (3, 13.5), (4, 14.5), (5, 15.5)]
    return Exchange(10.0, 10.0, None, None, issued, applied)


def test_only_what_happens_within_the_window_is_counted() -> None:
    row = run().results(CONDITION)
    assert list(row) == list(RESULTS)
    assert (row["n_sent"], row["n_applied"], row["n_distinct"], row["dup"]) == (4, 4, 3, 1)
    assert (row["send_hz"], row["applied_hz"], row["first_seq"]) == (1.0, 1.0, 0)


def test_age_counts_from_the_first_issue() -> None:
    row = run().results(CONDITION)
    assert row["age_p50"] == pytest.approx(500)
    assert row["age_mean"] == pytest.approx((500 + 750 + 500 + 500) / 4)


def test_a_command_is_skipped_when_a_later_one_was_applied() -> None:
    """Of the commands 1 to 4 of the window, 1 never came."""
    assert run().results(CONDITION)["skip_frac"] == pytest.approx(1 / 4)


def test_gaps_end_at_the_edges_of_the_window() -> None:
    row = run().results(CONDITION)  # 11 | 12.5 12.75 13.5 14.5 | 15
    assert row["gap_max"] == pytest.approx(1500)
    late = dataclasses.replace(run(), applied=[])
    assert late.results(CONDITION)["gap_max"] == pytest.approx(4000)


def test_the_command_in_force_ages_until_the_next_is_applied() -> None:
    """From 11 to 12.5 s it is command 0, then by turns 2, 3 and 4."""
    row = run().results(CONDITION)
    shares = [(1.5, 1.0, 2.5), (1.0, 0.5, 1.5), (1.0, 0.5, 1.5), (0.5, 0.5, 1.0)]
    mean = sum(length * (low + high) / 2 for length, low, high in shares) / 4
    assert row["stale_mean"] == pytest.approx(1e3 * mean, abs=3)


def test_where_nothing_was_applied_the_age_in_force_counts_from_the_start() -> None:
    row = dataclasses.replace(run(), applied=[]).results(CONDITION)
    assert row["stale_mean"] == pytest.approx(3e3, abs=3)
    assert row["age_p50"] is None
    assert row["skip_frac"] is None
    assert row["first_seq"] is None


def test_timeouts_and_alerts_belong_to_a_requester() -> None:
    asked = dataclasses.replace(run(), timeouts=[10.5, 11.5, 14.0], alerts=[14.5])
    row = asked.results(ASKING)
    assert (row["timeouts"], row["alerts"]) == (2, 1)
    assert asked.results(CONDITION)["timeouts"] is None


def test_a_round_trip_ends_with_the_reply() -> None:
    asked = dataclasses.replace(run(), replies=[(0, 10.6), (3, 13.8)])
    assert asked.results(ASKING)["rtt_p50"] == pytest.approx(800)


def test_the_handshake_counts_from_the_call_that_connects() -> None:
    waited = dataclasses.replace(run(), opened=9.0, connected=9.1, handshake=9.3)
    row = waited.results(CONDITION)
    assert (row["t_conn_ms"], row["t_hs_ms"]) == (pytest.approx(100), pytest.approx(300))
    assert run().results(CONDITION)["t_hs_ms"] is None
