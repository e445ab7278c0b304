"""Alarms of an attached console: by messages alone, and through a restart of the DVA."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.console.remote_console import OWN, RemotePage, attached
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.system.known_system import UNHEARD

pytestmark = pytest.mark.system

FIRE = "Fire, North office"


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[RemotePage]:
    with attached(monkeypatch, tmp_path) as one:
        one.ask("room_join", name="ana")
        yield one


def lists(page: RemotePage) -> list[list[str]]:
    """All lists that the page was told, as their texts and states."""
    return [
        [f"{row['text']}: {row['state']}" for row in entry["alarms"]]
        for entry in page.lines_of("alarms")
    ]


def test_an_open_event_is_an_alarm_and_seen_by_a_message_to_the_dva(page):
    assert page.alarms() == [FIRE]
    assert page.ask("alarm_acknowledge", alarm="event 1")["ok"]
    page.let(1.0)

    (row,) = page.lines_of("alarms")[-1]["alarms"]
    assert row["state"] == "acknowledged"
    assert page.events()[0]["acknowledged"]["label"] == "control room"
    rows = {(row.action, row.author) for row in page.written()}
    assert {("acknowledge", "ana"), ("alarm acknowledge", "ana")} <= rows


def test_an_alarm_is_shelved_by_name_and_comes_back(page):
    page.alarms()
    assert page.ask("alarm_shelve", alarm="event 1", for_s=60.0, reason="a drill")["ok"]
    assert page.alarms() == []
    (shelved,) = page.lines_of("alarms")[-1]["shelved"]
    assert shelved["shelved_by"] == "ana"
    page.let(60.0)
    assert page.alarms() == [FIRE]


def test_while_the_dva_does_not_answer_alarms_stay_and_none_but_that_comes(page):
    page.alarms()
    reported = len(lists(page))
    assert page.world.do("server_stop")[0]
    page.let(UNHEARD + 30.0)  # by now its list counts as old, and names nobody to be sent
    assert not page.system.answers
    assert page.world.do("server_start", port=5600)[0]
    page.until(lambda: page.system.answers and page.system.has_all_events)
    page.let(1.0)

    silence = "The DVA at 198.51.100.1:5600 is silent"
    others = [[one for one in each if silence not in one] for each in lists(page)[reported:]]
    assert {tuple(each) for each in others} == {(f"{FIRE}: unacknowledged",)}
    assert lists(page)[-1][0] == f"{silence}: returned"


def test_after_a_restart_of_the_dva_alarms_neither_vanish_nor_come_back(page):
    page.alarms()
    reported = len(lists(page))
    listed, page.system.agent.on_list = page.system.agent.on_list, lambda: None
    page.world.world.run.dva.dismiss(OWN)  # it knows nothing of this console any more
    page.until(lambda: not page.system.has_all_events)
    page.let(5.0)  # its events are not all told yet
    page.system.agent.on_list = listed
    page.until(lambda: page.system.has_all_events)
    page.let(2.0)

    assert {tuple(each) for each in lists(page)[reported:]} <= {(f"{FIRE}: unacknowledged",)}
    assert all(line["events"] for line in page.lines_of("events")[1:])


def test_a_robot_of_which_nothing_is_heard_since_it_was_driven_is_lost(page):
    assert page.world.do("take", robots=["robot-1"])[0]
    assert page.world.do("start")[0]
    robot = page.world.robot()
    page.until(lambda: robot.controller.mode is Mode.TELEOPERATION)
    page.let(1.0)
    page.world.world.run.network.leave(robot.device.id_tag)
    page.let(15.0)

    assert any(unnamed(text, robot.device.label, "lost") == [] for text in page.alarms())


def test_nobody_is_left_to_send_once_all_were_sent(monkeypatch, tmp_path):
    raised = [("flood", 20.0), ("gas_leak", 20.0), ("flood", 36.0)]
    everybody = ("guard-1", "guard-2", "robot-1")
    with attached(monkeypatch, tmp_path, robot__count=1) as page:
        for number, (label, (kind, x)) in enumerate(zip(everybody, raised, strict=True), 1):
            assert page.ask("event_assign", event=number, device=label)["ok"]
            assert page.ask("event_raise", kind=kind, severity="low", x_m=x, y_m=12.0)["ok"]
            page.until(lambda number=number: len(page.events()) > number)
            nobody = any("nobody is left to send" in text for text in page.alarms())
            assert nobody == (label == everybody[-1])


def test_an_event_beyond_the_site_is_refused_as_at_a_console_of_its_own(tmp_path, monkeypatch):
    with attached(monkeypatch, tmp_path) as page:
        answer = page.ask("event_raise", kind="fire", severity="low", x_m=100.0, y_m=12.0)
    assert not answer["ok"]
    assert "outside the site" in answer["text"]
