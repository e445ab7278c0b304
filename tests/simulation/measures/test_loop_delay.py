"""The delay from a picture to its effect: its stages, their sum, and the whole as measured."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from dva_sim.agents.tilt import load_filter
from dva_sim.agents.tilt.phone import Trail
from dva_sim.kernel.recorder import Applied, DriveLog, Followed, Shown
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Recording, simulate
from dva_sim.simulation.measures import episodes
from dva_sim.simulation.measures.loop_delay import (
    STAGES,
    Driven,
    command_ages,
    delay_budget,
    driven,
)

MOTOR = 0.15
RESOLUTION = 0.01  # of what is recorded: a tenth of the time from one frame to the next [s]

CELLS: dict[str, dict[str, Any]] = {
    "as shipped": {},
    "REQ/REP": {"pattern": "req-rep", "link.delay_s": 0.5},
    "latest wins, a slow robot": {"pattern": "latest-wins", "robot.processing_s": 0.5},
    "jitter": {
        "pattern": "latest-wins",
        "link.delay_s": 0.5,
        "link.jitter_s": 0.3,
        "horizon_s": 90,
    },
    "loss, REQ/REP": {"pattern": "req-rep", "link.delay_s": 0.1, "link.loss": 0.05},
    "one pole": {"phone.filter": "one_pole", "phone.filter_options": {"time_constant_s": 0.3}},
    "rare commands": {"command.rate_hz": 2},
    "dissertation": {"phone.profile": "dissertation", "pattern": "latest-wins"},
    "dissertation, REQ/REP": {
        "phone.profile": "dissertation",
        "pattern": "req-rep",
        "link.delay_s": 0.5,
    },
    "dissertation, in place": {
        "phone.profile": "dissertation",
        "phone.filter": "median20-inplace",
        "pattern": "pub-sub",
        "robot.processing_s": 0.2,
    },
    "differential": {"phone.mapping": "differential"},
    "move and wait": {"operator.strategy": "move_and_wait", "link.delay_s": 0.5},
    "oracle": {"phone.profile": "ideal", "operator.strategy": "oracle"},
}


@cache
def drives(cell: str) -> tuple[Driven, ...]:
    """Drives of a cell."""
    recording: Recording = simulate(
        scenarios.build(scenarios.load("drive-to-event"), {"horizon_s": 60, **CELLS[cell]}), 1
    )
    logs = recording.recorder.drives
    return tuple(driven(d, recording.duration if d.ended is None else d.ended) for d in logs)


@pytest.mark.parametrize("cell", CELLS)
def test_the_stages_add_up_to_the_delay_that_is_measured_as_a_whole(cell):
    row = delay_budget(drives(cell), MOTOR)
    assert row["loop_delay_measured_s"] > MOTOR
    assert row["loop_delay_mean_s"] == pytest.approx(row["loop_delay_measured_s"], abs=RESOLUTION)
    assert sum(row[f"delay_{name}_s"] for name in STAGES) == pytest.approx(row["loop_delay_mean_s"])


@pytest.mark.parametrize("cell", ["as shipped", "rare commands", "dissertation"])
def test_counting_twice_for_how_long_a_value_of_the_filter_stands_is_found_out(cell):
    twice = [
        d._replace(
            applied=[
                a._replace(sample_age=a.sample_age + hold / 2)
                for a, hold in zip(d.applied, d.hold.tolist(), strict=True)
            ]
        )
        for d in drives(cell)
    ]
    row = delay_budget(twice, MOTOR)
    assert row["loop_delay_mean_s"] > row["loop_delay_measured_s"] + 1.5 * RESOLUTION


@pytest.mark.parametrize("cell", ["as shipped", "REQ/REP", "jitter"])
def test_the_age_in_force_is_the_part_of_the_budget_from_the_phone_to_the_motors(cell):
    """But for the first second, in which commands do not rest on a picture yet."""
    row = delay_budget(drives(cell), MOTOR) | command_ages(drives(cell))
    after = sum(row[f"delay_{s}_s"] for s in ("sampling", "pattern", "uplink", "processing"))
    assert after == pytest.approx(row["age_in_force_mean_s"], rel=0.02)


def log(*applied: Applied, started: float = 0.0) -> DriveLog:
    """A drive with an exact hand, by a picture of 1.0 s wanted from 1.7 s, and one of 1.5 s."""
    drive = DriveLog("robot", "operator", 1, ordered=0.0, started=started)
    drive.intents = [Followed(1.0, 1.5, 1.7), Followed(1.5, 1.9, 2.1)]
    drive.applied = list(applied)
    return drive


def test_each_stage_is_the_time_between_two_records():
    command = Applied(2.0, 2.05, 2.25, 2.35, 9.0, sample_age=0.1, captured=1.0)
    row = delay_budget([driven(log(command), 2.75)], MOTOR)
    values = {name: round(row[f"delay_{name}_s"], 9) for name in STAGES}
    assert values == {
        "frame": 0.2,  # wanted from 1.7 s, sampled at 1.9 s
        "downlink": 0.5,
        "human": 0.2,
        "hand": 0.0,
        "filter": 0.1,
        "sampling": 0.2,  # half of the 0.4 s in force
        "pattern": 0.05,
        "uplink": 0.2,
        "processing": 0.1,
        "motor": 0.15,
    }
    assert row["loop_delay_mean_s"] == pytest.approx(2.55 - 1.0 + 0.15)
    assert row["loop_delay_measured_s"] == pytest.approx(2.55 - 1.0 + 0.15)


def test_what_is_longer_in_force_counts_for_more():
    quick = Applied(2.0, 2.0, 2.1, 2.1, 9.0, sample_age=0.0, captured=1.0)
    slow = Applied(2.2, 2.2, 3.1, 3.1, 9.0, sample_age=0.0, captured=1.5)
    row = delay_budget([driven(log(quick, slow), 6.1)], MOTOR)  # for 1 s, and for 3 s
    assert row["delay_uplink_s"] == pytest.approx((1 * 0.1 + 3 * 0.9) / 4)
    assert row["delay_sampling_s"] == pytest.approx((1 * 0.5 + 3 * 1.5) / 4)
    assert row["delay_downlink_s"] == pytest.approx((1 * 0.5 + 3 * 0.4) / 4)


def test_age_at_application_is_a_mean_over_commands_and_age_in_force_over_time():
    quick = Applied(2.0, 2.0, 2.1, 2.1, 9.0, sample_age=0.0, captured=1.0)
    slow = Applied(2.2, 2.2, 3.1, 3.1, 9.0, sample_age=0.0, captured=1.5)
    row = command_ages([driven(log(quick, slow), 6.1)])
    assert row["command_age_mean_s"] == pytest.approx((0.1 + 0.9) / 2)
    assert row["age_in_force_mean_s"] == pytest.approx((1 * (0.1 + 0.5) + 3 * (0.9 + 1.5)) / 4)


def test_time_without_a_command_in_force_counts_for_nothing():
    short = Applied(2.0, 2.0, 2.0, 2.0, 2.5, sample_age=0.0, captured=1.0)
    row = delay_budget([driven(log(short), 60.0)], MOTOR)
    assert row["delay_sampling_s"] == pytest.approx(0.25)


def test_what_was_made_in_the_drive_before_or_by_no_picture_is_left_out():
    before = Applied(1.9, 1.9, 2.2, 2.2, 9.0, sample_age=0.0, captured=0.2)
    unseen = Applied(1.6, 1.6, 2.2, 2.2, 9.0, sample_age=0.0, captured=1.6)
    assert driven(log(before, started=2.0), 3.0).applied == []
    row = delay_budget([driven(log(unseen), 3.0)], MOTOR)
    assert np.isnan([row["loop_delay_mean_s"], row["loop_delay_measured_s"]]).all()


def test_a_frozen_filter_lets_no_picture_through_and_who_supervises_sends_no_command():
    """7 fresh samples of 20 in 0.2 s: the median never sees them."""
    frozen = {"phone.profile": "dissertation", "phone.max_delay_s": 0.2, "horizon_s": 60}
    for changes in (frozen, {"control": "supervisory"}):
        scenario = scenarios.build(scenarios.load("drive-to-event"), changes)
        row = episodes.run_row(simulate(scenario, 1))
        stages = [row[f"delay_{name}_s"] for name in STAGES]
        assert np.isnan([*stages, row["loop_delay_mean_s"], row["loop_delay_measured_s"]]).all()


def test_an_intent_is_traced_to_the_picture_it_was_formed_by_or_to_now():
    drive = DriveLog("robot", "operator", 1, ordered=0.0)
    drive.frames = [Shown(1.0, 1.3, tick=1000), Shown(1.1, 1.4, tick=1100)]
    assert drive.followed(tick=1000, now=1.6) == 1.0
    assert drive.followed(tick=1600, now=1.6) == 1.6
    assert drive.intents == [Followed(1.0, 1.3, 1.6), Followed(1.6, 1.6, 1.6)]


@pytest.mark.parametrize(
    ("filter_", "options", "samples"),
    [("none", {}, 0.0), ("median", {"window": 5}, 2.0), ("median20-copy", {}, 9.5)],
)
def test_times_of_capture_lag_as_a_ramp_does_in_hand_and_filter(filter_, options, samples):
    """Pictures 0.3 s old at all times; a hand that keeps nine tenths from sample to sample."""
    period = 0.02
    trail = Trail(lambda: load_filter(filter_, options)(period))
    trail.begin(10.0)
    for number in range(1, 401):
        now = 10.0 + number * period
        trail.follow(now - 0.3)
        trail.sample(1, 0.9)
        captured = trail.captured() if number % 20 == 0 else 0.0
    hand = period * 0.9 / (1 - 0.9)
    assert captured == pytest.approx(now - 0.3 - hand - samples * period, abs=1e-6)
    assert trail.age == pytest.approx(samples)
