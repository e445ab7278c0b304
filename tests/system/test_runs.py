"""Whole runs: the same every time, safe at every moment, and true to the closed forms."""

import itertools
import json
from typing import Any

import pytest
from helpers.processes.second_process import run_here_and_elsewhere

from dva_sim.agents.operator.delay_estimation import DelayEstimate
from dva_sim.agents.robot.controller import Decision, RobotController
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Recording, simulate
from dva_sim.simulation.measures import episodes
from dva_sim.simulation.measures.loop_delay import STAGES

pytestmark = pytest.mark.system

NEAR = [{"kind": "fire", "room": "Main corridor", "at_s": 10, "reported": True}]


def run(name: str = "drive-to-event", seed: int = 1, **changes: Any) -> Recording:
    dotted = {key.replace("__", "."): value for key, value in changes.items()}
    return simulate(scenarios.build(scenarios.load(name), dotted), seed)


def rows(recording: Recording) -> str:
    """Everything measured and every place taken, as text."""
    tracks = {k: [tuple(p) for p in v] for k, v in recording.recorder.tracks.items()}
    measured = episodes.run_row(recording), episodes.event_rows(recording)
    return json.dumps([measured, tracks, recording.recorder.timeline], default=str)


PROGRAM = """
from system.test_runs import rows, run
rough = {"link__delay_s": 0.1, "link__loss": 0.02, "link__jitter_s": 0.02}
print(rows(run("fire-drill", 5, horizon_s=60, **rough)))
"""


def test_the_same_seed_gives_the_same_bytes_in_two_processes():
    here, elsewhere = run_here_and_elsewhere(PROGRAM)
    assert here == elsewhere
    assert len(here) > 5_000


def test_another_seed_gives_another_run():
    assert rows(run(seed=1)) != rows(run(seed=2))


def test_adding_a_guard_changes_nobody_elses_random_numbers():
    """The fire is nearer to the robot; the guard's presence must not move the robot a hair."""
    alone = run(events=NEAR, link__loss=0.05, link__delay_s=0.05)
    guarded = run(events=NEAR, link__loss=0.05, link__delay_s=0.05, guard__count=1)
    assert guarded.recorder.tracks["guard-1"]
    assert guarded.recorder.tracks["robot-1"] == alone.recorder.tracks["robot-1"]


@pytest.mark.parametrize(
    ("name", "changes"),
    [("drive-to-event", {"link.delay_s": 0.1}), ("evacuation", {"horizon_s": 40})],
)
def test_keeping_traffic_for_pictures_changes_nothing(name, changes):
    scenario = scenarios.build(scenarios.load(name), changes)
    plain, filmed = simulate(scenario, 3), simulate(scenario, 3, keep_traffic=True)
    assert str(episodes.run_row(plain)) == str(episodes.run_row(filmed))
    assert str(episodes.people_rows(plain)) == str(episodes.people_rows(filmed))


@pytest.mark.parametrize("pattern", ["req-rep", "pipelined", "pub-sub", "latest-wins"])
@pytest.mark.parametrize("profile", ["default", "dissertation"])
def test_no_safety_rule_is_broken_on_a_rough_link(pattern, profile):
    link = {"loss": 0.1, "jitter_s": 0.1, "delay_s": 0.2}
    recording = run(pattern=pattern, phone__profile=profile, link=link, horizon_s=60)
    assert recording.recorder.violations == {}
    assert recording.recorder.drives[0].applied


