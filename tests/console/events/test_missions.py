"""Robots that people send by themselves: an order of the DVA each, to the person's control room."""

from typing import Any

import pytest
from helpers.console.simulated_phone import FIRE, PhonePage

from dva_sim.agents.robot.controller import Mode

DECIDES_WITHIN_S = 60.0
LOOKS_FOR_S = 120.0
NO_FIRE = [FIRE[0] | {"false_alarm": True}]


def supervised(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> PhonePage:
    """One person who supervises, a fire that waits, and a policy that asks first."""
    usual = {"bystander__count": 0, "events": FIRE, "dispatch__mode": "ask_first"}
    one = PhonePage(monkeypatch, client="a1", **usual | changes)
    assert one.do("room_join", name="ana", role="supervise")[0]
    one.until(lambda: one.lines_of("events") and one.lines_of("events")[-1]["events"])
    one.let(0.3)
    return one


@pytest.fixture
def room(monkeypatch: pytest.MonkeyPatch) -> PhonePage:
    return supervised(monkeypatch)


def event(one: PhonePage) -> dict[str, Any]:
    """The fire as pages are shown it."""
    one.let(0.3)
    shown: dict[str, Any] = one.lines_of("events")[-1]["events"][0]
    return shown


def send(one: PhonePage, robot: str = "robot-1", **about: Any) -> tuple[bool, str]:
    done: tuple[bool, str] = one.do("mission", robot=robot, event=1, role="supervise", **about)
    return done


def is_there(one: PhonePage) -> bool:
    return bool(one.lines_of("events")[-1]["events"][0]["state"] == "on scene")


def test_a_robot_that_a_person_sends_is_the_responder_and_no_second_one_is_sent(room):
    assert send(room, reason="nearest")[0]
    sent = event(room)
    assert (sent["state"], sent["assigned"]) == ("assigned", ["robot-1", "ana"])
    assert (sent["decided"]["action"], sent["decided"]["reason"]) == ("assign", "nearest")

    assert room.do("event_proposal", event=1)[0]
    assert room.lines_of("done")[-1]["proposal"]["decide_within_s"] is None
    room.let(DECIDES_WITHIN_S + 5.0)
    assert event(room)["assigned"] == ["robot-1", "ana"]


def test_the_robot_that_was_chosen_goes_though_another_one_is_nearer(room):
    assert send(room, "robot-2")[0]
    modes = [room.robot(number).controller.mode for number in (0, 1)]
    assert modes == [Mode.IDLE, Mode.MISSION]


@pytest.mark.parametrize("finding", ["confirmed", "refuted"])
def test_the_person_who_sent_it_says_what_is_there_and_the_robot_is_free(room, finding):
    assert send(room)[0]
    room.until(lambda: is_there(room), 200.0, 1.0)
    done, text = room.do("mission_found", event=1, finding=finding)
    assert done, text

    assert event(room)["state"] == finding
    room.let(5.0)
    assert room.robot(0).controller.grant is None
    assert not room.do("mission_found", event=1, finding=finding)[0]


def test_nobody_else_says_what_a_robot_has_found(room):
    assert send(room)[0]
    assert room.do("room_join", client="b1", name="ben", role="dispatch")[0]
    done, text = room.do("mission_found", client="b1", event=1, finding="refuted")
    assert (done, text) == (False, "you have sent no robot to event 1")
    assert event(room)["state"] == "assigned"


def test_a_person_who_takes_another_name_still_says_what_is_there(room):
    assert send(room)[0]
    assert room.do("room_join", name="bea", role="supervise")[0]
    room.until(lambda: is_there(room), 200.0, 1.0)
    assert room.do("mission_found", event=1, finding="confirmed")[0]
    assert event(room)["state"] == "confirmed"


def test_a_fire_in_the_robots_view_counts_where_nobody_says_anything(room):
    assert send(room)[0]
    room.until(lambda: is_there(room), 200.0, 1.0)
    room.until(lambda: event(room)["state"] != "on scene", LOOKS_FOR_S + 20.0, 5.0)
    assert event(room)["state"] == "confirmed"
    assert room.robot(0).controller.grant is None


def test_nothing_in_the_robots_view_is_no_all_clear(monkeypatch):
    room = supervised(monkeypatch, events=NO_FIRE)
    assert send(room)[0]
    room.until(lambda: is_there(room), 200.0, 1.0)
    room.until(lambda: event(room)["state"] != "on scene", LOOKS_FOR_S + 20.0, 5.0)
    assert event(room)["state"] == "pending"


def test_a_robot_on_its_way_is_called_back_with_the_event(room):
    assert send(room)[0]
    room.let(5.0)
    assert room.do("event_false_alarm", event=1, reason="a drill", role="supervise")[0]
    room.let(10.0)
    robot = room.robot(0).controller
    assert (robot.mode, robot.grant) == (Mode.IDLE, None)


def test_a_robot_is_free_when_the_page_that_sent_it_is_gone_for_good(room):
    assert send(room)[0]
    room.actions.take({"id": "bye-release-a1", "client": "a1", "do": "release"})
    room.until(lambda: "ana" not in event(room)["assigned"], 60.0, 1.0)
    assert room.robot(0).controller.grant is None


def test_another_robot_takes_its_place_for_the_same_person(room):
    assert send(room)[0]
    room.let(5.0)
    assert send(room, "robot-2")[0]
    room.let(10.0)
    assert event(room)["assigned"] == ["robot-2", "ana"]
    modes = [room.robot(number).controller.mode for number in (0, 1)]
    assert modes == [Mode.IDLE, Mode.MISSION]


def test_an_event_whose_robot_falls_silent_waits_for_another(room):
    assert send(room)[0]
    room.world.run.network.leave(room.robot(0).device.id_tag)
    room.until(lambda: event(room)["state"] == "pending", 400.0, 5.0)


def test_a_mission_on_which_others_have_decided_is_refused(room):
    assert room.do("event_assign", event=1, device="guard-1", role="supervise")[0]
    done, text = send(room, decisions=0)
    assert not done
    assert "guard-1" in text
    assert event(room)["assigned"] == ["guard-1"]
    assert room.robot(0).controller.mode is Mode.IDLE
