"""Trials as they are played; the persons of most of them are exact, so that signs are certain."""

import math

import numpy as np
import pytest

from dva_sim.kernel.streams import Streams
from dva_sim.simulation.measures.trials import run_row
from dva_sim.simulation.task import block, build, play, trace_of
from dva_sim.simulation.task.block import TunnelGoal, seat_of
from dva_sim.simulation.task.movement_laws import fit_line
from dva_sim.simulation.task.target_goals import Wandering
from dva_sim.simulation.task.tasks import Pointing

EXACT = {
    "motor_noise": 1e-9,
    "perceptual_delay_s": 0.1,
    "hand_lag_s": 0.02,
    "reaction_s": 0.1,
    "margin": 0.5,
}
DRIVEN = {
    "device": {"kind": "joystick", "rate_hz": 20},
    "plant": {"speed_mps": 0.5, "lag_s": 0.15, "width_m": 0.6},
    "frames": {"rate_hz": 10},
    "horizon_s": 900,
}


def pointing(**keys):
    task = {"kind": "pointing", "amplitude_m": 0.2, "width_m": 0.02, **keys.pop("task", {})}
    operator = {"traits": EXACT, **keys.pop("operator", {})}
    return {"model": "task", "task": task, "operator": operator, **keys}


def times(scenario, changes=None, seed=1):
    return [row["movement_time_s"] for row in play(build(scenario, changes or {}), seed)]


def test_the_same_seed_gives_the_same_rows_and_another_seed_others():
    scenario = build(pointing(operator={"traits": {}}, trials=3))
    assert play(scenario, 1) == play(scenario, 1)
    assert play(scenario, 1) != play(scenario, 2)


def test_two_persons_differ_and_each_is_always_the_same():
    first, second = (times(pointing(), {"operator.person": n}) for n in (0, 1))
    assert first != second
    assert first == times(pointing(), {"operator.person": 0})


def test_time_to_a_target_is_that_of_the_crossover_law_with_delay():
    traits = {**EXACT, "perceptual_delay_s": 0.04, "hand_lag_s": 0.004, "pointing_rad_s": 2.0}
    widths = [0.1 / 2**n for n in range(6)]
    scenario = build(
        pointing(
            task={"amplitude_m": 0.2, "width_m": widths},
            operator={"traits": traits, "strategy": "pursuit"},
            device={"kind": "joystick", "gain": 10.0, "rate_hz": 250},
            frames={"rate_hz": 250},
        )
    )
    person = seat_of(scenario).person
    delay = person.perceptual_delay + person.hand_lag + 0.004  # the last, of the way to the plant
    rate = person.pointing
    for _ in range(50):  # the slowest root of the loop: rate = gain x exp(rate x delay)
        rate = person.pointing * math.exp(rate * delay)
    rows = play(scenario, 1)
    line = fit_line(
        [math.log(2 * row["amplitude_m"] / row["width_m"]) for row in rows],
        [row["movement_time_s"] for row in rows],
    )
    assert line.r2 > 0.9999
    assert line.slope == pytest.approx(1.0 / rate, rel=0.03)
    assert 0.0 < line.intercept < 0.2


@pytest.mark.parametrize("way", ["up", "down"])
def test_a_second_of_delay_on_either_way_costs_no_less(way):
    dwell = pointing(task={"selection": "dwell"})
    without, with_delay = (times(dwell, {f"link.{way}.delay_s": d}) for d in (0.0, 1.0))
    assert with_delay[0] > without[0] + 0.999


def test_no_delay_reaches_the_oracle():
    oracle = pointing(operator={"strategy": "oracle"})
    late = {"link.up.delay_s": 1.0, "link.down.delay_s": 2.0, "frames.rate_hz": 1}
    assert times(oracle, late) == times(oracle)


def test_with_fewer_frames_a_cursor_settles_later():
    few, many = (
        times(pointing(practice=10), {"task.selection": "dwell", "frames.rate_hz": rate})[0]
        for rate in (3, 60)
    )
    assert few > many


