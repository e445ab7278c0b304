"""A person takes robots, drives them, and is stopped by all that should stop a drive."""

import pytest
from helpers.console.simulated_console import Page
from helpers.wording import unnamed

from dva_sim.agents.operator import steps
from dva_sim.agents.robot.controller import Mode
from dva_sim.kernel.clock import Clock
from dva_sim.network.realtime import LiveClock
from dva_sim.protocol import messages as m


@pytest.fixture
def page(monkeypatch):
    return Page(monkeypatch)


@pytest.fixture
def driving(page):
    page.sets_out(0.5, robots=[0, 1], then=3.0)
    return page


def test_two_robots_are_driven_by_the_same_input(driving):
    for number in (0, 1):
        robot = driving.robot(number)
        assert robot.controller.mode is Mode.TELEOPERATION
        assert robot.body.speed == pytest.approx(0.25, abs=0.03)
    assert driving.seat()["phase"] == "driving"


def test_input_turns_left_for_positive_values_and_is_a_share_of_the_robots_limits(page):
    page.sets_out(0.0, 0.5, robots=["robot-1"], then=2.0)
    assert page.robot().body.turn_rate == pytest.approx(0.262, abs=0.03)
    assert page.drive()["wanted"] == [0.0, 0.262]
    assert page.drive()["command"] == pytest.approx([0.0, 0.262], abs=0.002)


def test_what_was_asked_is_in_the_set_point_soon_and_that_is_told(driving):
    driving.want(0.8)
    driving.let(1.0)
    drive = driving.drive()
    assert 0 < drive["loop_ms"] < 60
    assert drive["input"]["n"] > 0
    assert driving.robot().set_point.speed == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("end", "why"),
    [
        (lambda page: page.do("stop"), "stopped"),
        (lambda page: page.do("emergency", robots="all"), "emergency"),
        (lambda page: page.do("emergency", robots=[0, 1], client="another"), "emergency"),
        (lambda page: page.let_go(), "stopped"),
        (lambda page: page.actions.take({"client": "c1", "do": "gone"}), "stopped"),
        (lambda page: page.do("pace", paused=True), "stopped"),
        (lambda page: page.world.clock.on_late(0.3), "stopped"),
        (lambda page: page.do("release"), "gave up"),
    ],
)
def test_what_ends_a_drive_ends_it_for_good(driving, end, why):
    logs = [log for log in driving.world.recorder.drives if log.ended is None]
    end(driving)
    driving.let(2.5)
    driving.want(1.0)
    driving.let(2.0)
    for number in (0, 1):
        robot = driving.robot(number)
        assert robot.controller.mode is Mode.IDLE
        assert robot.body.speed == pytest.approx(0.0, abs=1e-3)
    assert [log.outcome for log in logs] == [why, why]


def test_while_held_by_lag_nobody_starts_and_the_page_says_why(driving):
    driving.world.clock.on_late(0.3)
    driving.let(0.5)
    done, text = driving.do("start")
    assert (done, "real time" in text) == (False, True)
    assert driving.lines_of("rows")[-1]["clock"]["held_by_lag"]
    assert "behind real time" in driving.seat()["alert"]
    driving.let(3.0)
    assert not driving.lines_of("rows")[-1]["clock"]["held_by_lag"]
    assert driving.robot().controller.mode is Mode.IDLE
    assert driving.do("start")[0]


def test_a_robot_has_one_holder_and_the_second_is_told_who(page):
    assert page.do("take", robots=[0])[0]
    page.let(4.0)
    done, text = page.do("take", robots=[0], client="c2")
    assert not done
    assert "console-1" in text
    assert page.do("take", robots=[1], client="c2")[0]
    page.let(1.0)
    holders = {row["i"]: row["holder_label"] for row in page.lines_of("rows")[-1]["robots"]}
    assert holders == {0: "console-1", 1: "console-2"}


def test_who_gets_one_of_two_robots_keeps_none(page):
    assert page.do("take", robots=[0])[0]
    done, text = page.do("take", robots=[0, 1], client="c2")
    assert not done
    assert "yours" not in text
    assert unnamed(text, "robot-1", "c1", "Events") == []
    page.let(1.0)
    assert page.do("take", robots=[1], client="c3")[0]


def test_a_permission_on_its_way_to_the_robot_is_news_only_when_it_takes_long(page, monkeypatch):
    """Until the DVA's word has reached the robot, it refuses, and Start is repeated."""
    assert page.do("take", robots=[0])[0]
    asked = {}
    monkeypatch.setattr(steps, "start", lambda *_, **more: asked.update(more))
    page.actions.take({"id": "s", "client": "c1", "do": "start"})
    person = page.world.seating.person(0)
    not_yet = m.Reply(1, m.NOT_PERMITTED, f"{person.device.id_tag} holds no permission here")
    asked["waits"](not_yet)
    assert person.alert == ""
    asked["waits"](m.Reply(1, m.BUSY, "driven by hand"))
    assert unnamed(person.alert, "robot-1", "driven by hand") == []
    page.let(6.0)
    asked["waits"](not_yet)
    assert unnamed(person.alert, "robot-1", "permission") == []


