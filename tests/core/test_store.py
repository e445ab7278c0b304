"""State that survives a killed DVA, and files that are full, locked or invalid."""

import math
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing, suppress
from pathlib import Path

import pytest
from helpers.dva.dispatch_office import (
    ADDRESS,
    GUARD,
    OPERATOR,
    OTHER_GUARD,
    ROBOT,
    Office,
)
from helpers.dva.random_days import Walk, snapshot
from helpers.paths import TESTS

from dva_sim.core import store
from dva_sim.core.assignments import Rules
from dva_sim.core.dva import Dva
from dva_sim.core.events import State
from dva_sim.core.permissions import Access, AccessRule
from dva_sim.core.sessions import Send
from dva_sim.core.store import Store
from dva_sim.kernel.errors import ConfigError
from dva_sim.protocol import messages as m
from dva_sim.protocol.exchange import A_DAY

RULES = Rules(containment=True, escalate_after=60.0)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "state.sqlite"


def keep(office: Office, memory: Store, now: float = 0.0) -> str | None:
    return memory.keep(office.core, office.core.events.changes(), now)


def by_hand(file: Path, command: str) -> None:
    with closing(sqlite3.connect(file)) as memory, memory:
        memory.execute(command)


def next_life(office: Office, file: Path, now: float) -> Dva:
    """Restart the office with a new core that recalls the file."""
    memory = Store(file)
    office.core = office.new_core()
    memory.recall(office.core, now)
    memory.close()
    return office.core


# --- what is remembered --------------------------------------------------------------------


def test_an_empty_file_knows_nothing(file):
    memory = Store(file)
    assert not memory.recall(Office().new_core(), 0.0)
    memory.close()


def test_the_next_life_knows_events_devices_permissions_and_who_works_on_what(file):
    office, memory = Office(rules=RULES), Store(file)
    office.fire(12, now=1.0)
    office.fire(80, now=2.0, kind="flood")
    office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation", ("heat_flux",)), 3.0)
    office.progress(OPERATOR, "departed", 4.0)
    keep(office, memory, 5.0)
    memory.close()
    before = snapshot(office.core)
    assert set(before["engaged"]) == {(OPERATOR, 1), (ROBOT, 1), (GUARD, 2)}
    core = next_life(office, file, 5.0)
    assert snapshot(core) == before
    assert (core.events.changes(), core.registry.changes()) == ([], {})  # the file has all that


@pytest.mark.parametrize("seed", range(20))
def test_after_any_day_the_next_life_knows_all_that_was_kept(seed, tmp_path):
    day = Walk(seed, tmp_path)
    for _ in range(80):
        day.step()
    day._take(day._kill())
    day.memory.close()


def test_the_order_of_registration_lasts_when_a_device_moves(file):
    office, memory = Office(), Store(file)
    keep(office, memory)
    office.say(GUARD, m.Registration("guard", "Guard", "10.0.0.7"))
    keep(office, memory)
    memory.close()
    ids = list(office.core.registry.entries)
    assert list(next_life(office, file, 0.0).registry.entries) == ids


@pytest.mark.parametrize("now", [0.0, 500.0, 1e6])
def test_what_has_waited_has_waited_as_long_for_the_next_life_whatever_its_clock_shows(file, now):
    """The event has waited for 20 of 60 seconds when the DVA is killed."""
    office, memory = Office(rules=RULES), Store(file)
    office.busy(GUARD, ROBOT, OPERATOR)
    office.fire(12, now=480.0)
    keep(office, memory, 500.0)
    memory.close()
    next_life(office, file, now)
    assert office.event().waiting_since == now - 20.0
    office.busy(GUARD, ROBOT, OPERATOR)
    assert office.tick(now + 39.0) == []
    assert office.event().state is State.PENDING
    office.tick(now + 40.0)
    assert office.event().state is State.ESCALATED


def test_how_late_it_is_is_kept_though_nothing_changes(file):
    """A DVA that is killed again and again escalates in the end."""
    office, memory = Office(rules=RULES), Store(file)
    office.busy(GUARD, ROBOT, OPERATOR)
    office.fire(12, now=0.0)
    keep(office, memory, 0.0)
    for second in range(1, 16):
        keep(office, memory, 1.5 * second)
    memory.close()
    for life in (1, 2):
        memory, office.core = Store(file), office.new_core()
        memory.recall(office.core, 0.0)
        assert office.event().waiting_since == pytest.approx(-22.5 - 15.0 * (life - 1), abs=1.1)
        keep(office, memory, 15.0)
        memory.close()
    next_life(office, file, 7.0)
    office.busy(GUARD, ROBOT, OPERATOR)
    office.tick(16.0)
    assert office.event().state is State.ESCALATED


