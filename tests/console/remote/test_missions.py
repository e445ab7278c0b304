"""Robots sent on missions, and taken from their holders, from an attached console."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.console.remote_console import OWN, RemotePage, attached
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.mistakes import check_message

pytestmark = pytest.mark.system


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[RemotePage]:
    with attached(monkeypatch, tmp_path) as one:
        one.ask("room_join", name="ana")
        one.until(lambda: len(one.system.numbers) >= 4)
        yield one


def number(page: RemotePage, label: str) -> int:
    """By which the page knows a device, as the web process says it."""
    return next(t["i"] for t in page.lines_of("scene")[-1]["things"] if t["label"] == label)


def sent_by(page: RemotePage) -> list[bytes]:
    """Messages sent by the console's own control room."""
    return [data for source, _, data in page.world.heard if source == OWN]


def test_a_robot_goes_and_looks_by_itself_and_is_given_back(page):
    done = page.ask("mission", robot=number(page, "robot-1"), event=1)
    assert done["ok"]
    assert unnamed(done["text"], "robot-1", "event 1") == []
    robot = page.world.robot()
    assert robot.controller.mode is Mode.MISSION
    assert robot.holder[0] == OWN
    page.until(lambda: robot.controller.grant is None, within=400.0)
    page.let(1.0)

    story = [line["what"] for line in page.lines_of("story")]
    assert any(unnamed(what, "mission", "robot-1", "done") == [] for what in story)
    sent = [data for data in sent_by(page) if isinstance(data, bytes)]
    kinds = {type(decode(data).body) for data in sent}
    assert {m.PermissionRequest, m.Inspect, m.GetMissionStatus, m.PermissionRevocation} <= kinds
    assert [found for data in sent for found in check_message(data)] == []
    (row,) = [row for row in page.written() if row.action == "mission"]
    assert (row.author, row.subject, row.event, row.outcome) == ("ana", "robot-1", 1, "done")


def test_a_robot_that_does_not_answer_may_be_on_its_way_or_not(page):
    number_ = number(page, "robot-1")
    page.world.world.run.network.leave(page.world.robot().device.id_tag)
    refused = page.ask("mission", robot=number_, event=1)

    assert not refused["ok"]
    assert "robot-1" in refused["text"]
    (row,) = [row for row in page.written() if row.action == "mission"]
    assert row.outcome == "unknown"


def test_a_robot_that_falls_silent_on_its_way_is_given_back(page):
    robot = page.world.robot()
    assert page.ask("mission", robot=number(page, "robot-1"), event=1)["ok"]
    page.world.world.run.network.leave(robot.device.id_tag)
    page.until(lambda: "how its mission stands is unknown" in str(page.lines_of("story")))
    page.let(1.0)

    given_back = [decode(data).body for data in sent_by(page) if isinstance(data, bytes)][-9:]
    assert any(isinstance(body, m.PermissionRevocation) for body in given_back)


def test_a_mission_is_an_order_to_the_console_and_its_person_says_what_is_there(page):
    assert page.ask("mission", robot=number(page, "robot-1"), event=1)["ok"]
    page.until(lambda: page.events()[0]["state"] == "assigned")
    assert page.events()[0]["assigned"][0] == "robot-1"
    history = page.ask("event_details", event=1)["details"]["history"]
    assert [row["device"] for row in history if row["device"]] == ["robot-1"]
    assert page.ask("mission_found", event=1, finding="confirmed")["ok"]
    page.until(lambda: page.events()[0]["state"] == "confirmed")
    page.until(lambda: page.world.robot().controller.grant is None)


def test_people_who_share_a_control_room_hand_a_mission_over_without_a_stop(page):
    assert page.ask("room_join", client="c2", name="ben")["ok"]
    assert page.ask("mission", robot=number(page, "robot-1"), event=1)["ok"]
    session = page.world.robot().controller.grant.session
    assert page.ask("hand_over", to="ben", note="smoke")["ok"]
    assert page.ask("hand_over_answer", client="c2", offer=1, accept=True)["ok"]
    page.let(5.0)
    assert page.world.robot().controller.grant.session == session
    assert page.lines_of("control")[-1]["owners"] == [{"event": 1, "label": "ben"}]

    assert not page.ask("mission_found", event=1, finding="confirmed")["ok"]
    assert page.ask("mission_found", client="c2", event=1, finding="confirmed")["ok"]


@pytest.mark.parametrize(
    ("about", "words"),
    [({"robot": 99, "event": 1}, "no robot 99"), ({"robot": 0, "event": 7}, "no event 7")],
)
def test_what_is_not_there_is_refused(page, about, words):
    assert words in page.ask("mission", **about)["text"]


def test_a_robot_is_taken_from_its_driver_with_its_task(page):
    assert page.ask("event_assign", event=1, device="robot-1")["ok"]
    assert page.world.do("take", robots=["robot-1"])[0]
    assert page.world.do("start")[0]
    robot = page.world.robot()
    page.until(lambda: robot.controller.mode is Mode.TELEOPERATION)
    taken = page.ask("take_over", robot="robot-1", reason="its driver is away")

    assert taken["ok"]
    assert robot.holder[0] == page.seat_device()
    page.until(lambda: "console-1" in page.events()[0]["assigned"])
    rows = {(row.action, row.author, row.outcome) for row in page.written()}
    assert {("revoke", "control room", "done"), ("take over", "ana", "done")} <= rows


def test_a_robot_that_was_sent_nowhere_is_taken_as_it_is(page):
    assert page.world.do("take", robots=["robot-1"])[0]
    assert page.ask("take_over", robot="robot-1", reason="it is needed")["ok"]

    page.let(2.0)
    assert page.world.robot().holder[0] == page.seat_device()
    assert page.ask("release")["ok"]
    page.let(2.0)
    assert page.world.robot().controller.grant is None