def test_an_emergency_with_an_id_that_was_used_before_stops_all_the_same(driving):
    line = {"id": "x", "client": "program-drive", "do": "emergency", "robots": "all"}
    driving.actions.take(line)
    driving.actions.take(line)  # by another path, at the same time: the same one
    driving.let(2.0)
    assert driving.robot().controller.mode is Mode.IDLE
    answers = [entry for entry in driving.lines_of("done") if entry["id"] == "x"]
    assert driving.do("start")[0]
    driving.let(2.0)
    assert driving.robot().controller.mode is Mode.TELEOPERATION
    driving.actions.take(line)
    driving.let(1.0)
    assert driving.robot().controller.mode is Mode.IDLE
    assert (
        len([entry for entry in driving.lines_of("done") if entry["id"] == "x"]) == len(answers) + 1
    )


def test_an_action_said_twice_is_done_once_and_answered_twice(page):
    line = {"id": "once", "client": "c1", "do": "take", "robots": [0]}
    page.actions.take(line)
    page.let(2.0)
    page.actions.take(line)
    answers = [entry for entry in page.lines_of("done") if entry["id"] == "once"]
    assert len(answers) == 2
    assert answers[0]["text"] == answers[1]["text"] == "robot-1 is yours"


@pytest.mark.parametrize(
    ("what", "about"),
    [
        ("take", {"robots": []}),
        ("take", {"robots": [99]}),
        ("take", {"robots": [True]}),
        ("take", {"robots": "robot-1"}),
        ("start", {}),
        ("stop", {}),
        ("confirm", {}),
        ("decline", {}),
        ("dance", {}),
        ("pace", {"factor": 0.5}),
        ("pace", {"factor": "fast"}),
        ("pace", {"factor": float("nan")}),
        ("pace", {"paused": 1}),
        ("link", {"delay_s": -1}),
        ("link", {"loss": 0.9}),
        ("link", {"delay_s": True}),
        ("pattern", {"robot": 0, "name": "mine.py:Mine"}),
        ("emergency", {"robots": ["robot-9"]}),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_line(page, what, about):
    done, text = page.do(what, **about)
    assert not done
    assert text
    assert "\n" not in text


def test_another_pattern_needs_a_standstill_first_and_then_carries_the_commands(driving):
    done, text = driving.do("pattern", robot=0, name="req-rep")
    assert done, text
    assert driving.robot(0).controller.mode is Mode.IDLE
    assert driving.robot(1).controller.mode is Mode.TELEOPERATION
    driving.let(2.0)
    assert driving.do("stop")[0]
    driving.let(2.0)
    assert driving.do("start")[0]
    driving.let(2.0)
    one, other = driving.seat()["drives"]
    assert (one["pattern"], other["pattern"]) == ("req-rep", "latest-wins")
    assert one["round_trip_ms"] < 50
    assert other["round_trip_ms"] is None
    assert driving.robot(0).body.speed > 0.2


def test_an_order_of_the_dva_is_shown_driven_to_and_confirmed(page):
    page.let(30.0)
    order = page.lines_of("rows")[-1]["order"]
    assert order["kind"] == "fire"
    assert page.do("take", robots=[order["robot"]])[0]
    assert page.seat()["order"] == order
    assert page.do("start")[0]
    page.want(0.2)
    page.let(2.0)
    done, text = page.do("confirm")
    assert done, text
    page.let(0.2)
    event = page.lines_of("events")[-1]["events"][0]
    assert event["state"] == "confirmed"
    assert page.seat()["order"] is None
    assert page.world.recorder.drives[-1].outcome == "confirmed"
    assert page.seat()["phase"] == "free"
    assert "take control again" in page.seat()["alert"]
    page.let(2.0)
    assert page.do("take", robots=[order["robot"]])[0]
    assert page.do("start")[0]


def test_whoever_takes_the_robot_of_an_order_that_waits_sits_where_it_waits(page):
    """The DVA has given the order to the second seat, in which nobody sits any more."""
    page.are_open("c1", "c2", "c3")
    assert page.do("take", robots=[0])[0]
    assert not page.do("take", robots=[0], client="c2")[0]
    page.let(20.0)
    assert page.seat()["order"]["kind"] == "fire"
    assert page.do("release")[0]  # and declines it
    page.let(2.0)
    order = page.lines_of("rows")[-1]["order"]
    assert order["kind"] == "fire"

    assert page.do("take", robots=[order["robot"]], client="c3")[0]
    seat = [line for line in page.lines_of("seat") if line["seat"] == "c3"][-1]
    assert (seat["label"], seat["order"]) == ("console-2", order)


def test_who_loses_an_order_is_told_and_may_take_the_robot_again(monkeypatch):
    page = Page(monkeypatch, dispatch__still_within_s=20)
    page.let(30.0)
    order = page.lines_of("rows")[-1]["order"]
    assert page.do("take", robots=[order["robot"]])[0]
    assert page.do("start")[0]
    page.let(40.0)
    seat = page.seat()
    assert (seat["phase"], seat["order"], seat["drives"]) == ("free", None, [])
    assert "take control again" in seat["alert"]
    assert page.world.recorder.drives[-1].outcome == "recalled"
    assert page.do("take", robots=[order["robot"]])[0]
    assert page.do("start")[0]
    page.want(0.5)
    page.let(2.0)
    assert page.robot(order["robot"]).body.speed > 0.2


@pytest.mark.system
def test_a_robot_that_pushes_against_something_says_so_while_it_creeps(driving):
    robot = driving.robot()
    before = robot.body.in_contact
    for _ in range(400):  # straight on until something is in the way
        driving.let(0.1)
        if robot.body.in_contact and robot.body.speed < 0.05:
            break
    driving.let(0.6)
    shown = driving.lines_of("rows")[-1]["robots"][0]["stop_reason"]
    assert not before
    assert any(word in shown for word in ("way", "stuck"))


def test_the_age_of_an_event_is_that_of_its_state(page):
    page.let(20.0)
    event = page.lines_of("events")[-1]["events"][0]
    assert (event["state"], event["over"]) == ("assigned", False)
    events = page.world.run.dva.core.events
    assigned = 1000 * events.open[event["number"]].times["assigned"]
    assert event["since_ms"] == pytest.approx(assigned, abs=2)  # the message rounds


def test_the_age_of_a_command_is_the_links_delay_and_no_more_than_that_by_much(driving):
    driving.do("link", delay_s=0.25)
    driving.want(0.5)
    driving.let(3.0)
    assert driving.drive()["command_age_ms"] == pytest.approx(252, abs=20)


def test_an_order_to_an_empty_seat_is_declined_after_a_while_and_others_go(page):
    page.let(120.0)
    assert any("declines event 1" in line["what"] for line in page.lines_of("story"))
    assert page.lines_of("events")[-1]["events"][0]["assigned"] == ["guard-2"]


def test_no_rule_of_safety_is_broken_by_all_that(driving):
    driving.do("link", delay_s=0.5)
    driving.let(3.0)
    driving.do("link", loss=0.3, jitter_s=0.1)
    driving.let(5.0)
    driving.do("emergency", robots="all")
    driving.let(5.0)
    assert not driving.world.recorder.violations


@pytest.fixture
def joined(driving):
    """A robot that is no part of the scenario: it registers by itself, and notes what it hears."""
    device = driving.world.run.stage.device("robot", 9)
    device.heard = []

    def answer(message):
        device.heard.append(message.body)
        return m.Reply(message.message_id, m.OK, "")

    device.serve(answer)
    device.register(lambda: None)
    driving.until(lambda: device.id_tag in driving.world.system.robots())
    return device


@pytest.mark.parametrize("named", ["all", "by number", "beside one that is unknown"])
def test_an_emergency_reaches_a_robot_that_has_joined_from_outside(driving, joined, named):
    number = driving.world.feed.numbers[joined.id_tag]
    robots = {"all": "all", "by number": [number], "beside one that is unknown": [77, number]}
    assert driving.do("emergency", robots=robots[named])[0]
    assert m.Emergency() in joined.heard
    assert (driving.robot().controller.mode is Mode.IDLE) == (named == "all")


def test_devices_that_hear_nothing_do_not_hold_up_an_emergency(driving):
    added, _ = driving.do("fake_add", label="decoy", type="Robot")
    assert added
    driving.until(lambda: driving.world.system.robots())
    began = driving.world.clock.now
    assert driving.do("emergency", robots="all")[0]
    assert driving.world.clock.now < began + 2.0


def test_a_robot_whose_computer_was_suspended_stands_until_a_new_order(monkeypatch):
    handlers = []
    for kind in (Clock, LiveClock):
        monkeypatch.setattr(kind, "on_suspended", lambda _, handler: handlers.append(handler))
    page = Page(monkeypatch)
    page.sets_out(0.5, then=3.0)
    for woke in handlers:
        woke(20.0)
    page.let(0.9)
    assert page.robot().controller.mode is Mode.IDLE
    assert page.robot().body.speed == pytest.approx(0.0, abs=1e-3)
    page.until(lambda: page.do("start")[0])
    page.let(2.0)
    assert page.robot().body.speed > 0.1
