"""The DVA gives orders to seats and control rooms only while somebody is there."""

import pytest
from helpers.console.simulated_phone import PhonePage

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.asking.seats import RELOADED
from dva_sim.protocol.devices import ControlRoomRole
from dva_sim.ros.gateway import RosGateway
from dva_sim.simulation.full.stage import kind_of

SILENT_AFTER = 10.0  # after which the DVA counts a device as silent [s]
FIRE = [{"kind": "fire", "room": "North office", "at_s": 15, "latest_s": 15, "reported": True}]


@pytest.fixture
def page(monkeypatch):
    """A console in which a fire is reported after 15 s; one page of a driver is open."""
    return PhonePage(monkeypatch, client="c1", events=FIRE)


def ordered(page):
    """Labels of the devices of people that the DVA has sent an order about the fire."""
    event = page.world.run.dva.core.events.get(1)
    people = [device for device in event.sent if kind_of(device)[0] in ("console", "phone")]
    return [page.world.run.stage.labels[device] for device in people]


def stays(page):
    """The only page stays open."""


def closes(page):
    page.are_open()


def drives(page):
    assert page.do("take", robots=[0])[0]


def drives_and_closes(page):
    drives(page)
    page.are_open()


def registers_phone(page):
    page.are_open()
    assert page.register("p1", label="mine")["ok"]


def loses_phone(page):
    registers_phone(page)
    page.are_open()


@pytest.mark.parametrize(
    ("does", "expected"),
    [
        (stays, ["console-1"]),
        (drives, ["console-1"]),
        (registers_phone, ["mine"]),
        (closes, []),
        (drives_and_closes, []),
        (loses_phone, []),
    ],
)
def test_an_order_goes_to_a_seat_only_while_somebody_is_there(page, does, expected):
    does(page)
    page.let(30.0)
    assert ordered(page) == expected
    assert bool(page.lines_of("rows")[-1]["order"]) == (does is stays)


def test_a_robot_is_free_for_a_client_of_ros_while_no_page_is_open(page):
    page.are_open()
    gateway = RosGateway(page.world.run.stage, lambda: page.world.seating.console)
    page.let(25.0)
    answers = []
    for robot in page.world.run.field.robots:
        gateway.driver().take(robot, lambda done, text: answers.append(done))
    page.let(5.0)
    assert answers == [True, True]


@pytest.mark.parametrize(
    ("away", "kept"), [(RELOADED - 0.5, True), (RELOADED + 0.5, False), (60.0, False)]
)
def test_a_page_that_is_loaded_again_keeps_its_order(page, away, kept):
    page.until(lambda: page.world.seating.person(0).order)
    order = page.world.seating.person(0).order
    page.are_open()
    page.let(away)
    assert (page.world.seating.person(0).order is order) == kept
    page.are_open("c1")
    page.let(2.0)
    entry = page.world.run.dva.core.registry.entries[page.world.seating.person(0).device.id_tag]
    assert not entry.silent


def test_an_order_that_reaches_a_seat_too_late_goes_to_somebody_else_at_once(page):
    page.let(14.0)
    page.are_open()
    page.let(RELOADED + 0.5)
    assert ordered(page) == ["console-1"]
    event = page.world.run.dva.core.events.get(1)
    assert kind_of(event.responder)[0] == "guard"
    assert page.lines_of("rows")[-1]["order"] is None


@pytest.mark.parametrize("is_open", [True, False])
def test_a_control_room_decides_only_while_its_page_is_open(page, is_open):
    assert page.do("room_join", name="", role="dispatch")[0]
    page.are_open(*(["c1"] if is_open else []))
    page.let(SILENT_AFTER + 2.0)
    dispatcher = page.world.run.dva.core.dispatcher
    assert dispatcher.somebody_decides() == is_open
    assert page.world.run.dva.core.roles.of("02:00:00:07:03:E9") is ControlRoomRole.DISPATCH
    page.are_open("c1")
    page.let(2.0)
    assert dispatcher.somebody_decides()


def test_an_emergency_stop_needs_no_open_page(page):
    """A program asks for it, whose seat nobody has ever manned."""
    page.are_open()
    gateway = RosGateway(page.world.run.stage, lambda: page.world.seating.console)
    page.let(5.0)
    driver, answers = gateway.driver(), []
    robot = page.robot()
    driver.take(robot.device.id_tag, lambda done, text: answers.append(done))
    page.until(lambda: answers)
    assert (answers, robot.controller.mode) == ([True], Mode.TELEOPERATION)
    assert page.do("emergency", robots="all", client="program")[0]
    assert robot.controller.mode is Mode.IDLE
