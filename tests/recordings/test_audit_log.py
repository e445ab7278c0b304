"""The audit log: rows in a chain, what is done to it by hand, and disks that are full."""

import os
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.audit_log import (
    BEGIN,
    END,
    NOTHING_BEFORE,
    AuditEntry,
    AuditLog,
    AuditWriteError,
    Verified,
    plain_row,
    read_rows,
    row_of,
    verify,
    verify_plain,
)


def entry(action: str = "acknowledge", **more: Any) -> AuditEntry:
    return AuditEntry(
        **{"time_s": 12.5, "at_utc": "2026-01-01T00:00:00Z", "author": "ana", "action": action}
        | more
    )


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log of five rows, which one console began and ended."""
    path = tmp_path / "audit.sqlite"
    written = AuditLog(path)
    for action in (BEGIN, "raise", "acknowledge", "assign", END):
        written.append([entry(action, event=1, details={"proposed": "robot-1"})])
    written.close()
    return path


def place_of(found: Verified, words: str) -> tuple[int, bool]:
    """Number of the wrong row, and whether the problem has these words."""
    assert found.problem is not None
    return found.problem.number, words in found.problem.text


def by_hand(path: Path, *commands: str) -> None:
    """Change a log as somebody would who knows SQL: the guards are removed first."""
    with closing(sqlite3.connect(path, isolation_level=None)) as file:
        for guard in ("audit_is_not_changed", "audit_is_not_cut"):
            file.execute(f"DROP TRIGGER IF EXISTS {guard}")
        for command in commands:
            file.execute(command)


def test_a_log_that_nobody_touched_holds_and_tells_its_last_hash(log):
    found, rows = verify(log), read_rows(log)

    assert (found.rows, found.problem, found.is_ended, found.doubts) == (5, None, True, ())
    assert found.head == rows[-1].hash
    assert rows[0].before == NOTHING_BEFORE
    assert [row.action for row in rows] == [BEGIN, "raise", "acknowledge", "assign", END]
    assert rows[3].details == {"proposed": "robot-1"}


PLANTED: dict[str, tuple[tuple[str, ...], int, str]] = {
    "a changed author": (("UPDATE audit SET author='bob' WHERE number=3",), 3, "was changed"),
    "a changed time": (("UPDATE audit SET time_s=1.0 WHERE number=2",), 2, "was changed"),
    "a changed hash": (("UPDATE audit SET hash='0' WHERE number=4",), 4, "was changed"),
    "bytes for text": (("UPDATE audit SET text=x'00' WHERE number=2",), 2, "holds bytes"),
    "a row removed": (("DELETE FROM audit WHERE number=3",), 3, "is missing"),
    "a row removed, the others moved up": (
        ("DELETE FROM audit WHERE number=3", "UPDATE audit SET number=number-1 WHERE number>3"),
        3,
        "was changed",
    ),
    "two rows changed places": (
        (
            "UPDATE audit SET number=99 WHERE number=2",
            "UPDATE audit SET number=2 WHERE number=3",
            "UPDATE audit SET number=3 WHERE number=99",
        ),
        2,
        "was changed",
    ),
    "the end cut": (("DELETE FROM audit WHERE number>3",), 4, "the end was cut"),
    "all removed": (("DELETE FROM audit",), 1, "the end was cut"),
    "another format": (("UPDATE about SET value='9' WHERE name='format'",), 1, "of format 1"),
    "a last number that is none": (
        ("UPDATE sqlite_sequence SET seq='many' WHERE name='audit'",),
        1,
        "is not an audit log",
    ),
    "no table": (("DROP TABLE audit",), 1, "is not an audit log"),
}


@pytest.mark.parametrize("fault", PLANTED)
def test_what_was_done_by_hand_is_found_at_the_first_row_that_is_wrong(log, fault):
    commands, number, words = PLANTED[fault]
    by_hand(log, *commands)

    assert place_of(verify(log), words) == (number, True)
    with pytest.raises(ConfigError, match="not an audit log"):
        AuditLog(log)


def test_a_row_put_in_whose_hash_is_right_does_not_follow_the_one_before(log):
    forged = row_of(entry("assign", author="eve"), 3, NOTHING_BEFORE)
    by_hand(log, "DELETE FROM audit WHERE number=3")
    with closing(sqlite3.connect(log, isolation_level=None)) as file:
        row = plain_row(forged) | {"details": "{}"}
        names = ", ".join(row)
        file.execute(
            f"INSERT INTO audit ({names}) VALUES ({', '.join('?' * len(row))})", [*row.values()]
        )

    assert place_of(verify(log), "row 2") == (3, True)


def test_an_end_that_was_cut_with_its_count_leaves_a_doubt_and_another_last_hash(log):
    before = verify(log)
    by_hand(log, "DELETE FROM audit WHERE number>3", "UPDATE sqlite_sequence SET seq=3")

    after = verify(log)
    assert after.problem is None  # a chain alone cannot show that: the hash told elsewhere can
    assert after.head != before.head
    assert not after.is_ended
    assert any("it was cut" in doubt for doubt in after.doubts)
    assert any("guards" in doubt for doubt in after.doubts)


@pytest.mark.parametrize("command", ["UPDATE audit SET author='bob'", "DELETE FROM audit"])
def test_its_guards_refuse_a_change_that_does_not_remove_them_first(log, command):
    with (
        closing(sqlite3.connect(log, isolation_level=None)) as file,
        pytest.raises(sqlite3.IntegrityError, match="only grows"),
    ):
        file.execute(command)


def test_a_log_is_gone_on_with_by_the_next_console(log):
    again = AuditLog(log)
    (row,) = again.append([entry(BEGIN)])
    again.close()

    assert row.number == 6
    assert verify(log).rows == 6
    assert not verify(log).is_ended


def test_two_consoles_may_write_one_log(tmp_path):
    path = tmp_path / "audit.sqlite"
    one, other = AuditLog(path), AuditLog(path)
    for number in range(6):
        (one, other)[number % 2].append([entry(f"step {number}")])
    one.close()
    other.close()

    assert verify(path).problem is None
    assert [row.action for row in read_rows(path)] == [f"step {number}" for number in range(6)]


def test_of_rows_for_which_there_is_no_room_none_is_written_and_later_all_are(tmp_path):
    log = AuditLog(tmp_path / "audit.sqlite")
    log.append([entry("before")])
    log._file.execute("PRAGMA max_page_count = 12")  # as of a disk that is full
    many = [entry(f"step {number}", text="x" * 900) for number in range(100)]
    with pytest.raises(AuditWriteError, match="full"):
        log.append(many)
    assert verify(log.path).rows == 1

    log._file.execute("PRAGMA max_page_count = 1000000")
    assert [row.number for row in log.append(many)] == list(range(2, 102))
    log.close()
    assert verify(log.path).rows == 101


_WRITER = """
import sys
from pathlib import Path
from dva_sim.recordings.audit_log import AuditEntry, AuditLog
log = AuditLog(Path(sys.argv[1]))
for number in range(100_000):
    log.append([AuditEntry(time_s=number, at_utc="", author="ana", action="note")])
    print(number + 1, flush=True)
