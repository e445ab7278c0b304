"""Measures, controls and recursions on runs small enough to add up by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dva_sim.simulation.timed import build, simulate_timed
from dva_sim.validation.dispatch.batch_measures import (
    Batches,
    Sample,
    extract_sample,
    many_servers,
    occupied,
    one_server,
    sums,
)
from dva_sim.validation.dispatch.estimation import controls, inputs

NAN = math.nan


def a_run():
    """Two units; 5 events from 0 to 40 s, of which the fourth gives up and the last is lost."""
    return Sample(
        streams=("fire", "flood"),
        units=("a", "b"),
        groups=("team", "team"),
        kinds=("guard", "guard"),
        operators=0,
        sources=0,
        begins=0.0,
        ends=40.0,
        stream=np.array([0, 1, 0, 0, 1]),
        unit=np.array([0, 1, 0, -1, -1]),
        outcome=np.array(["confirmed", "confirmed", "refuted", "expired", "escalated"]),
        detected=np.array([1.0, 5.0, 6.0, 22.0, 30.0]),
        assigned=np.array([1.0, 5.0, 11.0, NAN, NAN]),
        arrived=np.array([3.0, 6.0, 13.0, NAN, NAN]),
        confirmed=np.array([11.0, 25.0, 21.0, NAN, NAN]),
        act_assigned=np.full(5, NAN),
        act_arrived=np.full(5, NAN),
        closed=np.array([11.0, 25.0, 21.0, 27.0, 30.0]),
        busy_unit=np.array([0, 1, 0]),
        busy_from=np.array([1.0, 5.0, 11.0]),
        busy_until=np.array([11.0, 25.0, 21.0]),
    )


def ratio(name, run=None, count=2):
    tops, bottoms = sums(name, Batches(run or a_run(), count))
    return tops.sum() / bottoms.sum()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("wait_s", 5 / 3),
        ("wait_s@fire", 5 / 2),
        ("travel_s", 5 / 3),
        ("response_s", 10 / 3),
        ("stay_s", 45 / 3),
        ("wait_all_s", 10 / 5),
        ("delayed", 2 / 4),  # who is turned away at once does not count
        ("lost", 1 / 5),
        ("abandoned", 1 / 5),
        ("wait_beyond/4", 1 / 3),
        ("workload/a", 20 / 40),
        ("workload/b", 20 / 40),
        ("utilisation", 40 / 80),
        ("utilisation/team", 40 / 80),
        ("share/a/fire", 2 / 3),
        ("open", 50 / 40),
    ],
)
def test_a_measure_is_what_one_adds_up_by_hand(name, value):
    assert ratio(name) == pytest.approx(value)


def test_an_event_belongs_to_the_batch_it_was_detected_in():
    tops, bottoms = sums("stay_s", Batches(a_run(), 2))
    assert tops.tolist() == [45.0, 0.0]
    assert bottoms.tolist() == [3.0, 0.0]


def test_busy_time_belongs_to_the_batch_it_was_spent_in():
    tops, _ = sums("workload/b", Batches(a_run(), 2))
    assert tops.tolist() == [15.0, 5.0]


def test_what_happens_before_the_measured_time_is_left_out():
    run = replace(a_run(), begins=6.0, ends=40.0)
    assert sums("wait_s", Batches(run, 1))[1].tolist() == [1.0]
    assert sums("workload/a", Batches(run, 1))[0].tolist() == [15.0]


def test_robots_occupy_operators():
    run = replace(a_run(), kinds=("guard", "robot"), operators=1)
    assert ratio("utilisation/operators", run) == pytest.approx(20 / 40)


def test_sources_without_an_open_event_rest():
    assert ratio("resting", replace(a_run(), sources=3)) == pytest.approx(3 - 50 / 40)


def test_ways_to_what_happened_at_one_moment_are_added_up():
    run = replace(a_run(), detected=np.array([1.0, 1.0, 6.0, 22.0, 30.0]))
    tops, bottoms = sums("total_s", Batches(run, 1))
    assert tops.tolist() == [5.0]
    assert bottoms.tolist() == [4.0]


def test_intervals_that_have_not_ended_last_to_the_end():
    inside = occupied(np.array([2.0, 8.0]), np.array([5.0, NAN]), np.array([0.0, 4.0, 12.0]))
    assert inside.tolist() == [2.0, 1.0 + 4.0]


RANDOM = {"law": "exponential", "mean_s": 2.0}


def test_one_server_goes_by_rank_and_then_by_who_came_first():
    times, services = np.array([0.0, 1.0, 2.0, 3.0]), np.full(4, 5.0)
    assert one_server(times, services, np.zeros(4, int)).tolist() == [0, 4, 8, 12]
    assert one_server(times, services, np.array([0, 1, 0, 0])).tolist() == [0, 14, 3, 7]


def test_a_late_customer_finds_one_server_idle():
    waits = one_server(np.array([0.0, 20.0]), np.array([5.0, 5.0]), np.zeros(2, int))
    assert waits.tolist() == [0, 0]


def test_several_servers_take_turns():
    times, services = np.array([0.0, 1.0, 2.0, 3.0]), np.full(4, 5.0)
    assert many_servers(times, services, 2).tolist() == [0, 0, 3, 3]


def test_with_one_server_both_recursions_agree():
    rng = np.random.default_rng(7)
    times, services = np.cumsum(rng.exponential(size=500)), rng.exponential(0.8, size=500)
    one = one_server(times, services, np.zeros(500, int))
    assert one == pytest.approx(many_servers(times, services, 1), abs=1e-9)


def a_sample(seed, **changes):
    scenario = build(
        {
            "model": "timed",
            "responders": [{"name": "guard", "count": 2, "look": RANDOM | {"mean_s": 2.4}}],
            "demand": [{"between": RANDOM}],
            "warm_up_s": 40,
            "horizon_s": 840,
            "drain": True,
        }
        | changes
    )
    return extract_sample(simulate_timed(scenario, seed)), scenario


def test_a_run_is_read_as_it_was_recorded():
    sample, scenario = a_sample(1)
    assert sample.units == ("guard-1", "guard-2")
    assert sample.served.all()
    assert (np.diff(sample.detected) >= 0).all()
    recording = simulate_timed(scenario, 1)
    tops, bottoms = sums("wait_s", Batches(sample, 4))
    assert tops.sum() / bottoms.sum() == pytest.approx(recording.mean("wait"))
    busy = sums("workload/guard-2", Batches(sample, 1))[0].sum()
    assert busy == pytest.approx(recording.units[1].busy)
    waiting = occupied(sample.detected, sample.assigned, np.array([40.0, 840.0]))
    assert waiting.sum() == pytest.approx(sample.waiting_area)


def test_the_way_back_is_work_for_who_returns():
    ground = {"area": {"width_m": 60, "height_m": 60}}
    team = [{"name": "guard", "base": [30, 30], "after": "return", "look": 2}]
    often = [{"between": {"law": "exponential", "mean_s": 90}}]
    sample, scenario = a_sample(2, responders=team, demand=often, **ground)
    busy = sums("workload/guard", Batches(sample, 1))[0].sum()
    assert busy == pytest.approx(simulate_timed(scenario, 2).units[0].busy, rel=1e-6)


@pytest.mark.soak
@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({}, {"beside@0", "look", "events"}),
        ({"dispatch": {"escalate_after_s": 0}}, {"look", "events", "row_10", "look_square"}),
    ],
)
def test_controls_have_mean_zero(changes, names):
    totals = [
        {k: v.sum() for k, v in controls(Batches(s, 1), c).items()}
        for s, c in (a_sample(seed, **changes) for seed in range(30))
    ]
    assert names <= totals[0].keys()
    for name in totals[0]:
        values = np.array([total[name] for total in totals])
        assert abs(values.mean()) < 3.5 * values.std() / math.sqrt(30), name


def test_what_was_put_in_is_counted_beside_what_was_expected():
    sample, scenario = a_sample(3)
    found = inputs(Batches(sample, 4), scenario)
    assert found["events of fire"][1].sum() == pytest.approx(800 / 2)
    came, looked = found["events of fire"][0].sum(), found["looking"][1].sum()
    assert looked == pytest.approx(2.4 * came)