def test_a_file_of_an_older_version_goes_on_where_its_newest_event_stood(file):
    """Its times are by the wall clock, and nothing in it tells how late it was in the end."""
    office, memory = Office(rules=RULES), Store(file)
    office.busy(GUARD, ROBOT, OPERATOR)
    memory.past = 1.7e9
    office.fire(12, now=480.0)
    keep(office, memory, 500.0)
    memory.close()
    by_hand(file, "DELETE FROM about WHERE name = 'time'")
    by_hand(file, "UPDATE about SET value = 1 WHERE name = 'format'")
    next_life(office, file, 30.0)
    assert office.event().waiting_since == pytest.approx(30.0)


def test_devices_have_their_time_out_to_show_that_they_are_there(file):
    office, memory = Office(), Store(file)
    office.ok(office.fire(12))
    keep(office, memory)
    memory.close()
    core = next_life(office, file, 100.0)
    core.tick(110.0)
    assert office.working == {OPERATOR: 1, ROBOT: 1}
    core.tick(110.1)
    assert office.working == {}


def test_sessions_go_on_growing(file):
    office, memory = Office(), Store(file)
    ask = m.PermissionRequest(ROBOT, "teleoperation")
    first = office.say(OPERATOR, ask)[0].content
    keep(office, memory)
    assert isinstance(first, m.Permission)
    office.say(OPERATOR, m.PermissionRevocation(ROBOT, OPERATOR, first.session))
    keep(office, memory)
    memory.close()
    next_life(office, file, 1.0)
    second = office.say(OPERATOR, ask)[0].content
    assert isinstance(second, m.Permission)
    assert second.session > first.session


def test_a_permission_that_no_rule_allows_any_longer_ends_when_it_is_remembered(file):
    office, memory = Office(), Store(file)
    content = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))[0].content
    keep(office, memory)
    memory.close()
    office.access = Access((AccessRule(levels=frozenset({"sensors"})),))
    assert isinstance(content, m.Permission)
    over = m.PermissionRevocation(ROBOT, OPERATOR, content.session)
    assert next_life(office, file, 1.0).tick(1.0) == [Send(ROBOT, over), Send(OPERATOR, over)]


def killed_before_the_robot_hears(file: Path) -> tuple[Office, Store, Send]:
    """A session was ended, which was kept; what the robot said to that, nobody knows."""
    office, memory = Office(), Store(file)
    content = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))[0].content
    assert isinstance(content, m.Permission)
    over = m.PermissionRevocation(ROBOT, OPERATOR, content.session)
    assert office.say(OPERATOR, over)[1] == [Send(ROBOT, over)]
    keep(office, memory)
    return office, memory, Send(ROBOT, over)


def test_a_robot_that_has_not_heard_of_an_end_is_told_by_the_next_life(file):
    office, memory, notice = killed_before_the_robot_hears(file)
    memory.close()
    assert next_life(office, file, 1.0).go_on() == [notice]


def test_a_robot_that_did_not_answer_is_told_by_every_life_until_it_does(file):
    office, memory, notice = killed_before_the_robot_hears(file)
    for life in range(3):
        office.no([notice], life)
        keep(office, memory)
        memory.close()
        assert next_life(office, file, life).go_on() == [notice]
        memory = Store(file)
        memory.recall(office.new_core(), life)
    office.ok([notice], 3.0)
    keep(office, memory)
    memory.close()
    assert next_life(office, file, 4.0).go_on() == []


def test_what_has_not_changed_is_not_written_again(file):
    office, memory = Office(), Store(file)
    office.fire(12)
    keep(office, memory)
    with closing(sqlite3.connect(file)) as other:
        before = other.execute("PRAGMA data_version").fetchone()
        office.say(OPERATOR, m.GetDeviceList())
        office.beat(now=1.0)
        keep(office, memory)
        assert other.execute("PRAGMA data_version").fetchone() == before
        office.fire(30)
        keep(office, memory)
        assert other.execute("PRAGMA data_version").fetchone() != before
    memory.close()


# --- kills ---------------------------------------------------------------------------------


def test_a_copy_of_the_file_taken_at_any_moment_knows_what_was_kept_until_then(tmp_path):
    """The file and its log, as a kill leaves them: nothing was closed."""
    day = Walk(7, tmp_path)
    for step in range(60):
        day.step()
        copy = tmp_path / f"copy-{step}.sqlite"
        for end in ("", "-wal"):
            shutil.copy(f"{day.file}{end}", f"{copy}{end}")
        memory, core = Store(copy), day._core()
        memory.recall(core, day.now)
        memory.close()
        assert snapshot(core) == snapshot(day.core)
    day.memory.close()


class PowerCut(BaseException):
    """Nothing of what was to come happens."""


