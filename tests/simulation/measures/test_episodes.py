"""Measures of whole runs that are no matter of one drive."""

import math
from typing import Any

import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Recording, simulate
from dva_sim.simulation.measures import episodes


def run(seed: int = 2, **parts: Any) -> Recording:
    events = [{"kind": "gas_leak", "room": "Chemistry lab", "reported": True}]
    return simulate(scenarios.build({"events": events, "horizon_s": 200, **parts}, {}), seed)


def test_request_to_reply_is_service_and_link_and_its_longest_is_the_longest():
    recording = run(pattern="req-rep", robot={"processing_s": 0.4}, link={"delay_s": 0.1})
    row, drive = episodes.run_row(recording), recording.recorder.drives[0]
    assert row["round_trip_p50_s"] == pytest.approx(0.2 + 0.4, abs=0.01)
    assert row["round_trip_max_s"] == max(drive.round_trips)
    assert row["round_trip_p95_s"] == pytest.approx(np.percentile(drive.round_trips, 95))


def test_request_to_reply_is_known_of_a_drive_that_the_horizon_cuts_off():
    recording = run(pattern="req-rep", horizon_s=20)
    assert recording.recorder.drives[0].ended is None
    assert episodes.run_row(recording)["round_trip_max_s"] == pytest.approx(0.05, abs=0.02)


def test_what_is_published_has_no_reply():
    assert math.isnan(episodes.run_row(run())["round_trip_max_s"])


@pytest.mark.parametrize(("longest_s", "samples"), [(0.5, 17.5), (0.6, 20.0)])
def test_the_dissertations_phone_takes_a_value_with_17_or_18_samples_and_20_at_most(
    longest_s, samples
):
    """At 34 Hz half a second has 17 of them; the value is taken with the first one after it."""
    phone = {"profile": "dissertation", "max_delay_s": longest_s}
    row = episodes.run_row(run(phone=phone))
    assert row["samples_per_value"] == pytest.approx(samples, abs=0.5)


def test_a_filter_without_batches_has_no_samples_per_value():
    assert math.isnan(episodes.run_row(run())["samples_per_value"])


def test_what_is_never_reached_counts_the_whole_horizon():
    recording = run(
        link={
            "partitions": [
                {"from_s": 0, "for_s": 500, "source": "operator-1", "destination": "robot-1"}
            ]
        }
    )
    row = episodes.run_row(recording)
    assert row["response_mean_s"] == row["confirmation_mean_s"] == 200.0
    assert row["settled_per_min"] == 0.0


def test_a_false_alarm_is_responded_to_and_settled_but_not_confirmed():
    room = {"room": "Chemistry lab", "reported": True}
    events = [{"kind": "fire", **room, "false_alarm": True}]
    recording = run(events=events, guard={"count": 1}, robot={"count": 0}, operator={"count": 0})
    row, event = episodes.run_row(recording), episodes.event_rows(recording)[0]
    assert row["response_mean_s"] == event["response_s"] < 200.0
    assert math.isnan(row["confirmation_mean_s"])
    assert not event["is_true"]
    assert row["settled_per_min"] == pytest.approx(60.0 / recording.duration)


@pytest.mark.system
def test_a_policy_that_raises_is_counted_and_told(tmp_path):
    """The default decides instead: without the count a study compared it with itself."""
    (tmp_path / "mine.py").write_text(
        "from dva_sim.core.dispatch import Policy\n"
        "class Mine(Policy):\n"
        "    def advise(self, situation, rng):\n"
        "        raise RuntimeError('no idea')\n"
    )
    policy = {"dispatch.policy": f"{tmp_path / 'mine.py'}:Mine"}
    recording = simulate(scenarios.build(scenarios.load("fire-drill"), policy), 3)
    assert episodes.run_row(recording)["plugin_failures"] > 0
    story = [line.what for line in recording.recorder.timeline if "policy failed" in line.what]
    assert len(story) == 1
    assert not unnamed(story[0], "min_eta", "RuntimeError: no idea")
