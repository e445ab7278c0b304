"""Each line as it is declared: what a checker of them finds."""

import pytest
from helpers.console.declared_lines import at_page, checked
from helpers.console.remote_console import attached
from helpers.console.simulated_phone import FIRE, PhonePage
from pydantic import ValidationError

from dva_sim.console.wire.lines import ToPage

PLACES = {"k": "pos", "t": 5, "p": [[0, 1, 2, 3, 4]]}
CLOCK = {"factor": 1, "paused": False, "lag_s": 0.0, "given_up_s": 0.0, "held_by_lag": False}
ROWS = {"k": "rows", "t": 5, "clock": CLOCK, "link": None, "dropped": 0, "robots": []}
ROWS |= {"people": [], "order": None}


@pytest.mark.parametrize("line", [PLACES, ROWS])
def test_a_line_as_declared_arrives(line):
    assert checked(line) == line


@pytest.mark.parametrize(
    "line",
    [
        {**PLACES, "more": 1},
        {"k": "pos", "t": 5},
        {**PLACES, "t": 5.5},
        {**PLACES, "p": [[0, 1.5, 2, 3, 4]]},
        {**ROWS, "clock": {**CLOCK, "speed": 1}},
        {**ROWS, "clock": {**CLOCK, "lag_s": float("nan")}},
        {**ROWS, "people": [{"i": 0}]},
    ],
)
def test_a_line_with_an_unknown_a_missing_or_a_wrong_key_is_found(line):
    with pytest.raises(ValidationError):
        checked(line)


@pytest.mark.parametrize("kind", ["new", "snap"])
def test_a_kind_that_nobody_declared_is_found(kind):
    with pytest.raises(KeyError, match=kind):
        checked({"k": kind})
    with pytest.raises((KeyError, ValidationError)):
        checked({"k": kind}, ToPage)


def kinds(messages):
    return {message["k"] for message in messages}


def test_what_a_page_gets_of_a_world_is_as_declared(monkeypatch):
    page = PhonePage(
        monkeypatch, client="p1", events=FIRE, guard__kind={2: "person"}, bystander__count=1
    )
    page.actions.take({"client": "p1", "do": "watch", "robots": [0]})
    looked = {"client": "p1", "do": "look", "logs": {"dva": True, "robot-1": False}}
    page.actions.take(looked | {"tables": ["devices"]})
    assert page.do("guard_join", client="g1", guard="guard-2")[0]
    assert page.do("room_join", client="c1", name="ana", role="supervise")[0]
    page.drives_by_tilt(then=2.0)
    assert page.do("fault", robot=0, what="processing", on=True, seconds=0.5)[0]
    assert page.ask("tour")["tour"]["robots"] == [0, 1]
    page.let(1.0)
    reported = at_page(page.lines, "p1")
    others = at_page(page.lines, "g1")
    usual = {"snap", "d", "rows", "seat", "robot", "log", "devices", "events", "control", "story"}
    assert usual | {"alarms", "hazards"} <= kinds(reported)
    assert {"snap", "guard", "seat"} <= kinds(others)
    assert [one["robots"] for one in others if one.get("short")][-1] == [0]


def test_what_a_page_gets_of_a_dva_elsewhere_is_as_declared(monkeypatch, tmp_path):
    with attached(monkeypatch, tmp_path) as page:
        assert page.ask("room_join", name="ana")["ok"]
        page.actions.take({"client": "c1", "do": "look", "logs": {}, "tables": ["devices"]})
        page.ask("event_acknowledge", event=1)
        page.let(2.0)
        messages = kinds(at_page(page.lines, "c1"))
    assert messages >= {"snap", "rows", "devices", "events", "control", "alarms", "audit", "story"}
