"""A part of a live run that nobody answers gives up, and says who was not there."""

import math
from contextlib import nullcontext

import pytest
from helpers.wording import unnamed

from dva_sim.cli import call
from dva_sim.kernel.errors import RunsFailed
from dva_sim.live import process
from dva_sim.live.process import NobodyThere, run_part
from dva_sim.network.realtime import LiveClock
from dva_sim.options.runs import LiveOptions

pytestmark = pytest.mark.system


@pytest.fixture(autouse=True)
def _impatient(monkeypatch):
    monkeypatch.setattr(process, "DVA_WAIT_S", 0.2)
    monkeypatch.setattr(process, "LAST_WORDS", 0.0)


@pytest.mark.parametrize("part", ["operator", "world"])
def test_a_part_that_no_dva_answers_says_so_and_what_to_do(capsys, part):
    assert call(["live", "drive-to-event", "--only", part, "--dva", "127.0.0.1:9"]) == 3
    captured = capsys.readouterr()
    assert unnamed(captured.out, "127.0.0.1:9", "0.2 s") == []
    (line,) = captured.err.splitlines()
    assert unnamed(line, "error: ", "127.0.0.1:9", "0.2 s") == []


def test_a_dva_that_no_device_joins_says_so_at_its_end():
    options = LiveOptions("drive-to-event", duration=0.2)
    with pytest.raises(NobodyThere, match=r"no device .* 127\.0\.0\.1:\d+ "):
        run_part("dva", options, lambda _: None)
    assert issubclass(NobodyThere, RunsFailed)


def test_a_part_whose_reports_have_no_room_goes_on_and_tells_its_story_in_full(monkeypatch):
    monkeypatch.setattr(process, "REPORT_PERIOD", 0.05)
    monkeypatch.setattr(process, "_refuse_to_be_alone", lambda *_: None)
    reports = []

    def say(report):
        reports.append(report)
        return len(reports) > 2

    run_part("dva", LiveOptions("drive-to-event", duration=0.2), say)
    untaken, again, taken, later = (report.story for report in reports[:4])
    assert untaken
    assert again[: len(untaken)] == untaken
    assert taken[: len(again)] == again
    assert untaken[0] not in later


@pytest.mark.parametrize(
    ("part", "supervised", "changes", "lasts"),
    [
        ("dva", False, {}, math.inf),
        ("dva", False, {"duration": 7.0}, 7.0),
        ("dva", True, {}, 40.0),
        ("world", False, {"dva": "127.0.0.1:9"}, 40.0),
    ],
)
def test_a_dva_that_serves_others_outlasts_the_scenario(
    monkeypatch, part, supervised, changes, lasts
):
    asked = []
    monkeypatch.setattr(LiveClock, "run", lambda _, until=math.inf: asked.append(until))
    monkeypatch.setattr(process, "_refuse_to_be_alone", lambda *_: None)
    monkeypatch.setattr(process, "ending_when_asked", lambda *_: nullcontext(NotAsked()))
    options = LiveOptions("drive-to-event", set=("horizon_s=40",), **changes)
    run_part(part, options, lambda _: None, supervised=supervised)
    assert asked[-2] == lasts


class NotAsked:
    is_asked = False


@pytest.mark.parametrize(
    "words", [("dva", "--dva", "192.0.2.1:5600"), ("operator", "--host", "192.0.2.1")]
)
def test_a_host_that_is_not_this_machine_is_told_at_once(capsys, words):
    assert call(["live", "drive-to-event", "--only", *words]) == 2
    assert unnamed(capsys.readouterr().err, "error: ", "192.0.2.1", "listen") == []
