"""Link settings of a scenario, and their effect on a drive."""

import itertools
from typing import Any

import pytest

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Recording, simulate


def run(**link: Any) -> Recording:
    changes = {f"link.{key}": value for key, value in link.items()} | {"horizon_s": 120}
    return simulate(scenarios.build(scenarios.load("drive-to-event"), changes), seed=1)


def applied(recording: Recording) -> list[float]:
    """Times at which the robot applied its operator's commands [s]."""
    return [a.time for drive in recording.recorder.drives for a in drive.applied]


def longest_gap(times: list[float], since: float, until: float) -> float:
    """Between two commands that were followed [s]."""
    inside = [since, *(t for t in times if since <= t <= until), until]
    return max(b - a for a, b in itertools.pairwise(inside))


def test_during_an_outage_no_command_reaches_the_robot_and_afterwards_they_do():
    free = applied(run())
    assert longest_gap(free, 30.0, 40.0) < 1.0
    out = applied(run(outages=[{"from_s": 32, "for_s": 4}]))
    assert not [t for t in out if 32.5 < t < 36.0]
    assert [t for t in out if t > 36.0]


def test_a_partition_between_operator_and_robot_leaves_the_rest_of_the_network_alone():
    gap = {"from_s": 32, "for_s": 4}
    recording = run(partitions=[{"source": "operator-1", "destination": "robot-1", **gap}])
    assert not [t for t in applied(recording) if 32.5 < t < 36.0]
    up, down = recording.links[next(iter(recording.links))]
    assert up.lost > 0
    assert down.lost == 0


@pytest.mark.system
def test_the_same_seed_gives_the_same_drive_over_bursts_and_slow_delays():
    link = {
        "delay_s": 0.05,
        "delay_law": {"law": "gamma", "sd_s": 0.02, "correlation_s": 2.0},
        "loss": 0.02,
        "bursts": {"mean_s": 0.1},
    }
    assert applied(run(**link)) == applied(run(**link))
