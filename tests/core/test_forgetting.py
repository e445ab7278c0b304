"""Devices that go away are forgotten: when, who lasts, who makes room, and what the file knows."""

import sqlite3
from collections.abc import Sized
from contextlib import closing
from dataclasses import fields
from typing import Any

import pytest
from helpers.dva.dispatch_office import (
    ADDRESS,
    DETECTOR,
    GUARD,
    OPERATOR,
    OTHER_OPERATOR,
    OTHER_ROBOT,
    ROBOT,
    Office,
)
from helpers.wording import counted

from dva_sim.core.events import State
from dva_sim.core.sessions import Send
from dva_sim.core.store import Store
from dva_sim.protocol import messages as m

pytestmark = pytest.mark.invariant("S10")
SILENT, FORGOTTEN = 10.1, 60.1  # after the last word [s]
STRANGER = "02:00:00:09:00:09"


@pytest.fixture
def office() -> Office:
    return Office()


def known(office: Office) -> set[str]:
    return set(office.core.registry.entries)


def only(office: Office, *heard: str, until: float, since: float = 0.0) -> list[Send]:
    """Time passes, second by second; nobody is heard but these."""
    sends: list[Send] = []
    for second in range(round(since) + 1, int(until) + 1):
        office.beat(*heard, now=second - 0.5)
        sends += office.tick(float(second), alive=False)
    return sends + office.tick(until, alive=False)


def held(office: Office, holder: str = OPERATOR, robot: str = ROBOT, now: float = 0.0) -> int:
    content = office.say(holder, m.PermissionRequest(robot, "teleoperation"), now)[0].content
    assert isinstance(content, m.Permission)
    return content.session


# --- when ----------------------------------------------------------------------------------


def test_who_is_silent_for_a_minute_is_forgotten_and_has_to_register_again(office):
    only(office, OPERATOR, ROBOT, GUARD, until=60.0)
    assert DETECTOR in known(office)
    only(office, OPERATOR, ROBOT, GUARD, since=60.0, until=FORGOTTEN)
    assert known(office) == {OPERATOR, ROBOT, GUARD}
    assert office.fire(12, now=61.0) == []
    assert office.say(DETECTOR, m.GetDeviceList(), 61.0)[0].code == m.NOT_REGISTERED
    assert office.say(DETECTOR, m.Registration("detector", "Sensor", ADDRESS), 61.0)[0].code == 0
    assert DETECTOR in known(office)


def test_who_is_heard_again_is_not_forgotten(office):
    only(office, OPERATOR, until=40.0)
    office.beat(ROBOT, now=41.0)
    only(office, OPERATOR, since=41.0, until=100.9)
    assert known(office) == {OPERATOR, ROBOT}


def test_who_registers_again_after_that_comes_last(office):
    only(office, OPERATOR, until=FORGOTTEN)
    office.register(GUARD, "Guard", now=61.0)
    office.register(ROBOT, "Robot", now=61.0)
    entries = office.core.registry.entries
    assert sorted(entries, key=lambda device: entries[device].place) == [OPERATOR, GUARD, ROBOT]


# --- who lasts -----------------------------------------------------------------------------


def test_a_robot_that_somebody_holds_is_not_forgotten(office):
    session = held(office)
    only(office, OPERATOR, until=200.0)
    assert known(office) == {OPERATOR, ROBOT}
    office.say(OPERATOR, m.PermissionRevocation(ROBOT, OPERATOR, session), 200.0)
    office.ok([Send(ROBOT, m.PermissionRevocation(ROBOT, OPERATOR, session))], 200.0)
    office.tick(201.0, alive=False)
    assert ROBOT not in known(office)


@pytest.mark.invariant("S5")
def test_a_robot_that_has_not_heard_of_an_end_lasts_and_is_told_when_it_is_back(office):
    session = held(office)
    over = Send(ROBOT, m.PermissionRevocation(ROBOT, OPERATOR, session))
    sends = only(office, ROBOT, until=SILENT)
    assert over in sends  # its holder is silent
    office.no([over], SILENT)
    reported = only(office, GUARD, since=SILENT, until=300.0)
    assert ROBOT in known(office)
    assert reported.count(over) <= 1  # while the robot was just silent; it is not there to hear
    office.no([over], 300.0)
    office.status(ROBOT, 10, now=301.0)
    assert office.tick(301.0, alive=False) == [over]


@pytest.mark.invariant("S6")
def test_who_works_on_an_event_is_replaced_first_and_then_forgotten(office):
    office.ok(office.fire(12))
    assert office.event().responder == ROBOT
    only(office, GUARD, until=FORGOTTEN)
    assert known(office) == {GUARD}
    assert office.event().responder == GUARD
    assert office.event().sources  # its detector is forgotten, what it reported is not
    assert office.core.events.counts[State.ASSIGNED] == office.core.events.total == 1


def test_what_was_sent_to_who_is_forgotten_may_come_back_undelivered(office):
    sends = office.fire(12)
    only(office, GUARD, until=FORGOTTEN)
    for send in sends:
        office.no([send], 61.0)
        office.ok([send], 61.0)
    assert office.event().responder == GUARD


# --- who makes room ------------------------------------------------------------------------