"""


def test_a_process_that_is_killed_has_written_all_that_it_said_was_done(tmp_path):
    path = tmp_path / "audit.sqlite"
    with subprocess.Popen([sys.executable, "-c", _WRITER, path], stdout=subprocess.PIPE) as writer:
        assert writer.stdout is not None
        for _ in range(25):
            writer.stdout.readline()
        os.kill(writer.pid, signal.SIGKILL)
        output = 25 + len(writer.stdout.read().splitlines())

    found = verify(path)
    assert found.problem is None
    assert found.rows >= output


def test_rows_that_were_kept_elsewhere_are_followed_from_wherever_they_begin(log):
    plain = [plain_row(row) for row in read_rows(log)]
    assert verify_plain(plain[2:]).problem is None
    assert verify_plain(plain[2:]).head == plain[-1]["hash"]
    assert verify_plain([]).problem is None

    changed = [*plain[:3], plain[3] | {"author": "bob"}, plain[4]]
    left_out = [*plain[:2], *plain[3:]]
    for rows, number, words in (
        (changed, 4, "was changed"),
        (left_out, 3, "is missing"),
        ([{"number": 1}], 1, "is not whole"),
    ):
        assert place_of(verify_plain(rows), words) == (number, True)


@pytest.mark.parametrize(
    "change",
    [
        "time_s='soon'",
        "time_s=9e999",
        "text=x'00'",
        "event=1.5",
        "details='[]'",
        "details='{\"waited_s\": NaN}'",
        f"details='{'[' * 9000}'",
    ],
)
def test_rows_that_no_log_writes_are_not_shown(log, change):
    by_hand(log, f"UPDATE audit SET {change} WHERE number=2")
    with pytest.raises(ConfigError, match="cannot be read as an audit log"):
        read_rows(log)


def test_a_file_that_is_something_else_is_left_as_it_is(tmp_path):
    path = tmp_path / "audit.sqlite"
    path.write_text("notes")

    with pytest.raises(ConfigError, match="is not an audit log"):
        AuditLog(path)
    assert path.read_text() == "notes"


def test_a_log_whose_tables_are_described_in_no_letters_is_no_log(log):
    log.write_bytes(log.read_bytes().replace(b"CREATE TABLE about", b"CREATE TABLE \xffbout"))
    with pytest.raises(ConfigError, match="is not an audit log"):
        AuditLog(log)
    assert verify(log).rows == 0


@pytest.mark.parametrize("make", [Path.touch, lambda path: None])
def test_a_file_that_is_empty_or_not_there_becomes_a_log(tmp_path, make):
    path = tmp_path / "audit.sqlite"
    make(path)
    AuditLog(path).close()

    assert verify(path).rows == 0
    assert verify(path).problem is None


TEXTS = st.text(st.characters(), max_size=40)


@settings(max_examples=25, deadline=None)
@given(author=TEXTS, text=TEXTS, details=st.dictionaries(TEXTS, st.integers() | TEXTS))
def test_whatever_is_said_stands_there_as_it_was_said(tmp_path_factory, author, text, details):
    path = tmp_path_factory.mktemp("logs") / "audit.sqlite"
    log = AuditLog(path)
    (row,) = log.append([entry(author=author, text=text, details=details)])
    log.close()

    assert read_rows(path) == [row]
    assert verify(path).problem is None
    assert row.author == author.encode("utf-8", "replace").decode()
