"""Workload and steering measures of operators, each by a case computed by hand."""

import math

import numpy as np
import pytest

from dva_sim.kernel.recorder import DriveLog, TrackPoint
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Recording, simulate
from dva_sim.simulation.measures import episodes, workload


def log(ordered: float = 0.0, ended: float | None = None, **more: object) -> DriveLog:
    made = DriveLog("robot", "operator", 1, ordered, ended=ended)
    for name, value in more.items():
        setattr(made, name, value)
    return made


# --- spans of time -----------------------------------------------------------------------------


def test_what_overlaps_is_covered_once():
    spans = [(0.0, 10.0), (5.0, 12.0), (20.0, 21.0), (6.0, 7.0)]
    assert workload.covered(spans) == 13.0
    assert workload.most_at_once(spans) == 3
    assert workload.most_at_once([(0.0, 5.0), (5.0, 9.0)]) == 1
    assert (workload.covered([]), workload.most_at_once([])) == (0.0, 0)


def test_a_robot_waits_for_its_turn_and_then_for_the_eyes():
    """Ordered at 10 s, taken up at 40 s; there at 100 s, and looked at from 125 s on."""
    attended = [(50.0, 60.0), (125.0, 140.0)]
    made = log(10.0, 150.0, taken_up=40.0, waits_from=100.0, attended=attended)
    assert workload.waits(made, 200.0) == [(10.0, 40.0), (100.0, 125.0)]


def test_who_looks_already_keeps_nobody_waiting():
    made = log(10.0, 150.0, taken_up=10.0, waits_from=100.0, attended=[(90.0, 140.0)])
    assert workload.waits(made, 200.0) == []


def test_a_robot_that_nobody_looked_at_waited_to_the_end():
    assert workload.waits(log(0.0, None, taken_up=0.0, waits_from=30.0), 90.0) == [(30.0, 90.0)]


def test_a_look_that_goes_on_lasts_to_the_end_of_the_run():
    assert workload.attended(log(looks_since=7.0, attended=[(1.0, 2.0)]), 9.0) == [
        (1.0, 2.0),
        (7.0, 9.0),
    ]


# --- steering ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "times"),
    [
        ([0.0, 0.3, 0.0, 0.3], 2),
        ([0.0, 0.05, 0.0, 0.05], 0),  # smaller than 0.1 rad/s
        ([0.0, 0.2, 0.15, 0.3, 0.25, 0.4], 0),  # on and on, with small steps back
        ([0.3, 0.0, -0.3, 0.0], 1),
        ([], 0),
    ],
)
def test_a_reversal_is_a_turn_round_of_at_least_a_tenth_of_a_radian_a_second(values, times):
    assert workload.reversals(values) == times


def test_ten_periods_of_a_sine_have_twenty_turning_points():
    sine = 0.3 * np.sin(np.linspace(0.0, 20.0 * math.pi, 1000))
    assert workload.reversals(sine) == 20


def test_who_steers_evenly_has_no_steering_entropy():
    """A steady value, a ramp and a parabola are predicted exactly."""
    t = np.arange(100) * 0.15
    for signal in (0.0 * t, 0.1 * t, 0.01 * t**2 / 2.0):
        assert workload.steering_entropy(signal) == 0.0


def test_errors_that_fill_all_nine_bins_alike_have_a_steering_entropy_of_1():
    """Prediction errors in bands, each nine times: -6, -3, -2, -0.7, 0, 0.7, 2, 3, 6."""
    errors = np.tile([-6.0, -3.0, -2.0, -0.7, 0.0, 0.7, 2.0, 3.0, 6.0], 9) * 0.05
    signal = [0.0, 0.0, 0.0]
    for error in errors:
        c, b, a = signal[-3:]
        signal.append(a + (a - b) + 0.5 * ((a - b) - (b - c)) + error)
    assert workload.steering_entropy(np.array(signal)) == pytest.approx(1.0)


def test_twice_the_noise_makes_more_entropy_and_less_than_3_s_none():
    noise = np.random.default_rng(1).normal(size=2000)
    little, much = (workload.steering_entropy(s * noise) for s in (0.01, 0.02))
    assert 0.2 < little < much < 1.0
    assert math.isnan(workload.steering_entropy(noise[:19]))


