"""Alarms of a run: open events, escalations, robots lost in a drive, nobody left."""

from typing import Any

import pytest
from helpers.console.simulated_phone import PhonePage
from helpers.wording import unnamed

from dva_sim.console.asking.refusal import Refused
from dva_sim.console.events.console_alarms import ESCALATED_FOR, ConsoleAlarms
from dva_sim.console.events.robot_conditions import UNHEARD
from dva_sim.worlds.bodies import TickTarget


def event(number: int = 1, **more: Any) -> dict[str, Any]:
    usual = {"number": number, "kind": "gas_leak", "room": "Lab", "severity": "high"}
    usual |= {"state": "assigned", "over": False, "reported_ms": 5000, "since_ms": 6000}
    return usual | {"acknowledged": None} | more


def robot(index: int, **more: Any) -> dict[str, Any]:
    return {"i": index, "mode": "Teleoperation", "watchdog_left_s": 2.0, "stop_reason": ""} | more


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> PhonePage:
    return PhonePage(monkeypatch, client="a1", bystander__count=0)


@pytest.fixture
def alarms(page: PhonePage) -> ConsoleAlarms:
    page.let(5.0)  # everybody has registered
    breaches = page.world.recorder.broken.values
    return ConsoleAlarms(
        page.world.rooms.listener, lambda number: f"robot-{int(number) + 1}", breaches
    )


def texts(alarms: ConsoleAlarms, *events: Any, robots: Any = (), now_ms: int = 10_000) -> list[str]:
    return [row["text"] for row in alarms.look(events, robots, now_ms)["alarms"]]


def test_an_open_event_is_an_alarm_as_grave_as_it_is(alarms):
    (row,) = alarms.look([event()], [], 10_000)["alarms"]

    assert (row["text"], row["priority"], row["since_ms"]) == ("Gas leak, Lab", "high", 5000)
    assert row["event"] == 1


def test_what_the_dva_says_was_acknowledged_is(alarms):
    (row,) = alarms.look([event(acknowledged={"label": "ana"})], [], 10_000)["alarms"]

    assert (row["state"], row["seen_by"]) == ("acknowledged", "ana")


def test_an_escalation_is_critical_for_a_minute_and_then_returned(alarms):
    over = event(state="escalated", over=True, since_ms=10_000)
    (row,) = alarms.look([over], [], 10_000)["alarms"]
    assert (row["priority"], row["state"]) == ("critical", "unacknowledged")

    later = 10_000 + round(1000 * ESCALATED_FOR)
    (row,) = alarms.look([over], [], later)["alarms"]
    assert row["state"] == "returned"
    alarms.acknowledge(row["key"], "ana")
    assert texts(alarms, over, now_ms=later) == []


def test_a_robot_whose_watchdog_has_stopped_it_is_lost(alarms):
    assert texts(alarms, robots=[robot(0), robot(1)]) == []
    lost = robot(0, watchdog_left_s=0.0)
    (text,) = texts(alarms, robots=[lost])
    assert unnamed(text, "robot-1", "watchdog") == []


def test_a_robot_from_outside_that_falls_silent_in_a_drive_is_lost(alarms):
    silent = robot(1, watchdog_left_s=None, stop_reason=UNHEARD)
    (text,) = texts(alarms, robots=[silent])
    assert unnamed(text, "robot-2", UNHEARD) == []
    (row,) = alarms.look([], [silent | {"mode": "Idle"}], 10_000)["alarms"]
    assert row["state"] == "returned"


@pytest.mark.invariant("S4")
def test_a_safety_rule_that_is_broken_is_a_critical_alarm_until_somebody_has_seen_it(page, alarms):
    assert texts(alarms) == []
    run = page.world.run
    body = next(iter(run.field.robots.values())).body
    body._asked.put(0, TickTarget(2.0, 0.0, body._world.tick_at(1e6)))
    page.let(1.0)
    rows = {row["text"]: row for row in alarms.look([], [], 10_000)["alarms"]}
    (asked,) = [text for text in rows if unnamed(text, "S4 ", "robot-1", "2.00 m/s") == []]
    assert (rows[asked]["priority"], rows[asked]["state"]) == ("critical", "unacknowledged")
    assert 5_000 <= rows[asked]["since_ms"] <= 6_000

    alarms.acknowledge(rows[asked]["key"], "ana")
    body._asked.put(0, TickTarget(0.0, 0.0, 0.0))
    page.let(1.0)
    again = {row["text"]: row["state"] for row in alarms.look([], [], 20_000)["alarms"]}
    assert again[asked] == "acknowledged"


