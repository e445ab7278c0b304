"""The model plays conditions as closed forms say, at the depth that a condition asks for."""

import math

import pytest

from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.prediction import depth_for, predict


def asks(**changes):
    settings = {"hz": 10, "timeout_ms": 2500, "attempts": 3, "dur_s": 12.0} | changes
    return Condition("req", **settings)


@pytest.mark.parametrize("depth", ["message", "segment"])
def test_a_requester_applies_a_command_each_round_trip_and_service(depth):
    """100 ms there, 5 ms of work, 100 ms back: 1 / 0.205 s = 4.88 a second."""
    found = predict(asks(delay_ms=100), 1, depth)
    assert found["applied_hz"] == pytest.approx(4.88, abs=0.09)
    assert found["age_p50"] == pytest.approx(105.1, abs=0.1)
    assert found["rtt_p50"] == pytest.approx(205.2, abs=0.1)


def test_a_packet_takes_its_time_on_a_slow_line():
    """463 bytes at 64 kbit/s take 57.9 ms."""
    assert predict(asks(rate_kbit=64), 1)["age_p50"] == pytest.approx(57.9 + 5, abs=0.2)


@pytest.mark.parametrize("depth", ["message", "segment"])
def test_a_slow_joiner_loses_what_is_published_in_four_round_trips(depth):
    """2.008 s at 50 a second: commands 0 to 100."""
    joins = Condition("pub", 50, delay_ms=251, wait_hs=False, warm_s=0, dur_s=4)
    assert predict(joins, 1, depth)["first_seq"] == 101


def test_a_slow_robot_falls_behind_without_bound_unless_the_latest_wins():
    """Half a second for each of ten a second: four fifths of the time behind."""
    plain = predict(Condition("pub", 10, proc_ms=500, dur_s=20), 1)
    latest = predict(Condition("pub", 10, proc_ms=500, dur_s=20, conflate="rob"), 1)
    assert plain["age_p95"] == pytest.approx(0.8 * 20_000, rel=0.05)
    assert latest["age_p95"] < 610


def test_a_robot_slower_than_the_timeout_executes_the_same_command_again():
    """Only five of 13 applications in 40 s are of different commands."""
    found = predict(asks(proc_ms=3000, timeout_ms=2500, dur_s=40), 1)
    assert (found["n_applied"], found["n_distinct"]) == (13, 5)
    assert (found["timeouts"], found["alerts"]) == (16, 5)


def test_a_timeout_below_the_handshake_ends_all_control_after_one_failure():
    """A new socket needs 1.5 s before its request leaves, and is closed after 1 s."""
    found = predict(asks(delay_ms=250, proc_ms=500, timeout_ms=1000, dur_s=20), 1)
    assert found["n_applied"] == 0
    assert (found["timeouts"], found["alerts"]) == (20, 6)


def test_a_run_ends_with_the_last_command_sent():
    """The last of 120 published commands is never applied."""
    assert predict(Condition("pub", 10, dur_s=12), 1)["n_applied"] == 119


def test_messages_are_enough_where_nothing_is_lost_late_or_piled_up():
    assert depth_for(asks(delay_ms=100)) == "message"
    assert depth_for(Condition("pub", 10, delay_ms=100)) == "message"


@pytest.mark.parametrize(
    "changes",
    [
        {"loss": 0.01},
        {"delay_ms": 50, "jitter_frac": 0.2},
        {"rate_kbit": 32},
        {"proc_ms": 200},
        {"sndbuf": 4096},
        {"hz": 50, "delay_ms": 250},  # 25 packets under way, more than the initial window
    ],
)
def test_otherwise_segments_are_played(changes):
    condition = Condition(**{"pattern": "pub", "hz": 10} | changes)
    assert depth_for(condition) == "segment"
    assert depth_for(condition, "message") == "message"


def test_the_same_seed_gives_the_same_run_and_another_one_another():
    lossy = Condition("pub", 10, loss=0.1, delay_ms=50, dur_s=12)
    one, again, other = (predict(lossy, seed) for seed in (1, 1, 2))
    assert str(one) == str(again)
    assert one["age_mean"] != other["age_mean"]


def test_datagrams_neither_wait_nor_come_again():
    lossy = Condition("pub", 10, loss=0.1, delay_ms=50, dur_s=40)
    found = predict(lossy, 1, "datagram")
    assert found["age_p95"] == pytest.approx(55.1, abs=0.1)
    assert 0.8 < found["n_distinct"] / found["n_sent"] < 0.97


def test_a_mechanism_is_left_out_by_its_name():
    lossy = Condition("pub", 50, loss=0.05, delay_ms=50, dur_s=12)
    assert predict(lossy, 1, without=["RACK"]) != predict(lossy, 1)


def test_what_never_happened_has_no_age():
    livelock = asks(delay_ms=250, proc_ms=500, timeout_ms=1000, dur_s=20)
    assert math.isnan(predict(livelock, 1)["age_p50"])