def moments_of_a_write(file: Path, until: int | None = None) -> list[int]:
    """Rows written at each moment at which a kill may come; the last one is `until`."""
    office, memory, written = Office(), Store(file), list[int]()
    office.fire(12.0)

    def moment() -> None:
        written.append(memory._file.total_changes)
        if until is not None and len(written) > until:
            raise PowerCut

    memory.between_writes = moment
    with suppress(PowerCut):
        keep(office, memory)
    memory.close()
    return written


def test_a_kill_at_any_moment_of_a_write_leaves_all_of_it_or_nothing(tmp_path):
    written = moments_of_a_write(tmp_path / "whole.sqlite")
    last = len(written) - 1
    assert written[last - 1] == written[last]  # all is written, and does not count yet
    for until in range(len(written)):
        moments_of_a_write(file := tmp_path / f"{until}.sqlite", until)
        core = next_life(Office(), file, 0.0)
        assert (core.events.total, len(core.registry.entries)) == (
            (1, 4) if until == last else (0, 0)
        )


SAYS_WHAT_IT_KEPT = """
import sys
sys.path.insert(0, sys.argv[2])
from helpers.dva.dispatch_office import Office
from dva_sim.core.store import Store
office, memory = Office(), Store(sys.argv[1])
while True:
    office.fire(20.0 * (office.core.events.total + 1), source=sys.argv[3])
    memory.keep(office.core, office.core.events.changes(), 0.0)
    print(office.core.events.total, flush=True)
"""


@pytest.mark.system
def test_a_process_that_is_killed_forgets_nothing_that_it_has_said(file):
    """Three kills, each amid the writing."""
    for enough in (3, 17, 60):
        command = [sys.executable, "-c", SAYS_WHAT_IT_KEPT, str(file)]
        command += [str(TESTS), OPERATOR]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            reported = 0
            for line in process.stdout:
                reported = int(line)
                if reported == enough:
                    process.send_signal(signal.SIGKILL)
        assert reported >= enough
        memory, core = Store(file), Office().new_core()
        memory.recall(core, 0.0)
        memory.close()
        assert core.events.total in (reported, reported + 1)
        assert sum(core.events.counts.values()) == core.events.total
        for path in file.parent.iterdir():
            path.unlink()


# --- files that do not work ----------------------------------------------------------------


DRIVE, BOTH = (m.PermissionRequest(ROBOT, level) for level in ("teleoperation", "both"))
HEAT, GAS = (m.PermissionRequest(ROBOT, "sensors", (sensor,)) for sensor in ("heat_flux", "gas"))


@pytest.mark.parametrize(
    ("kept", "wish"),
    [
        ([DRIVE], BOTH),  # each ends the one that it takes the place of
        ([HEAT], GAS),
        ([DRIVE, HEAT], GAS),
        ([DRIVE, HEAT], BOTH),
        ([HEAT], DRIVE),
        ([], DRIVE),
    ],
)
def test_what_cannot_be_kept_is_withdrawn_and_what_it_replaced_holds_again(file, kept, wish):
    office, memory = Office(), Store(file)
    permissions = office.core.sessions.permissions
    permissions.draw = iter(range(100)).__next__
    for request in kept:
        office.say(OPERATOR, request)
    assert keep(office, memory) is None
    before = set(permissions.all())

    def fail() -> None:
        raise sqlite3.OperationalError("database or disk is full")

    memory.between_writes = fail
    assert office.say(OPERATOR, wish)[0].code == m.OK
    assert set(permissions.all()) != before
    problem = keep(office, memory)
    assert problem is not None
    assert problem.endswith("disk is full")
    assert set(permissions.all()) == before
    memory.close()


def test_a_full_disk_is_one_line_and_work_goes_on_and_is_caught_up_with(file):
    office, memory = Office(), Store(file)
    keep(office, memory)
    pages = memory._file.execute("PRAGMA page_count").fetchone()[0]
    memory._file.execute(f"PRAGMA max_page_count = {pages}")
    problems = set()
    for number in range(40):
        office.fire(20.0 * number)
        problems.add(keep(office, memory))
    (problem,) = problems - {None}
    assert problem.endswith("disk is full")
    memory._file.execute("PRAGMA max_page_count = 100000")
    office.register(OTHER_GUARD, "Guard", 5)
    assert keep(office, memory) is None
    memory.close()
    before = snapshot(office.core)
    assert before["total"] == 40
    assert snapshot(next_life(office, file, 0.0)) == before


