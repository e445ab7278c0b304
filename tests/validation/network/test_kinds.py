"""Rules of judgement depend on the settings of a condition, never on its results."""

from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.reference import SocketRun
from dva_sim.validation.network.verdicts import (
    grouped,
    is_bounded,
    load,
    may_livelock,
    why_not_judged,
)


def run(condition, seed=1, group="S", independent=True):
    return SocketRun(condition, "reference", group, seed, independent, True, {})


def asks(**changes):
    settings = {"hz": 10, "timeout_ms": 1000, "attempts": 3} | changes
    return Condition("req", **settings)


def test_six_seeds_of_their_own_make_a_lossy_condition_a_pooled_one():
    lossy = Condition("pub", 10, loss=0.05)
    assert [g.kind for g in grouped([run(lossy, seed) for seed in range(6)])] == ["pooled"]
    assert [g.kind for g in grouped([run(lossy, seed) for seed in range(5)])] == ["single"]


def test_runs_that_share_their_random_numbers_are_set_aside_where_others_do_not():
    lossy = Condition("pub", 10, loss=0.05)
    [group] = grouped([run(lossy, 1, "D", independent=False), run(lossy, 7)])
    assert [r.seed for r in group.runs] == [7]
    assert not group.left_out


def test_under_loss_shared_random_numbers_alone_says_nothing():
    lossy = Condition("pub", 10, loss=0.05)
    [group] = grouped([run(lossy, 1, "D", independent=False)])
    assert "random numbers" in group.left_out
    [group] = grouped([run(Condition("pub", 10), 1, "D", independent=False)])
    assert not group.left_out


def test_fifty_commands_a_second_are_too_many_for_64_kbit():
    """50 x 461 bytes are 184 kbit/s."""
    assert load(Condition("pub", 50, rate_kbit=64)) > 2.8
    assert load(Condition("pub", 10, rate_kbit=64)) < 0.6


def test_a_requester_asks_too_much_only_of_a_robot_slower_than_its_timeout():
    assert load(asks(proc_ms=3000)) == 3.0
    assert load(asks(proc_ms=500)) == 0.0


def test_the_phase_of_a_robot_in_step_with_its_commands_is_not_judged():
    assert "period" in why_not_judged(Condition("pub", 10, proc_ms=100))
    assert "latest" in why_not_judged(Condition("pub", 50, proc_ms=100, conflate="both"))
    assert not why_not_judged(Condition("pub", 50, proc_ms=100))


def test_a_small_buffer_anywhere_bounds():
    assert not is_bounded(Condition("pub", 10))
    assert is_bounded(Condition("pub", 10, sndbuf=4096))
    assert is_bounded(Condition("pub", 10, conflate="op"))


def test_one_loss_can_end_control_where_the_timeout_is_below_four_round_trips():
    """4 x 200 ms and 5 ms of service."""
    assert may_livelock(asks(delay_ms=100, loss=0.05, timeout_ms=800))
    assert not may_livelock(asks(delay_ms=100, loss=0.05, timeout_ms=810))
    assert not may_livelock(asks(delay_ms=100, timeout_ms=800))
