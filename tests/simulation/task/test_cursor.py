"""The motion that is seen, and what a person learns of the delay from it."""

import math

import pytest

from dva_sim.kernel import resources
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.measures.trials import run_row
from dva_sim.simulation.task import build, play
from dva_sim.simulation.task.block import seat_of
from dva_sim.simulation.task.devices import make_device
from dva_sim.simulation.task.pointing import Motion, Places

EXACT = {"motor_noise": 1e-9, "perceptual_delay_s": 0.1, "hand_lag_s": 0.02, "margin": 0.5}
TILT = {
    "task": {
        "axes": 2,
        "amplitude_m": [0.02, 0.08],
        "width_m": [0.007, 0.017],
        "cursor_m": 0.0034,
    },
    "device": {"kind": "tilt_position", "gain": 0.1948, "rate_hz": 50},
    "frames": {"rate_hz": 50},
    "trials": 5,
}


def pointing(**keys):
    task = {"kind": "pointing", "amplitude_m": 0.2, "width_m": 0.02, **keys.pop("task", {})}
    return {"model": "task", "task": task, **keys}


def seen(motion, place, frame_rate, count):
    """The velocities along x at each of some frames of what is at place(time)."""
    velocities = []
    for n in range(count):
        now = n / frame_rate
        motion.add(Places(now, place(now), 0.0, 2.0 * place(now), 0.0))
        velocities.append(motion.velocities())
    return velocities


@pytest.mark.parametrize("frame_rate", [30, 50, 60, 75, 144])
def test_an_even_motion_that_is_updated_at_another_rate_than_it_is_shown_is_seen_as_even(
    frame_rate,
):
    in_steps = lambda now: 0.3 * math.floor(100 * now + 1e-6) / 100  # noqa: E731
    late = seen(Motion(), in_steps, frame_rate, 300)[50:]
    assert [vx for vx, *_ in late] == pytest.approx([0.3] * len(late), rel=0.08)
    assert [tvx for _, _, tvx, _ in late] == pytest.approx([0.6] * len(late), rel=0.08)


def test_at_60_frames_a_second_a_mouse_of_100_hz_is_seen_to_move_evenly_within_a_few_per_cent():
    in_steps = lambda now: 0.3 * math.floor(100 * now + 1e-6) / 100  # noqa: E731
    late = [vx for vx, *_ in seen(Motion(), in_steps, 60, 300)[50:]]
    assert late == pytest.approx([0.3] * len(late), rel=0.04)


def test_with_few_frames_the_motion_is_that_between_the_last_two():
    places = seen(Motion(), lambda now: now * now, frame_rate=2, count=4)
    assert [vx for vx, *_ in places] == pytest.approx([0.0, 0.5, 1.5, 2.5])


def test_a_change_of_velocity_is_seen_as_a_whole_after_a_tenth_of_a_second():
    ramp = lambda now: max(0.0, now - 1.0)  # noqa: E731
    after = [vx for vx, *_ in seen(Motion(), ramp, 100, 112)[100:]]
    assert after[0] == 0.0
    assert 0.4 < after[5] < 0.6
    assert after[10] == pytest.approx(1.0)


def test_more_frames_a_second_do_not_slow_who_has_no_noise():
    task = {"width_m": [0.01, 0.02, 0.04], "selection": "dwell", "dwell_s": 0.3}
    who = {"traits": {"motor_noise": 1e-9}, "strategy": "pursuit"}
    mouse = {"kind": "mouse", "rate_hz": 100}
    scenario = pointing(task=task, operator=who, device=mouse, trials=1, practice=5)
    few, *more = (
        sum(row["movement_time_s"] for row in play(build(scenario, {"frames.rate_hz": rate}), 1))
        for rate in (30, 60, 100)
    )
    assert max(more) < 1.04 * few