def test_half_a_minute_of_standing_in_a_minute_of_driving_is_half_of_the_time():
    made = log(0.0, 60.0, commands=[(0.0, 0.0, 0.0), (30.0, 0.4, 0.0)])
    row = workload.steering([made], 60.0)
    assert row["waiting_share"] == pytest.approx(0.5)
    assert row["command_changes_per_min"] == 1.0
    assert (row["reversals_per_min"], row["steering_entropy"]) == (0.0, 0.0)


def test_commands_that_hardly_differ_are_the_same_command():
    assert workload.changes([(0.4, 0.0), (0.41, 0.01), (0.42, 0.0), (0.45, 0.0)]) == 1
    assert workload.changes([(0.4, 0.0), (0.4, 0.1), (0.4, 0.0)]) == 2
    assert workload.changes([]) == 0


def test_where_nobody_steered_nothing_is_known_of_it():
    assert all(math.isnan(value) for value in workload.steering([log(0.0, 9.0)], 9.0).values())


# --- the way -----------------------------------------------------------------------------------


def test_the_path_error_is_the_distance_from_the_way_that_held_at_the_time():
    along, across = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[0.0, 3.0], [10.0, 3.0]])
    made = log(0.0, 10.0, started=1.0, ways=[(1.0, along), (5.0, across)])
    times = (0.5, 2.0, 2.1, 4.0, 6.0, 11.0)  # before, too closely filmed, and after
    track = [TrackPoint(t, t, 1.0, 0.0, "TeleOp") for t in times]
    assert workload.off_the_way(made, track, 20.0).tolist() == [1.0, 1.0, 2.0]


def test_who_planned_nothing_has_no_path_error():
    assert len(workload.off_the_way(log(0.0, 10.0, started=1.0), [], 20.0)) == 0


# --- whole runs --------------------------------------------------------------------------------


def run(name: str = "drive-to-event", **changes: object) -> Recording:
    return simulate(scenarios.build(scenarios.load(name), changes), 1)


def test_an_operator_with_one_drive_is_busy_from_the_order_to_the_confirmation():
    recording = run()
    (row,) = workload.operator_rows(recording)
    (made,) = recording.recorder.drives
    assert made.ended is not None
    assert row["utilisation"] == pytest.approx((made.ended - made.ordered) / recording.duration)
    assert (row["orders"], row["robots_max"], row["queue_max"], row["turns"]) == (1, 1, 0, 0)
    assert 0.0 < row["utilisation"] - row["attending_share"] < 5.0 / recording.duration * 1.5
    whole = episodes.run_row(recording)
    assert whole["utilisation"] == row["utilisation"]
    assert 0.0 < whole["path_error_rms_m"] < whole["path_error_max_m"] < 1.0
    assert (whole["missed"], whole["false_confirmations"]) == (0, 0)


def test_who_believes_in_a_false_alarm_is_counted():
    """A person in such haste, and so hard to tell anything from nothing by, believes anything."""
    hasty = {"confirm_look_s": 0.1, "sensitivity": 0.5}
    events = [{"kind": "fire", "at_s": 0, "reported": True, "false_alarm": True}]
    recording = run(events=events, **{"operator.traits": hasty})
    assert episodes.run_row(recording)["false_confirmations"] == 1
    (event,) = episodes.event_rows(recording)
    assert (event["outcome"], event["false_confirmation"], event["missed"]) == (
        "confirmed",
        True,
        False,
    )


def test_who_hardly_looks_misses_what_is_there():
    """Half a second of search, by a person who needs minutes to be sure."""
    blind = {"confirm_look_s": 200.0, "sensitivity": 0.5, "search_s": 0.5}
    recording = run(**{"operator.traits": blind})
    assert episodes.run_row(recording)["missed"] == 1
    (event,) = episodes.event_rows(recording)
    assert (event["outcome"], event["missed"]) == ("refuted", True)
    assert workload.operator_rows(recording)[0]["missed"] == 1