def test_in_a_full_registry_the_longest_silent_makes_room(office):
    office.core.registry.most = 4
    office.beat(OPERATOR, now=5.0)
    office.beat(ROBOT, now=6.0)
    office.tick(20.0, alive=False)
    assert office.say(STRANGER, m.Registration("x", "TeleOp", ADDRESS), 20.0)[0].code == m.OK
    assert known(office) == {GUARD, OPERATOR, ROBOT, STRANGER}  # the detector said least
    assert counted(office.core.counters, "forgotten", "room") == 1


def test_of_whom_something_is_open_makes_room_last_and_its_holder_hears_that(office):
    session = held(office)
    only(office, OPERATOR, until=20.0)
    office.core.registry.most = 4
    everybody = [f"02:00:00:09:00:{number:02X}" for number in range(3)]
    reported: list[Send] = []
    for device in everybody:
        assert ROBOT in known(office)
        reported = office.say(device, m.Registration("x", "TeleOp", ADDRESS), 20.0)[1]
    over = m.PermissionRevocation(ROBOT, OPERATOR, session)
    assert Send(OPERATOR, over) in reported
    assert known(office) == {OPERATOR, *everybody}
    assert office.say(STRANGER, m.Registration("x", "TeleOp", ADDRESS), 20.0)[0].code == m.BUSY
    # The robot was never told: as soon as it is back, it is.
    office.no([Send(ROBOT, over)], 21.0)
    office.core.registry.most = 5
    office.register(ROBOT, "Robot", now=22.0)
    assert Send(ROBOT, over) in office.tick(22.0)


# --- waves ---------------------------------------------------------------------------------


def sizes(thing: Any, depth: int = 4) -> dict[str, int]:
    """Number of items in every container of the core, by path."""
    found: dict[str, int] = {}
    names = [f.name for f in fields(thing)] if hasattr(thing, "__dataclass_fields__") else []
    for name in {*names, *vars(thing)} if hasattr(thing, "__dict__") else names:
        value = getattr(thing, name)
        if isinstance(value, dict) and value and all(isinstance(v, dict) for v in value.values()):
            found[name] = sum(len(v) for v in value.values())
        elif isinstance(value, Sized) and not isinstance(value, str):
            found[name] = len(value)
        elif depth and type(value).__module__.startswith("dva_sim.core."):
            found |= {f"{name}.{k}": v for k, v in sizes(value, depth - 1).items()}
    return found


def test_after_ten_waves_the_core_holds_what_it_held_after_the_first(office, tmp_path):
    """Each is heard once; half of the operators hold a robot of their wave and ask others."""
    memory = Store(tmp_path / "state.sqlite")
    core, now, after = office.core, 0.0, []
    kinds = ["Robot", "TeleOp", "Guard", "Sensor"]
    for wave in range(10):
        for index in range(200):
            device = f"0A:{wave:02X}:00:00:00:{index:02X}"
            office.register(device, kinds[index % 4], 20.0 if index % 4 in (0, 2) else None, now)
            if index % 8 == 1:
                robot = f"0A:{wave:02X}:00:00:00:{index - 1:02X}"
                office.say(device, m.PermissionRequest(robot, "teleoperation"), now)
        for _ in range(70):
            now += 1.0
            office.beat(*TEAM_THERE, now=now)
            sends = office.tick(now, alive=False)
            office.ok([send for send in sends if send.to in TEAM_THERE], now)
            office.ok([s for s in sends if isinstance(s.body, m.PermissionRevocation)], now)
            office.core.registry.moves()
            assert memory.keep(core, core.events.changes(), now) is None
        office.sent.clear()
        after.append(sizes(core))
    memory.close()
    assert after[-1] == after[0]
    assert known(office) == set(TEAM_THERE)
    with closing(sqlite3.connect(tmp_path / "state.sqlite")) as file:
        rows = {table: file.execute(f"SELECT count(*) FROM {table}").fetchone() for table in TABLES}
    assert rows == {"devices": (4,), "grants": (0,), "untold": (0,)}


TEAM_THERE = (GUARD, ROBOT, OPERATOR, DETECTOR)
TABLES = ("devices", "grants", "untold")


# --- the file ------------------------------------------------------------------------------


def test_the_next_life_does_not_know_who_was_forgotten_and_knows_every_event(office, tmp_path):
    office.register(OTHER_ROBOT, "Robot", 50)
    office.register(OTHER_OPERATOR, "TeleOp")
    file = tmp_path / "state.sqlite"
    memory = Store(file)
    office.fire(12)
    office.fire(90, kind="flood")
    memory.keep(office.core, office.core.events.changes(), 0.0)
    held(office, OTHER_OPERATOR, OTHER_ROBOT)
    only(office, OTHER_OPERATOR, GUARD, until=FORGOTTEN)
    memory.keep(office.core, office.core.events.changes(), FORGOTTEN)
    memory.close()
    core = office.new_core()
    memory = Store(file)
    memory.recall(core, 0.0)
    memory.close()
    assert set(core.registry.entries) == {OTHER_OPERATOR, GUARD, OTHER_ROBOT}
    assert core.registry.entries.keys() == known(office)
    assert core.events.total == 2
    assert {
        e.number: e.state for e in (*core.events.open.values(), *core.events.closed.values())
    } == {n: office.event(n).state for n in (1, 2)}
