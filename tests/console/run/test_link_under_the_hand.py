"""The link changes under a drive, and frames, commands and round trips follow."""

import pytest
from helpers.console.simulated_console import Page
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode

FAST = {"rate_bps": 1e9}


def ages(page, seconds):
    """Ages of the frames and commands that arrive within some seconds [ms]."""
    page.let(seconds)
    drive = page.drive()
    log = page.world.recorder.newest_drive[page.robot().device.id_tag]
    frame = drive["picture_arrived_ms"] - drive["picture_ms"]
    command = 1000 * (log.applied[-1].arrived - log.applied[-1].sent)
    return frame, command, drive["round_trip_ms"]


@pytest.fixture
def driving(monkeypatch):
    page = Page(monkeypatch, pattern="req-rep", command__rate_hz=20)
    page.sets_out(0.3, then=2.0)
    return page


def test_the_delay_goes_up_and_down_and_all_follow_both_ways(driving):
    frame, command, trip = ages(driving, 1.0)
    assert frame < 20
    assert command < 10
    assert trip < 20
    assert driving.do("link", delay_s=0.5)[0]
    frame, command, trip = ages(driving, 6.0)
    assert frame == pytest.approx(505, abs=15)
    assert command == pytest.approx(500, abs=5)
    assert trip == pytest.approx(1002, abs=10)
    assert driving.do("link", delay_s=0.0)[0]
    frame, command, trip = ages(driving, 4.0)
    assert frame < 20
    assert command < 10
    assert trip < 20
    assert not driving.world.recorder.violations


def test_frames_come_in_their_order_through_every_change(driving):
    log = driving.world.recorder.newest_drive[driving.robot().device.id_tag]
    for delay in (0.4, 0.0, 1.0, 0.1, 0.0):
        assert driving.do("link", delay_s=delay)[0]
        driving.let(1.5)
    captured = [frame.captured for frame in log.frames]
    assert captured == sorted(captured)
    assert len(set(captured)) == len(captured)
    assert len(captured) > 50


def test_half_of_all_packets_lost_makes_frames_and_commands_rarer_and_later(driving):
    driving.let(5.0)
    before = driving.robot().applied
    driving.let(5.0)
    usual = driving.robot().applied - before
    assert driving.do("link", loss=0.5)[0]
    driving.let(5.0)
    before = driving.robot().applied
    driving.let(10.0)
    rare = driving.robot().applied - before
    assert usual == pytest.approx(100, abs=5)
    assert rare < usual / 4
    assert driving.lines_of("rows")[-1]["robots"][0]["lost"] > 20


def test_jitter_keeps_within_the_delay_and_comes_back_with_it(driving):
    done, text = driving.do("link", jitter_s=0.2)
    assert done
    assert unnamed(text, "jitter", "0 s") == []
    assert driving.lines_of("rows")[-1]["link"]["jitter_s"] == 0.0
    assert driving.lines_of("rows")[-1]["link"]["jitter_wanted_s"] == 0.2
    assert driving.do("link", delay_s=0.3)[0]
    assert driving.lines_of("rows")[-1]["link"]["jitter_s"] == 0.2
    driving.let(5.0)
    log = driving.world.recorder.newest_drive[driving.robot().device.id_tag]
    took = {round(c.arrived - c.sent, 4) for c in log.applied[-5:]}
    assert all(0.099 <= one <= 0.51 for one in took)
    assert len(took) > 3


def test_a_narrow_link_queues_frames_and_drops_them(driving):
    assert driving.do("link", rate_bps=100_000)[0]
    frame, _, _ = ages(driving, 15.0)
    assert frame > 900  # 12 kB take a second
    assert driving.do("link", **FAST)[0]
    frame, _, _ = ages(driving, 10.0)
    assert frame < 20


def test_a_slow_computer_of_the_robot_shows_in_the_round_trip(driving):
    assert driving.do("link", processing_s=0.25)[0]
    _, _, trip = ages(driving, 4.0)
    assert trip == pytest.approx(252, abs=10)
    assert driving.lines_of("rows")[-1]["link"]["processing_s"] == 0.25


def test_over_a_long_link_a_robot_is_still_taken_and_says_why_it_stands(monkeypatch):
    page = Page(monkeypatch, robot__max_age_s=3)
    page.let(2.0)
    assert page.do("link", delay_s=2.0)[0]
    assert page.do("take", robots=[0])[0]
    done, text = page.do("start", within=90.0)
    assert done, text
    page.want(0.3)
    page.let(20.0)
    shown = page.lines_of("rows")[-1]["robots"][0]["stop_reason"]
    assert "3 s" in shown


def test_the_rate_of_a_recorded_link_is_the_recordings(monkeypatch, tmp_path):
    trace = tmp_path / "trace"
    trace.write_text("\n".join(str(ms) for ms in range(1, 500)) + "\n")
    page = Page(monkeypatch, link__trace_up=str(trace))
    done, text = page.do("link", rate_bps=1e6)
    assert not done
    assert "trace" in text
    assert page.lines_of("rows")[-1]["link"]["trace"] == str(trace)
    assert page.lines_of("rows")[-1]["link"]["rate_trace"] == str(trace)
    assert page.do("link", delay_s=0.1)[0]


def test_an_emergency_waits_for_no_connection_whatever_the_delay(monkeypatch):
    page = Page(monkeypatch)
    assert page.do("link", delay_s=0.5)[0]
    page.let(10.0)
    assert page.do("take", robots=[0])[0]
    page.let(5.0)
    assert page.do("start")[0]
    page.want(0.5)
    page.let(6.0)
    assert page.robot().body.speed > 0.2
    page.actions.take({"id": "now", "client": "another", "do": "emergency", "robots": "all"})
    page.let(0.51)
    assert page.robot().controller.mode is Mode.IDLE
    page.let(0.6)  # its word of that takes as long as the order did
    assert page.lines_of("rows")[-1]["robots"][0]["mode"] == "Emergency"


def test_until_the_first_command_comes_the_robot_says_what_it_waits_for(monkeypatch):
    page = Page(monkeypatch)
    assert page.do("link", delay_s=0.5)[0]
    page.let(10.0)
    page.sets_out(then=0.6)
    shown = page.lines_of("rows")[-1]["robots"][0]["stop_reason"]
    assert "connection" in shown


@pytest.mark.parametrize("pattern", ["latest-wins", "req-rep"])
def test_a_hold_that_begins_before_the_drive_counts_once_it_has_begun(monkeypatch, pattern):
    page = Page(monkeypatch, pattern=pattern)
    page.let(1.0)
    assert page.do("link", delay_s=0.5)[0]
    assert page.do("take", robots=[0])[0]
    for _ in range(2):
        page.want(0.5)
        assert page.do("start")[0]
        page.let(6.0)
        assert page.robot().body.speed == pytest.approx(0.25, abs=0.03)
        page.let_go()
        page.let(3.0)
        assert page.robot().controller.mode is Mode.IDLE
