"""Results of command runs, counted by hand."""

import math

import pytest

from dva_sim.network.pattern_runs import RunLog, measure_log


def log() -> RunLog:
    """Six commands, one a second from 10 s on; 1 is never applied, 2 twice, 5 too late."""
    issued = [10.0, 11.0, 12.0, 13.0, 14.0, 15.0]
    applied = [(0, 10.5), (2, 12.5), (2, 12.75), (3, 13.5), (4, 14.5), (5, 15.5)]
    return RunLog(start=10.0, issued=issued, applied=applied)


def test_only_what_happens_within_the_window_counts():
    found = measure_log(log(), warm_s=1.0, dur_s=4.0)
    assert (found["n_sent"], found["n_applied"], found["n_distinct"], found["dup"]) == (4, 4, 3, 1)
    assert (found["send_hz"], found["applied_hz"]) == (1.0, 0.75)
    assert found["first_seq"] == 0


def test_ages_count_from_the_first_sending():
    found = measure_log(log(), warm_s=1.0, dur_s=4.0)
    assert found["age_mean"] == pytest.approx((500 + 750 + 500 + 500) / 4)


def test_of_the_commands_before_the_last_one_applied_a_share_is_skipped():
    assert measure_log(log(), warm_s=1.0, dur_s=4.0)["skip_frac"] == pytest.approx(1 / 4)


def test_gaps_end_where_the_window_does():
    found = measure_log(log(), warm_s=1.0, dur_s=4.0)  # 11 | 12.5 12.75 13.5 14.5 | 15
    assert found["gap_max"] == pytest.approx(1500)


def test_a_round_trip_belongs_to_the_window_its_command_was_sent_in():
    early = RunLog(issued=[0.0, 2.0, 3.0], replied=[(0, 1.9), (1, 2.5), (2, 9.0)])
    found = measure_log(early, warm_s=1.0, dur_s=4.0)
    assert found["rtt_p50"] == pytest.approx(500)


def test_before_anything_is_applied_the_age_in_force_counts_from_the_start():
    found = measure_log(RunLog(issued=[0.0]), warm_s=1.0, dur_s=2.0)
    assert found["stale_mean"] == pytest.approx(1997.5)
    assert math.isnan(found["age_p50"])


def test_what_is_applied_at_the_moment_of_a_look_is_not_seen_by_it():
    """Each command is applied 10 ms after its issue, just when somebody looks."""
    issued = [0.02 * k for k in range(100)]
    applied = [(k, at + 0.01) for k, at in enumerate(issued)]
    found = measure_log(RunLog(issued=issued, applied=applied), warm_s=0.5, dur_s=1.0)
    assert found["stale_p50"] == pytest.approx(22.5, abs=0.1)  # of 15, 20, 25 and 30


def test_timeouts_and_alerts_belong_to_the_window_they_happen_in():
    asked = RunLog(issued=[0.0], timeouts=[0.5, 1.0, 1.5, 6.0], alerts=[1.5])
    found = measure_log(asked, warm_s=1.0, dur_s=4.0)
    assert (found["timeouts"], found["alerts"]) == (2, 1)