def test_lost_frames_take_longer_over_many_trials():
    lossy = times(pointing(trials=20), {"link.down.loss": 0.8, "frames.rate_hz": 5})
    whole = times(pointing(trials=20), {"frames.rate_hz": 5})
    assert sum(lossy) > sum(whole)


def test_jitter_makes_trials_of_an_exact_person_differ():
    steady = times(pointing(trials=5), {"link.down.delay_s": 0.3})
    shaken = times(pointing(trials=5), {"link.down.delay_s": 0.3, "link.down.jitter_s": 0.3})
    assert max(steady) - min(steady) < max(shaken) - min(shaken)


def test_the_person_comes_to_feel_the_delay_that_there_is():
    dwell = pointing(task={"selection": "dwell"}, practice=5)
    scenario = build(dwell, {"link.down.delay_s": 0.8})
    person = seat_of(scenario).person
    whole = 0.8 + person.perceptual_delay + person.hand_lag
    assert play(scenario, 1)[0]["delay_felt_s"] == pytest.approx(whole, abs=0.1)


@pytest.mark.parametrize("strategy", ["pursuit", "move_and_wait", "adaptive"])
def test_a_target_that_takes_the_place_of_another_is_not_seen_to_fly_there(strategy):
    """Leading it would aim far beyond: 8 m in a thirtieth of a second are 240 m/s."""
    stops = [{"swing_m": 2.0, "reach_m": 0.0}, {"swing_m": -6.0, "reach_m": 0.0}]
    arm = {"kind": "reach", "stops": stops, "tolerance_m": 0.3}
    plant = {"speed_mps": 1.0, "lag_s": 0.3}
    rest = {"device": {"kind": "joystick"}, "plant": plant, "horizon_s": 60}
    scenario = {"model": "task", "task": arm, "operator": {"strategy": strategy}, **rest}
    (row,) = play(build(scenario), 1)
    assert row["completed"]
    assert row["path_m"] == pytest.approx(10.0, abs=0.8)


def test_a_dwell_ends_as_much_later_as_it_lasts():
    entry = times(pointing())[0]
    dwell = times(pointing(), {"task.selection": "dwell", "task.dwell_s": 0.5})[0]
    assert dwell == pytest.approx(entry + 0.5, abs=0.01)


def test_a_button_is_pressed_inside_the_target_when_nothing_trembles():
    row = play(build(pointing(), {"task.selection": "click"}), 1)[0]
    assert row["error"] == 0.0
    assert abs(row["end_m"]) <= 0.01


def test_who_is_surprised_begins_after_its_reaction():
    known, surprised = (
        times(pointing(), {"task.cue": cue, "operator.traits.reaction_s": 0.4})
        for cue in ("known", "unexpected")
    )
    assert surprised[0] > known[0] + 0.15


def first_move(scenario, changes):
    """First move of the person in the first trial [s], and the person's reaction time."""
    built = build(scenario, changes)
    seat, condition = seat_of(built), next(iter(built.task.conditions()))
    trial = block._trial(built, seat, condition, 0, Streams(3))
    trial.run()
    return trial.first_move, seat.person.reaction


SURPRISED = pointing(task={"cue": "unexpected"}, operator={"traits": {}}, horizon_s=4)
CORNER = {"model": "task", "task": {"kind": "corner", "leg_m": 3.0, "width_m": 2.0}, **DRIVEN}


@pytest.mark.parametrize("scenario", [SURPRISED, {**CORNER, "horizon_s": 4}])
@pytest.mark.parametrize("rate", [0.5, 1, 10, 60])
def test_who_is_surprised_moves_a_reaction_after_the_first_picture_however_many_follow(
    scenario, rate
):
    """Link and encoding come first, for who points and for who drives alike."""
    late = {"frames.rate_hz": rate, "link.down.delay_s": 0.5, "frames.extra_s": 0.2}
    moves, reaction = first_move(scenario, late)
    assert moves == pytest.approx(0.7 + reaction, abs=0.011)


