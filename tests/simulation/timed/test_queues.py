"""Queues whose course can be worked out by hand: the core adds nothing and loses nothing."""

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.optimize import linear_sum_assignment

from dva_sim.kernel.streams import Streams
from dva_sim.simulation.timed import TimedRecording, build, simulate_timed
from dva_sim.simulation.timed.distributions import Law
from dva_sim.simulation.timed.draws import times

POISSON = {"law": "exponential", "mean_s": 10.0}


def play(seed: int = 1, policy: Any = None, **given: Any) -> TimedRecording:
    """A single server at no distance, unless given otherwise."""
    scenario: dict[str, Any] = {
        "model": "timed",
        "responders": [{"name": "server"}],
        "demand": [{"between": 10}],
        "horizon_s": 100,
    }
    recording = simulate_timed(build(scenario | given), seed, policy)
    assert not recording.violations
    return recording


def waits(recording: TimedRecording) -> list[float]:
    return (recording.columns["assigned"] - recording.columns["detected"]).round(6).tolist()


def test_one_server_that_takes_15_s_falls_5_s_further_behind_with_each_event_every_10_s():
    recording = play(responders=[{"name": "server", "look": 15}], drain=True)
    assert recording.columns["occurred"].tolist() == [10.0 * k for k in range(1, 11)]
    assert waits(recording) == [5.0 * k for k in range(10)]
    assert recording.count("confirmed") == 10
    assert recording.utilisation(0) == 0.9  # from 10 s to the horizon at 100 s


def test_waits_are_those_of_lindley_s_recursion_on_the_same_random_numbers():
    """W(n+1) = max(0, W(n) + S(n) - A(n)), with services and arrivals as they were drawn.

    References:
        D. V. Lindley, "The theory of queues with a single server", 1952.
    """
    look = {"law": "gamma", "mean_s": 8, "shape": 0.7}
    recording = play(
        responders=[{"name": "server", "look": look}],
        demand=[{"between": POISSON}],
        horizon_s=8_000,
        drain=True,
    )
    arrival = recording.columns["detected"]
    service = recording.columns["confirmed"] - recording.columns["arrived"]
    expected = [0.0]
    for k in range(len(arrival) - 1):
        gap = arrival[k + 1] - arrival[k]
        expected.append(max(0.0, expected[-1] + service[k] - gap))
    assert len(expected) > 700
    assert np.abs(np.array(waits(recording)) - expected).max() < 1e-2  # microseconds add up


def test_the_integral_of_how_many_wait_is_the_sum_of_the_waits():
    """Little's law as an identity: nothing before the measured time, and nothing after it."""
    recording = play(
        responders=[{"name": "server", "count": 2, "look": {"law": "exponential", "mean_s": 17}}],
        demand=[{"between": POISSON, "until_s": 5000}],
        horizon_s=10_000,
    )
    count, waited, _ = recording.total("wait")
    assert count == recording.events > 400
    assert recording.waiting.sum() == pytest.approx(waited, abs=1e-6 * count)
    _, stayed, _ = recording.total("sojourn")
    total = recording.waiting.sum() + recording.served.sum()
    assert total == pytest.approx(stayed, abs=1e-6 * count)
    assert sum(u.busy for u in recording.units) == pytest.approx(recording.served.sum(), abs=1e-3)


def test_all_times_twice_as_long_give_responses_twice_as_long():
    def run(scale: float) -> TimedRecording:
        return play(
            area={"width_m": 100, "height_m": 50},
            responders=[
                {
                    "name": "guard",
                    "count": 3,
                    "base": "random",
                    "speed_mps": 1.5 / scale,
                    "mobilisation": {"law": "lognormal", "median_s": 20 * scale, "spread": 0.4},
                    "look": {"law": "exponential", "mean_s": 30 * scale},
                }
            ],
            demand=[{"between": {"law": "exponential", "mean_s": 60 * scale}}],
            horizon_s=10_000 * scale,
            dispatch={"escalate_after_s": 120 * scale},
            drain=True,
        )

    one, two = run(1.0), run(2.0)
    assert one.events > 100
    for name in ("occurred", "detected", "assigned", "departed", "arrived", "confirmed", "closed"):
        assert two.columns[name] == pytest.approx(2 * one.columns[name], abs=1e-3, nan_ok=True)
    assert (one.columns["outcome"] == two.columns["outcome"]).all()


def test_the_third_of_three_at_once_finds_no_place_where_one_may_wait():
    recording = play(
        responders=[{"name": "server", "look": 50}],
        demand=[{"batch": {"count": 3, "at_s": 5}}],
        dispatch={"most_waiting": 1},
        drain=True,
    )
    assert recording.count("confirmed") == 2
    assert recording.count("escalated") == 1
    assert recording.columns["closed"][2] == 5.0


def test_where_nobody_may_wait_what_finds_nobody_free_is_lost_at_once():
    recording = play(
        responders=[{"name": "server", "look": 25}],
        dispatch={"escalate_after_s": 0},
        horizon_s=90,
        drain=True,
    )
    lost = (recording.columns["closed"] == recording.columns["detected"]).tolist()
    assert lost == [False, True, True] * 3
    assert recording.count("escalated") == 6


