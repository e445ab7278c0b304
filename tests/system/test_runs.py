"""Whole runs: the same every time, safe at every moment, and true to the closed forms."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from dva_sim import scenario as scenarios
from dva_sim.experiments import metrics
from dva_sim.simulation import Recording, simulate

NEAR = [{"kind": "fire", "room": "Main corridor", "at_s": 10, "reported": True}]


def run(name: str = "drive-to-event", seed: int = 1, **changes: Any) -> Recording:
    dotted = {key.replace("__", "."): value for key, value in changes.items()}
    return simulate(scenarios.build(scenarios.load(name), dotted), seed)


def rows(recording: Recording) -> str:
    """Everything measured and every place taken, as text."""
    tracks = {k: [tuple(p) for p in v] for k, v in recording.recorder.tracks.items()}
    measured = metrics.run_row(recording), metrics.event_rows(recording)
    return json.dumps([measured, tracks, recording.recorder.timeline], default=str)


PROGRAM = """
import sys
sys.path.insert(0, {tests!r})
from test_runs import rows, run
print(rows(run("fire-drill", 5, link__delay_s=0.1, link__loss=0.02, link__jitter_s=0.02)))
"""


def test_the_same_seed_gives_the_same_bytes_in_two_processes() -> None:
    program = PROGRAM.format(tests=str(Path(__file__).parent))
    outputs = [
        subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            check=True,
            env={"PYTHONHASHSEED": str(hash_seed), "PATH": ""},
        ).stdout
        for hash_seed in (1, 2)
    ]
    assert outputs[0] == outputs[1]
    assert len(outputs[0]) > 10_000


def test_another_seed_gives_another_run() -> None:
    assert rows(run(seed=1)) != rows(run(seed=2))


def test_adding_a_guard_changes_nobody_elses_luck() -> None:
    """The fire is nearer to the robot; the guard's presence must not move the robot a hair."""
    alone = run(events=NEAR, link__loss=0.05, link__delay_s=0.05)
    guarded = run(events=NEAR, link__loss=0.05, link__delay_s=0.05, guard__count=1)
    assert guarded.recorder.tracks["guard-1"]
    assert guarded.recorder.tracks["robot-1"] == alone.recorder.tracks["robot-1"]


def test_keeping_traffic_for_pictures_changes_nothing() -> None:
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"link.delay_s": 0.1})
    plain, filmed = simulate(scenario, 3), simulate(scenario, 3, keep_traffic=True)
    assert str(metrics.run_row(plain)) == str(metrics.run_row(filmed))


@pytest.mark.parametrize("pattern", ["req-rep", "pub-sub", "latest-wins"])
@pytest.mark.parametrize("profile", ["default", "dissertation"])
@pytest.mark.parametrize("link", [{}, {"loss": 0.1, "jitter_s": 0.1, "delay_s": 0.2}])
def test_no_safety_rule_is_broken_on_any_link(
    pattern: str, profile: str, link: dict[str, float]
) -> None:
    recording = run(pattern=pattern, profile=profile, link=link, horizon_s=120)
    assert recording.recorder.violations == {}
    assert recording.recorder.drives[0].applied


@pytest.mark.parametrize("delay", [0.0, 0.05, 0.1, 0.25, 0.5, 1.0])
def test_request_reply_makes_commands_rarer_by_its_closed_form(delay: float) -> None:
    """Period = max(wanted period, round trip + processing), whole periods of the phone."""
    drive = run(pattern="req-rep", link__delay_s=delay).recorder.drives[0]
    gaps = [b.time - a.time for a, b in itertools.pairwise(drive.applied)]
    expected = max(0.1, 2 * delay + 0.05)
    middle = sorted(gaps)[len(gaps) // 2]
    assert middle == pytest.approx(expected, abs=0.004)


def test_publishing_keeps_the_wanted_rate_at_any_delay() -> None:
    for delay in (0.0, 1.0):
        drive = run(pattern="pub-sub", link__delay_s=delay).recorder.drives[0]
        gaps = [b.time - a.time for a, b in itertools.pairwise(drive.applied)]
        assert sorted(gaps)[len(gaps) // 2] == pytest.approx(0.1, abs=0.002)


def test_a_slow_robot_falls_behind_under_plain_publishing_but_not_if_the_latest_wins() -> None:
    """10 commands a second into a robot that needs 0.2 s for each."""
    slow = {"robot__processing_s": 0.2, "horizon_s": 60}
    plain = run(pattern="pub-sub", **slow).recorder.drives[0].applied
    latest = run(pattern="latest-wins", **slow).recorder.drives[0].applied
    assert max(a.time - a.issued for a in latest) < 0.45
    ages = [a.time - a.issued for a in plain]
    assert max(ages) > 2.0
    assert ages[4] < ages[9] < ages[14]


def test_the_oracle_is_faster_than_any_operator() -> None:
    reference = run(
        operator__strategy="oracle", profile="ideal", robot__processing_s=0.0, link__delay_s=0.0
    )
    best = metrics.run_row(reference)["drive_time_s"]
    for delay in (0.0, 0.5):
        assert metrics.run_row(run(link__delay_s=delay))["drive_time_s"] > best - 0.5


def test_the_delay_budget_adds_up_and_each_stage_is_what_it_is_made_of() -> None:
    row = metrics.run_row(run(link__delay_s=0.25))
    stages = {s: row[f"delay_{s}_s"] for s in metrics.STAGES}
    assert sum(stages.values()) == pytest.approx(row["loop_delay_mean_s"])
    assert stages["uplink"] == pytest.approx(0.25, abs=0.002)
    assert stages["downlink"] == pytest.approx(0.255, abs=0.003)
    assert stages["processing"] == pytest.approx(0.05, abs=0.001)
    assert stages["sampling"] == pytest.approx(0.05, abs=0.01)


def test_a_story_ends_with_every_event_accounted_for() -> None:
    for seed in range(6):
        recording = run("fire-drill", seed)
        events = metrics.event_rows(recording)
        assert len(events) == 2
        assert {e["outcome"] for e in events} <= {"confirmed", "escalated", "open", "undetected"}
        assert recording.recorder.violations == {}


def test_a_dead_link_ends_the_drive_and_the_event_goes_to_somebody_else() -> None:
    """Everything is lost on the robot's link: the operator never gets through, a guard goes."""
    recording = run(events=NEAR, guard__count=1, link__loss=0.9, horizon_s=600)
    event = metrics.event_rows(recording)[0]
    assert (event["outcome"], event["responder_kind"]) == ("confirmed", "guard")
    assert recording.recorder.violations == {}