def test_a_first_frame_that_is_lost_is_waited_for():
    lossy = {"frames.rate_hz": 2, "link.down.loss": 0.9, "horizon_s": 60}
    moves, reaction = first_move(SURPRISED, lossy)
    assert math.remainder(moves - reaction, 0.5) == pytest.approx(0.0, abs=0.01)
    assert moves > 0.5


DWELL = pointing(task={"selection": "dwell"}, trials=2)


@pytest.mark.parametrize(
    ("strategy", "least", "most"),
    [
        ("pursuit", 0.0, 0.0),
        ("oracle", 0.0, 0.0),
        ("move_and_wait", 1.0, 1.0),
        ("adaptive", 0.1, 1.0),
    ],
)
@pytest.mark.parametrize("scenario", [DWELL, {**CORNER, "trials": 2}])
def test_rows_tell_for_how_much_of_its_time_a_person_moved_and_waited(
    strategy, least, most, scenario
):
    late = {"operator.strategy": strategy, "link.down.delay_s": 3.0}
    rows = play(build(scenario, late), 1)
    shares = [row["move_and_wait_share"] for row in rows]
    assert all(least <= share <= most for share in shares)
    assert run_row(rows)["move_and_wait_share"] == pytest.approx(sum(shares) / 2)


def test_a_trial_that_is_not_done_by_the_horizon_counts_with_it():
    row = play(build(pointing(horizon_s=0.2)), 1)[0]
    assert row["completed"] == 0.0
    assert row["movement_time_s"] == pytest.approx(0.2)


def test_a_machine_that_does_all_the_correction_needs_no_frames():
    alone = {"automation": 1.0, "link.down.delay_s": 20.0, "horizon_s": 10.0}
    row = play(build(pointing(), alone), 1)[0]
    assert row["completed"] == 1.0


@pytest.mark.parametrize("kind", ["tilt_position", "tilt_velocity"])
def test_a_tilted_device_brings_the_ball_to_its_target(kind):
    changes = {"device.kind": kind, "device.gain": 0.5, "task.axes": 2}
    rows = play(build(pointing(trials=4), changes), 1)
    assert all(row["completed"] for row in rows)
    assert all(0.0 < row["tilt_max_rad"] < math.radians(46) for row in rows)


@pytest.mark.parametrize("shape", ["circular", pytest.param("straight", marks=pytest.mark.soak)])
def test_a_narrower_tunnel_takes_longer_and_delay_more_so(shape):
    task = {"kind": "tunnel", "shape": shape, "length_m": 0.3, "width_m": [0.02, 0.01]}
    scenario = {"model": "task", "task": task, "horizon_s": 200}
    wide, narrow = times(scenario)
    late_wide, late_narrow = times(scenario, {"link.down.delay_s": 0.3})
    assert wide < narrow
    assert wide < late_wide
    assert late_wide < late_narrow


def test_a_circle_so_small_that_one_is_around_within_the_delay_is_gone_around():
    task = {"kind": "tunnel", "shape": "circular", "length_m": 0.0625, "width_m": 0.015}
    row = play(build({"model": "task", "task": task}), 1)[0]
    assert row["completed"] == 1.0


def test_who_slips_back_a_little_is_not_taken_to_be_a_lap_ahead():
    task = build({"model": "task", "task": {"kind": "tunnel", "shape": "circular"}}).task
    path = TunnelGoal(task, length=0.25, width=0.02).path
    for along in (0.0, 0.05, 0.1, 0.09, 0.15):
        left = path.ahead(*path.point_at(along), 0.0, 0.0).remaining
        assert path.length - left == pytest.approx(along, abs=0.011)