def test_the_delay_felt_is_neither_longer_nor_shorter_for_the_time_over_which_motion_is_summed():
    who, frames = {"traits": EXACT}, {"rate_hz": 100}
    late = {"link.down.delay_s": 0.4, "task.selection": "dwell"}
    scenario = build(pointing(operator=who, practice=5, frames=frames), late)
    person = seat_of(scenario).person
    whole = 0.4 + person.perceptual_delay + person.hand_lag
    assert play(scenario, 1)[0]["delay_felt_s"] == pytest.approx(whole, abs=0.03)


@pytest.mark.parametrize("person", [0, 1, 2])
def test_by_tilt_nobody_feels_twice_the_delay_that_there_is(person):
    scenario = build(pointing(**TILT), {"operator.person": person})
    who = seat_of(scenario).person
    felt = [row["delay_felt_s"] for row in play(scenario, 1)]
    assert max(felt) < 2.0 * (who.perceptual_delay + who.hand_lag)


def test_at_two_frames_a_second_the_delay_felt_is_that_of_link_and_person():
    felt = [
        play(build(pointing(**TILT), {"frames.rate_hz": 2, "link.down.delay_s": d}), 1)[-1]
        for d in (0.0, 0.5, 1.0)
    ]
    person = seat_of(build(pointing(**TILT))).person
    own = person.perceptual_delay + person.hand_lag
    assert [row["delay_felt_s"] for row in felt] == pytest.approx(
        [own, own + 0.5, own + 1.0], abs=0.08
    )


FAILS = """
from dva_sim.agents.operator.strategies import Strategy
from dva_sim.agents.tilt import Filter
class Steers(Strategy):
    def drive(self, route, view, stop_before): return 0, 0
    def point(self, view): return 1 / 0
class Smooths(Filter):
    def add(self, sample): pass
    def value(self): return 1 / 0
"""


@pytest.mark.parametrize(
    ("key", "name"), [("operator.strategy", "Steers"), ("device.filter", "Smooths")]
)
def test_what_a_user_brings_may_fail_and_the_trial_tells_how_often(tmp_path, key, name):
    file = tmp_path / "mine.py"
    file.write_text(FAILS)
    own = {key: f"{file}:{name}", "horizon_s": 2, "practice": 0}
    rows = play(build(pointing(**TILT), own), 1)
    assert all(row["plugin_failures"] > 50 for row in rows)
    assert not any(row["completed"] for row in rows)
    assert run_row(rows)["plugin_failures"] == sum(row["plugin_failures"] for row in rows)
    assert play(build(pointing(**TILT), {"trials": 1}), 1)[0]["plugin_failures"] == 0


def held(motor_noise):
    """Readings of a ball's place [rad] after a movement, while the hand holds the device still."""
    scenario = build(pointing(**TILT), {"operator.traits.motor_noise": motor_noise})
    device = make_device(scenario.device, seat_of(scenario).person, Streams(1), 0.02)
    device.aim(0.1, 0.0)
    for _ in range(50):
        device.move(0.02)
        device.reading()
    device.aim(0.0, 0.0)
    readings = []
    for _ in range(250):
        device.move(0.02)
        readings.append(device.reading()[0])
    return readings[100:]


def test_a_tilt_that_is_only_held_trembles_no_more_for_a_noisy_movement():
    offsets = [noisy - calm for noisy, calm in zip(held(0.3), held(1e-9), strict=True)]
    assert abs(offsets[0]) > 0.01  # where the movement ended
    assert max(offsets) - min(offsets) < 0.02  # what the accelerometer makes of it


def test_a_ball_whose_place_is_the_tilt_comes_to_rest_in_the_smallest_target():
    document = load_yaml(resources.find("tilt-position", "experiments/scenarios/tasks"))
    changes = {"task.selection": "dwell", "trials": 5, "task.width_m": 0.0068}
    rows = play(build(document, changes), 1)
    assert [row["completed"] for row in rows] == [1.0] * 15
    assert max(row["movement_time_s"] for row in rows) < 10.0