def test_an_event_that_waits_20_s_for_somebody_is_escalated_exactly_then():
    recording = play(
        responders=[{"name": "server", "look": 1000}],
        demand=[{"batch": {"count": 2}}],
        dispatch={"escalate_after_s": 20},
    )
    assert recording.columns["closed"][1] == pytest.approx(20.0, abs=2e-6)
    assert recording.count("escalated") == 1


def test_who_loses_patience_takes_the_report_back_and_an_event_nobody_was_sent_to_expires():
    recording = play(
        responders=[{"name": "server", "look": 12}],
        demand=[{"batch": {"count": 3}, "patience": 20}],
        drain=True,
    )
    # One is served at once, one after 12 s; the third would have to wait 24 s.
    assert [recording.count(o) for o in ("confirmed", "expired")] == [2, 1]
    assert recording.columns["closed"].tolist() == [12.0, 24.0, 20.0]


def test_an_event_that_two_have_reported_is_one_and_expires_when_both_take_it_back():
    recording = play(
        responders=[{"name": "server", "look": 1000}],
        demand=[{"batch": {"count": 2}, "patience": 20, "repeats": {"share": 1, "after": 5}}],
    )
    assert recording.events == 2
    assert recording.columns["reports"].tolist() == [2, 2]
    assert recording.count("expired") == 1
    assert recording.columns["closed"][1] == 20.0


def test_reports_of_two_events_near_each_other_are_one_to_the_dva():
    """The second shares the first's fate, and nothing is lost."""
    recording = play(
        area={"width_m": 3, "height_m": 3},
        responders=[{"name": "guard", "look": 30}],
        demand=[{"batch": {"count": 2}}],
        dispatch={"merge_distance_m": 8},
        drain=True,
    )
    assert recording.columns["shared"].tolist() == [0, 1]
    assert recording.columns["event"].tolist() == [1, 1]
    assert recording.count("confirmed") == 2


def test_severe_events_are_served_first_by_a_policy_that_looks_at_severity():
    recording = play(
        responders=[{"name": "server", "look": 10}],
        demand=[
            {"name": "minor", "batch": {"count": 3}, "severity": 0.1},
            {"name": "major", "batch": {"count": 2, "at_s": 5}, "severity": 0.9},
        ],
        dispatch={"policy": "priority_eta"},
        drain=True,
    )
    by_stream = [recording.columns["assigned"][recording.columns["stream"] == s] for s in (0, 1)]
    assert by_stream[0].tolist() == [0.0, 30.0, 40.0]
    assert by_stream[1].tolist() == [10.0, 20.0]


def test_each_of_three_sources_rests_40_s_after_its_event_was_closed():
    recording = play(
        responders=[{"name": "server", "look": 10}],
        demand=[{"sources": {"count": 3, "rest": 40}}],
        horizon_s=120,
    )
    # All three at 40 s, closed at 50, 60 and 70; then again 40 s later each.
    assert recording.columns["occurred"].tolist() == [40, 40, 40, 90, 100, 110]


def test_a_batch_that_waits_for_the_shift_to_begin_is_decided_as_one():
    """Times are drawn for each pair; the least sum of them is found over all pairs."""
    travel = {"law": "exponential", "mean_s": 100.0}
    recording = play(
        travel=travel,
        responders=[{"name": "guard", "count": 6, "from_s": 10}],
        demand=[{"batch": {"count": 6}}],
        dispatch={"policy": "batch_optimal"},
        horizon_s=3000,
        drain=True,
    )
    law = TypeAdapter(Law).validate_python(travel)
    draws = [times(Streams(1), f"demand/fire/travel/guard-{g}", law) for g in range(1, 7)]
    cost = np.array([[draws[g][event] for g in range(6)] for event in range(6)])
    columns = recording.columns
    assert columns["assigned"].tolist() == [10.0] * 6
    assert sorted(columns["responder"].tolist()) == list(range(6))
    taken = (columns["arrived"] - columns["departed"]).sum()
    assert taken == pytest.approx(cost[linear_sum_assignment(cost)].sum(), abs=1e-4)


def test_batches_hold_the_same_sums_as_rows_do():
    given = {
        "responders": [{"name": "server", "look": {"law": "exponential", "mean_s": 8}}],
        "demand": [{"between": POISSON}],
        "horizon_s": 4000,
        "warm_up_s": 500,
        "batches": 5,
    }
    rows, sums = play(**given), play(**given, keep="batches")
    assert not sums.columns
    assert (rows.cells == sums.cells).all()
    assert (rows.outcomes == sums.outcomes).all()
    kept = rows.columns["assigned"] - rows.columns["detected"]
    kept = kept[rows.measured & ~np.isnan(kept)]
    assert sums.mean("wait") == pytest.approx(kept.mean())
    assert sums.waited() == pytest.approx((kept > 1e-9).mean())
    assert sums.waiting.shape == (1, 5)