def test_who_is_led_through_a_tunnel_leaves_its_middle_less():
    task = {"kind": "tunnel", "length_m": 0.3, "width_m": 0.01}
    scenario = {"model": "task", "task": task, "trials": 5, "horizon_s": 200}
    alone, led = (
        sum(row["path_error_rms_m"] for row in play(build(scenario, {"automation": a}), 1))
        for a in (0.0, 0.9)
    )
    assert led < alone


def test_tracking_tells_crossover_and_margin_of_a_stable_loop():
    sines = {"frequencies_rad_s": [0.5, 1, 2, 4, 8, 16], "amplitudes_m": [0.01] * 6}
    task = {"kind": "tracking", "record_s": 30, "warm_up_s": 5, "moves": "cursor", **sines}
    device = {"kind": "joystick", "gain": 1.0}
    scenario = build({"model": "task", "task": task, "device": device, "horizon_s": 100})
    row = play(scenario, 1)[0]
    assert row["crossover_rad_s"] > 0.0
    assert row["phase_margin_deg"] > 0.0


@pytest.mark.parametrize(
    "task",
    [
        {"kind": "corner", "leg_m": 3.0, "width_m": 2.0},
        {"kind": "slalom", "cones": 2, "spacing_m": 4.0, "swing_m": 1.0, "width_m": 2.0},
        {"kind": "course", "points_m": [[0, 0], [4, 0], [8, 4]], "width_m": 2.0},
    ],
)
def test_a_vehicle_gets_there_and_delay_slows_it(task):
    scenario = {"model": "task", "task": task, **DRIVEN}
    row = play(build(scenario), 1)[0]
    late = play(build(scenario, {"link.down.delay_s": 2.0}), 1)[0]
    assert row["completed"] == 1.0
    assert row["movement_time_s"] >= row["path_m"] / 0.5
    assert late["movement_time_s"] > row["movement_time_s"]


def test_an_arm_goes_from_stop_to_stop_and_its_work_takes_its_time():
    stops = [{"swing_m": 0, "reach_m": 2, "work_s": 4}, {"swing_m": 3, "reach_m": 0}]
    scenario = {
        "model": "task",
        "task": {"kind": "reach", "stops": stops, "tolerance_m": 0.2},
        "device": {"kind": "joystick"},
        "plant": {"speed_mps": 1.0, "lag_s": 0.2},
        "horizon_s": 100,
    }
    row = play(build(scenario), 1)[0]
    assert (row["completed"], row["stops"], row["work_s"]) == (1.0, 2, 4.0)
    assert row["movement_time_s"] > 4.0 + 2.0 + 3.0


def test_a_trace_is_that_of_the_row_and_begins_where_the_cursor_rests():
    scenario = build(pointing(trials=2))
    row, trace = trace_of(scenario, 1, number=1)
    assert row == play(scenario, 1)[1]
    assert trace.places[0] == (0.0, 0.0)
    assert trace.times[-1] == pytest.approx(row["trial_time_s"], abs=0.01)
    assert trace.marks == [(0.2, 0.0, 0.01)]


def test_a_click_beside_the_target_is_made_again_until_it_hits():
    target = {"selection": "click", "misses": "again", "axes": 2, "target_mps": 0.1}
    persons = {"traits": {}, "strategy": "pursuit"}
    scenario = pointing(task=target, operator=persons, link={"up": {"delay_s": 0.4}}, trials=6)
    rows = play(build(scenario), seed=3)
    assert max(row["presses"] for row in rows) > 1
    assert all(row["completed"] and not row["error"] for row in rows)


def test_a_target_that_moves_keeps_within_its_limit_at_its_speed():
    way = Wandering(Pointing(axes=2, target_mps=0.1), 0.1, 0.0, np.random.default_rng(1))
    places = np.array([way.at(0.01 * n) for n in range(1000)])
    assert np.abs(places).max() < 0.152
    assert np.median(np.hypot(*np.diff(places, axis=0).T)) == pytest.approx(1e-3)