def test_a_robot_that_waits_for_its_first_command_is_not(alarms):
    waits = robot(0, watchdog_left_s=0.0, stop_reason="waits for the first command: ...")

    assert texts(alarms, robots=[waits]) == []


def test_nobody_left_to_send_is_an_alarm_only_while_something_waits(page, alarms):
    waits = event(state="pending")
    assert texts(alarms, waits) == ["Gas leak, Lab"]  # somebody is free
    page.world.rooms.listener.devices.clear()

    assert any(unnamed(text, "nobody", "1 wait") == [] for text in texts(alarms, waits))
    rows = alarms.look([event()], [], 10_000)["alarms"]
    assert [row["state"] for row in rows if row["key"] == "nobody"] == ["returned"]


def test_a_row_that_is_gone_is_none_to_act_on(alarms):
    with pytest.raises(Refused, match="is over"):
        alarms.members("event 1")


# --- robots and the system itself --------------------------------------------------------------

CONDITIONS = [
    ({"silent": True, "mode": "Idle"}, "robot-1 is lost: the DVA hears nothing of it", "high"),
    ({"battery": 0.2}, "robot-1: battery at 20 %", "medium"),
    ({"battery": 0.05}, "robot-1: battery at 5 %", "high"),
    ({"emergency": {"by": "ana"}}, "Emergency stop: robot-1 stopped until released", "high"),
]


@pytest.mark.parametrize(("row", "text", "priority"), CONDITIONS)
def test_what_somebody_has_to_do_about_a_robot_is_an_alarm_until_it_is_done(
    alarms, row, text, priority
):
    assert texts(alarms, robots=[robot(0), robot(1)]) == []
    (shown,) = alarms.look([], [robot(0, **row), robot(1)], 10_000)["alarms"]
    assert (shown["text"], shown["priority"]) == (text, priority)
    (shown,) = alarms.look([], [robot(0), robot(1)], 10_000)["alarms"]
    assert shown["state"] == "returned"


def test_a_fleet_that_stands_is_one_alarm(alarms):
    stands = {"emergency": {"by": "ana"}}
    (text,) = texts(alarms, robots=[robot(0, **stands), robot(1, **stands), robot(2)])
    assert text == "Emergency stop: 2 of 3 robots stopped until released"


def test_a_dva_that_says_nothing_is_an_alarm_until_it_speaks_again(page):
    page.let(3.0)
    assert page.do("server_stop")[0]
    page.let(7.0)
    (alarm,) = [row for row in page.lines_of("alarms")[-1]["alarms"] if row["key"] == "dva silent"]
    assert alarm["priority"] == "critical"
    assert page.do("server_start", port=6000)[0]
    page.let(5.0)
    (alarm,) = [row for row in page.lines_of("alarms")[-1]["alarms"] if row["key"] == "dva silent"]
    assert alarm["state"] == "returned"


def test_what_gets_graver_after_it_was_acknowledged_calls_again(alarms):
    seen = {"acknowledged": {"label": "ana"}}
    alarms.look([event(severity="low", **seen)], [], 10_000)
    (row,) = alarms.look([event(severity="critical", **seen)], [], 11_000)["alarms"]
    assert row["state"] == "unacknowledged"
    assert alarms.by_event([row["key"]]) == {}  # the DVA knows who answers for the event
    alarms.acknowledge(row["key"], "ben")
    (row,) = alarms.look([event(severity="critical", **seen)], [], 12_000)["alarms"]
    assert (row["state"], row["seen_by"]) == ("acknowledged", "ben")