def test_a_file_that_another_holds_is_one_line_and_caught_up_with_later(file):
    office, memory = Office(), Store(file)
    other = sqlite3.connect(file, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    office.fire(12)
    assert keep(office, memory).endswith(": database is locked")
    other.execute("ROLLBACK")
    other.close()
    assert keep(office, memory) is None
    memory.close()
    assert next_life(office, file, 0.0).events.total == 1


def refusal(file: Path) -> str:
    with pytest.raises(ConfigError) as refused:
        Store(file)
    line = str(refused.value)
    assert "\n" not in line
    assert line.startswith(f"{file}: ")
    return line.removeprefix(f"{file}: ")


@pytest.mark.skipif(os.geteuid() == 0, reason="to root no file is read-only")
def test_a_file_that_may_only_be_read_is_no_memory(file):
    Store(file).close()
    file.chmod(0o444)
    assert "readonly" in refusal(file)


def test_a_text_is_no_memory_and_stays_as_it_is(file):
    file.write_text("dear diary, " * 100)
    assert "database" in refusal(file)
    assert file.read_text() == "dear diary, " * 100


def test_the_database_of_something_else_is_no_memory_and_stays_as_it_is(file):
    with sqlite3.connect(file) as other:
        other.execute("CREATE TABLE events (title TEXT)")
    other.close()
    before = file.read_bytes()
    assert refusal(file).endswith("memory of format 3")
    assert file.read_bytes() == before


@pytest.mark.parametrize("value", [0, 4, "9e999"])
def test_a_memory_of_another_format_is_refused(file, value):
    Store(file).close()
    by_hand(file, f"UPDATE about SET value = {value} WHERE name = 'format'")
    assert "DVA's memory" in refusal(file)


def test_a_file_that_another_holds_cannot_be_opened(file, monkeypatch):
    monkeypatch.setattr(store, "OPEN_WITHIN", 0.01)
    other = sqlite3.connect(file, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    assert refusal(file).endswith(": database is locked")
    other.close()


@pytest.mark.parametrize(
    "damage",
    [
        "UPDATE events SET data = 'not json'",
        "UPDATE events SET data = json_remove(data, '$.times')",
        "UPDATE events SET data = json_set(data, '$.state', 'on holiday')",
        "UPDATE devices SET data = '[]'",
        "UPDATE grants SET data = '{}'",
        "DROP TABLE grants",
        # Sound as JSON, and of no use later.
        "UPDATE events SET data = json_set(data, '$.severity', '0.5')",
        "UPDATE events SET data = json_set(data, '$.times.detected', 1e300)",
        "UPDATE devices SET data = json_set(data, '$.device[1]', 7)",
        "UPDATE devices SET data = json_set(data, '$.registrations', json('[[\"1\", \"2\"]]'))",
        "INSERT INTO stops VALUES ('02:00:00:09:09:09', '[null, 3]')",
        "UPDATE about SET value = 9e18 WHERE name = 'sessions'",
        f"UPDATE grants SET data = '{'[' * 10_000}'",
    ],
)
def test_a_memory_whose_content_makes_no_sense_is_refused_in_one_line(file, damage):
    office, memory = Office(), Store(file)
    office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))
    office.fire(12)
    keep(office, memory)
    by_hand(file, damage)
    with pytest.raises(ConfigError, match="DVA's memory") as refused:
        memory.recall(office.new_core(), 0.0)
    assert "\n" not in str(refused.value)
    memory.close()


def test_the_largest_that_a_dva_may_hold_is_recalled(file):
    office, memory = Office(), Store(file)
    office.say(GUARD, m.Registration("x" * 64, "Guard", ADDRESS))
    sessions = office.core.sessions.permissions
    sessions.count = 2**32 - 2 * A_DAY
    office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))
    office.fire(12)
    (event,) = office.core.events.open.values()
    event.handling.note = "x" * 256
    event.handling.expected[GUARD] = 1.0, math.inf  # there is no way
    office.core.events.touch(event)
    keep(office, memory)
    by_hand(file, "UPDATE devices SET data = json_remove(data, '$.silent')")  # as older versions
    memory.close()
    core = next_life(office, file, 0.0)
    assert core.registry.entries[GUARD].device.label == "x" * 64
    assert [grant.session for grant in core.sessions.permissions.all()] == [
        grant.session for grant in sessions.all()
    ]
    assert max(grant.session for grant in sessions.all()) > 2**63
    (recalled,) = core.events.open.values()
    assert recalled.handling.arrival_in(GUARD, 0.0) is None


def test_a_label_of_any_letters_is_kept_as_it_is(file):
    office, memory = Office(), Store(file)
    office.say(GUARD, m.Registration("Zoë's 'guard' \U0001f525 \"1\"", "Guard", ADDRESS))
    keep(office, memory)
    memory.close()
    entry = next_life(office, file, 0.0).registry.entries[GUARD]
    assert entry.device.label == "Zoë's 'guard' \U0001f525 \"1\""