@pytest.mark.parametrize(
    ("pattern", "delay", "period"),
    [
        *[("req-rep", delay, max(0.1, 2 * delay + 0.05)) for delay in (0.0, 0.1, 1.0)],
        *[("pub-sub", delay, 0.1) for delay in (0.0, 1.0)],
    ],
)
def test_request_reply_makes_commands_rarer_by_its_closed_form_and_publishing_does_not(
    pattern, delay, period
):
    """Period = max(wanted period, round trip + processing), whole periods of the phone."""
    drive = run(pattern=pattern, link__delay_s=delay, horizon_s=60).recorder.drives[0]
    gaps = sorted(b.time - a.time for a, b in itertools.pairwise(drive.applied))
    within = 0.004 if pattern == "req-rep" else 0.002
    assert gaps[len(gaps) // 2] == pytest.approx(period, abs=within)


@pytest.mark.parametrize("delay", [0.0, 1.0])
def test_a_window_of_requests_makes_commands_as_many_times_as_frequent(delay):
    """Rate = min(wanted rate, window / (round trip + processing))."""
    ways = {"command__window": 4, "link__delay_s": delay, "horizon_s": 60}
    drive = run(pattern="pipelined", **ways).recorder.drives[0]
    first, last = drive.applied[10], drive.applied[-10]
    rate = (len(drive.applied) - 20) / (last.time - first.time)
    assert rate == pytest.approx(min(10.0, 4 / (2 * delay + 0.05)), rel=0.08)


def test_a_slow_robot_falls_behind_under_plain_publishing_but_not_if_the_latest_wins():
    """10 commands a second into a robot that needs 0.2 s for each."""
    slow = {"robot__processing_s": 0.2, "horizon_s": 40}
    plain = run(pattern="pub-sub", **slow).recorder.drives[0].applied
    latest = run(pattern="latest-wins", **slow).recorder.drives[0].applied
    assert max(a.time - a.issued for a in latest) < 0.45
    ages = [a.time - a.issued for a in plain]
    assert max(ages) > 2.0
    assert ages[4] < ages[9] < ages[14]


def test_the_oracle_is_faster_than_any_operator():
    reference = run(
        operator__strategy="oracle",
        phone__profile="ideal",
        robot__processing_s=0.0,
        link__delay_s=0.0,
    )
    best = episodes.run_row(reference)["drive_time_s"]
    for delay in (0.0, 0.5):
        assert episodes.run_row(run(link__delay_s=delay))["drive_time_s"] > best - 0.5


def test_each_stage_of_the_delay_budget_is_what_it_is_made_of():
    row = episodes.run_row(run(link__delay_s=0.25))
    stages = {s: row[f"delay_{s}_s"] for s in STAGES}
    assert stages["uplink"] == pytest.approx(0.25, abs=0.002)
    assert stages["downlink"] == pytest.approx(0.255, abs=0.003)
    assert stages["processing"] == pytest.approx(0.05, abs=0.001)
    assert stages["sampling"] == pytest.approx(0.05, abs=0.01)
    assert stages["pattern"] == 0.0
    assert stages["motor"] == 0.15


@pytest.mark.parametrize("delay", [0.0, 1.0])
def test_the_loop_delay_is_what_operators_come_to_see(delay, monkeypatch):
    """The person's own guess, made from pictures and intents alone, checks the sum of stages.

    It comes in tenths of a second, and the lag that fits a response best is a little less than
    the mean delay of one that begins at once and levels off, as a hand's and a motor's.
    """
    guesses: list[float] = []
    see = DelayEstimate.see

    def overheard(self: DelayEstimate, *args: float) -> None:
        see(self, *args)
        guesses.append(self.value)

    monkeypatch.setattr(DelayEstimate, "see", overheard)
    loop = episodes.run_row(run(link__delay_s=delay))["loop_delay_mean_s"]
    later = sorted(guesses[len(guesses) // 2 :])
    assert loop - 0.2 < later[len(later) // 2] < loop + 0.1


def test_waiting_for_the_last_reply_is_told_as_the_patterns_own_delay():
    slow = {"phone__profile": "dissertation", "link__delay_s": 0.5, "horizon_s": 60}
    waited = episodes.run_row(run(pattern="req-rep", **slow))["delay_pattern_s"]
    assert 0.05 < waited < 1.05
    assert episodes.run_row(run(pattern="pub-sub", **slow))["delay_pattern_s"] == 0.0


@pytest.mark.invariant("S1")
def test_a_robot_without_watchdog_is_found_out(monkeypatch):
    """The rules are checked from outside: a controller that trusts too long breaks S1."""
    honest = RobotController._set

    def trusting(self: RobotController, *args: Any) -> Decision:
        decision = honest(self, *args)
        if decision.set_point is None:
            return decision
        return decision._replace(set_point=decision.set_point._replace(until=1e6))

    assert cut_link_run().recorder.violations == {}
    monkeypatch.setattr(RobotController, "_set", trusting)
    assert cut_link_run().recorder.violations["S1"] > 0


def test_commands_still_under_way_when_a_drive_ends_are_known_to_the_checks():
    """At a second's delay they move the robot once more, lawfully, before the stop arrives."""
    recording = run(link__delay_s=1.0)
    drive = recording.recorder.drives[0]
    assert drive.ended is not None
    assert drive.applied[-1].time > drive.ended
    assert recording.recorder.violations == {}


def test_a_robot_that_brakes_while_its_next_drive_is_ordered_breaks_no_rule():
    recording = run("search-and-confirm", seed=1)
    first, second = recording.recorder.drives[:2]
    assert first.robot == second.robot
    assert recording.recorder.violations == {}


def cut_link_run(pattern: str = "latest-wins", until: float = 65.0, **more: Any) -> Recording:
    """The way up to the robot is dead from 20 s on, the pictures keep coming."""
    outage = {"from_s": 20.0, "for_s": until - 20.0, "direction": "up"}
    return run(pattern=pattern, link__outages=[outage], **more)


@pytest.mark.invariant("S8")
@pytest.mark.parametrize("pattern", ["req-rep", "pub-sub", "latest-wins"])
def test_when_a_dead_link_comes_back_the_event_is_confirmed_under_any_pattern(pattern):
    recording = cut_link_run(pattern, horizon_s=400)
    row = episodes.run_row(recording)
    assert row["confirmed"], recording.recorder.timeline
    assert row["stop_share"] > 0.05
    assert row["age_in_force_mean_s"] < 6.0
    assert recording.recorder.violations == {}


def test_a_link_that_stays_dead_ends_the_drive_and_the_event_goes_to_a_guard():
    recording = cut_link_run(until=1e6, events=NEAR, guard__count=1, horizon_s=600)
    first = recording.recorder.drives[0]
    assert first.started is not None
    assert first.outcome == "lost link"
    event = episodes.event_rows(recording)[0]
    assert (event["outcome"], event["responder_kind"]) == ("confirmed", "guard")


def test_a_robot_that_could_never_be_driven_counts_with_the_whole_horizon():
    row = episodes.run_row(run(link__loss=0.9, horizon_s=60))
    assert (row["confirmed"], row["outcome"], row["drive_time_s"]) == (False, "no drive", 60)


def test_two_fires_reported_as_one_event_are_both_accounted_for():
    twins = [{"kind": "fire", "room": "Server room", "reported": True}] * 2
    rows_ = episodes.event_rows(run(events=twins, seed=3))
    assert [r["outcome"] for r in rows_] == ["confirmed", "confirmed"]


def test_a_story_ends_with_every_event_accounted_for():
    for seed in range(2):
        recording = run("fire-drill", seed)
        events = episodes.event_rows(recording)
        assert len(events) == 2
        assert {e["outcome"] for e in events} <= {"confirmed", "escalated", "open", "undetected"}
        assert recording.recorder.violations == {}
