"""Missions of robots in hand: ordered, followed and cancelled by messages, refused in words."""

import pytest
from helpers.console.simulated_console import Page
from helpers.console.simulated_phone import FIRE, PhonePage

from dva_sim.agents.robot.controller import Mode
from dva_sim.protocol import messages as m


@pytest.fixture
def page(monkeypatch):
    return PhonePage(monkeypatch)


@pytest.fixture
def holding(page):
    page.register()
    page.permit(level="missions")
    page.let(2.0)
    return page


def mission(page):
    return page.seat()["drives"][0]["mission"]


def beside(page, metres):
    """A place so far before the robot."""
    body = page.robot().body
    return [body.x + metres, body.y]


def order(page, what, **more):
    return page.ask("mission_order", robot=0, what=what, **more)


def test_a_robot_goes_where_a_phone_sends_it_and_says_when_it_is_there(holding):
    goal = beside(holding, 1.5)
    done = order(holding, "go_to", places_m=[goal])
    assert (done["ok"], done["text"]) == (True, "robot-1 is on its way")
    assert holding.robot().controller.mode is Mode.MISSION
    assert mission(holding) == {"state": "under_way", "places_left": 1, "reason": ""}
    holding.let(20.0)
    assert mission(holding)["state"] == "done"
    assert holding.robot().body.x == pytest.approx(goal[0], abs=0.6)


def test_a_mission_is_cancelled_and_another_one_waits_until_then(holding):
    places = [beside(holding, 1.5), beside(holding, 3.0)]
    assert order(holding, "patrol", places_m=places)["ok"]
    holding.let(2.0)
    busy = order(holding, "return_to_base")
    assert (busy["ok"], busy["text"]) == (False, "robot-1: in mode Mission")
    assert holding.ask("mission_cancel", robot=0)["ok"]
    assert (mission(holding)["state"], mission(holding)["reason"]) == ("failed", "cancelled")
    assert holding.robot().controller.mode is Mode.IDLE
    assert order(holding, "return_to_base")["ok"]  # as soon as the robot stands
    assert isinstance(holding.robot().controller.mission, m.ReturnToBase)


def test_an_event_is_inspected(monkeypatch):
    page = PhonePage(monkeypatch, events=FIRE)
    page.register()
    page.permit(level="both")
    page.let(5.0)  # until it is reported
    assert order(page, "inspect", event=1)["ok"]
    assert page.robot().controller.mission.event_id == 1


@pytest.mark.parametrize(
    ("level", "asked", "why"),
    [
        ("teleoperation", {"what": "return_to_base"}, "the permission is for teleoperation"),
        ("missions", {"what": "inspect", "event": 99}, "Choose an event."),
        ("missions", {"what": "go_to"}, "Tap a place on the map."),
        ("missions", {"what": "go_to", "places_m": [[900.0, 0.0]]}, "outside the site"),
    ],
)
def test_what_cannot_be_ordered_is_refused_in_words(page, level, asked, why):
    page.register()
    page.permit(level=level)
    done = page.ask("mission_order", robot=0, **asked)
    assert not done["ok"]
    assert why in done["text"]


def test_the_dva_refuses_missions_of_a_robot_to_whom_the_rules_give_none(monkeypatch):
    rules = [{"robots": ["robot-1"], "levels": ["teleoperation"]}]
    page = PhonePage(monkeypatch, access=rules)
    page.register()
    done = page.permit(level="missions")
    assert not done["ok"]
    assert "may not have missions of robot-1" in done["text"]


def test_an_operator_at_the_desk_may_do_both(monkeypatch):
    page = Page(monkeypatch)
    assert page.do("take", robots=[0], level="both")[0]
    page.let(2.0)
    assert page.do("mission_order", robot=0, what="return_to_base")[0]
    assert page.do("mission_cancel", robot=0)[0]
    page.let(1.0)
    assert page.do("start")[0]
    assert page.robot().controller.mode is Mode.TELEOPERATION


def test_who_holds_no_robot_sends_none(page):
    page.register()
    done = page.ask("mission_order", robot=0, what="return_to_base")
    assert (done["ok"], done["text"]) == (False, "You do not hold robot-1.")
