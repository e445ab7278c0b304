"""A console that is attached to several DVAs: by their messages alone, as far as they tell."""

import json
import os
import re
import signal
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from helpers.console.console_program import started
from helpers.console.remote_console import RemotePage
from helpers.console.simulated_phone import PhonePage
from helpers.processes.patience import becomes
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.remote.options import check, own_ids
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.keys import KeyRing, create_keys
from dva_sim.options.runs import ConsoleOptions
from dva_sim.simulation.full.stage import id_of

HALL = {
    "site": {"name": "hall"},
    "robot": {"count": 2},  # at y 6 m and 10 m
    "guard": {"count": 2},
    "operator": {"count": 1},
    "bystander": {"count": 0},
    "dispatch": {"mode": "ask_first"},
    "dva": {
        "regions": {
            "low": {"polygon": [[0, 0], [60, 0], [60, 8], [0, 8]]},
            "high": {"rest": True},
        },
    },
    "events": [
        {"kind": "fire", "position": [30, 4], "at_s": 2, "reported": True},
        {"kind": "flood", "position": [50, 20], "at_s": 2, "reported": True},
    ],
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "hall.yaml"
    file.write_text(json.dumps(HALL))
    return file


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, path: Path) -> RemotePage:
    world = PhonePage(monkeypatch, client="w1", scenario=HALL)
    page = RemotePage(world, tmp_path / "audit.sqlite", scenario=str(path))
    page.actions.take({"client": "c1", "do": "look", "logs": {}, "tables": ["devices"]})
    page.until(lambda: len(page.events()) == 2)
    assert page.ask("room_join", name="ana")["ok"]
    page.let(3.0)
    return page


def regions(page: RemotePage) -> dict[str, str]:
    return {row["name"]: row["state"] for row in page.lines_of("rows")[-1]["regions"]}


def dvas(page: RemotePage) -> dict[str, str | None]:
    return {row["label"]: row["dva"] for row in page.lines_of("devices")[-1]["devices"]}


def test_it_shows_the_events_devices_and_borders_of_all_regions(page):
    assert {row["kind"] for row in page.events()} == {"fire", "flood"}
    table = dvas(page)
    assert (table["guard-1"], table["robot-1"]) == ("dva-high", "dva-low")
    assert not any(label.startswith("control room") for label in table)
    assert regions(page) == {"low": "served", "high": "served"}
    assert [one["name"] for one in page.lines_of("scene")[-1]["site"]["regions"]] == ["low", "high"]


def test_people_decide_on_events_of_all_regions_under_their_names(page):
    for event in page.events():
        answer = page.ask("event_note", event=event["number"], text="a note")
        assert answer["ok"], answer
    page.let(1.0)
    assert {row["note"] for row in page.events()} == {"a note"}
    noted = [(row.author, row.event) for row in page.written() if row.action == "note"]
    assert sorted(noted) == [("ana", event["number"]) for event in page.events()]


def test_a_dead_dva_is_an_alarm_and_the_rest_goes_on(page):
    page.world.world.run.end_dva(1)
    page.let(8.0)
    assert "Region low: dva-low is silent: nobody serves it" in page.alarms()
    assert page.system.answers
    page.let(20.0)
    assert regions(page) == {"low": "deputy", "high": "served"}
    deputy = "Region low: served by dva-high, its deputy, as dva-low is silent"
    assert deputy in page.alarms()
    assert len([one for one in page.alarms() if one.startswith(("Fire", "Flood"))]) == 2
    assert not any(row["silent"] for row in page.lines_of("rows")[-1]["robots"])


def test_a_robot_of_any_region_is_driven_and_stays_in_its_window(page):
    robots = list(page.world.world.run.field.robots.values())
    for robot in robots:
        label = robot.device.label
        assert page.ask("take", robots=[label])["ok"]
        assert page.ask("start")["ok"]
        page.let(1.0)
        assert robot.controller.mode is Mode.TELEOPERATION
        assert page.ask("release")["ok"]
        page.let(2.0)
    numbers = [row["i"] for row in page.lines_of("rows")[-1]["robots"]]
    assert len(numbers) == 2


def test_a_dva_that_is_started_again_tells_its_events_anew(page):
    run = page.world.world.run
    run.end_dva(2)
    run.start_region_again(2)
    page.let(15.0)
    assert page.system.has_all_events
    assert {row["kind"] for row in page.events()} == {"fire", "flood"}


# --- the programs -------------------------------------------------------------------------------


@pytest.mark.system
def test_it_joins_live_dvas_and_goes_on_when_one_is_killed(programs, path):
    live = programs.start("live", path, "--for", "1000")
    live.wait_to_say("is sent to event", "DVA: ")
    dvas = re.findall(r"^DVA: (\S+)$", live.output, re.MULTILINE)
    console, address = started(programs, path, "--dva", ",".join(dvas))
    console.wait_to_say(f"Attached to: {dvas[0]},{dvas[1]}")

    def state() -> dict[str, Any]:
        base, _, token = address.partition("?token=")
        headers = {"Authorization": f"Bearer {token}"}
        request = urllib.request.Request(f"{base}api/state", headers=headers)
        with urllib.request.urlopen(request, timeout=30) as answer:
            return json.load(answer)

    def shown() -> tuple[set[str], set[str]]:
        now = state()
        robots = {one["label"] for one in now["robots"] if "x_m" in one}
        return {one["kind"] for one in now["events"]}, robots

    everything = {"fire", "flood"}, {"robot-1", "robot-2"}
    assert becomes(lambda: shown() == everything)
    killed = next(
        process
        for process, command in programs.processes().items()
        if '"part": "dva", "number": 1' in command
    )
    os.kill(killed, signal.SIGKILL)
    live.wait_to_say("takes over low")
    assert becomes(lambda: shown() == everything)
    numbers = [one["i"] for one in state()["robots"] if one.get("silent")]
    assert numbers == []


# --- how it is asked for ------------------------------------------------------------------------


@pytest.mark.parametrize("dva", ["127.0.0.1:5600", "127.0.0.1:5600,127.0.0.1:5602,127.0.0.1:5604"])
def test_each_region_needs_the_address_of_its_dva(path, dva):
    with pytest.raises(ConfigError) as refused:
        check(ConsoleOptions(dva=dva, scenario=str(path)))
    assert unnamed(str(refused.value), "--dva", "2 regions", str(1 + dva.count(","))) == []
    check(ConsoleOptions(dva="127.0.0.1:5600,127.0.0.1:5602", scenario=str(path)))


def test_with_keys_each_dva_needs_a_control_room_of_its_own(tmp_path):
    rooms = [id_of("control-room", number) for number in (1, 2)]
    create_keys(tmp_path, rooms[:1])
    with pytest.raises(ConfigError, match="control-room-2"):
        own_ids(KeyRing(tmp_path), 2)
    create_keys(tmp_path, rooms[1:])
    assert sorted(own_ids(KeyRing(tmp_path), 2)) == rooms
