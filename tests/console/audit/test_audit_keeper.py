"""The console's audit log: rows told done when they are on the disk, and disks that are full."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.processes.patience import becomes

from dva_sim.console.audit import audit_keeper
from dva_sim.console.audit.audit_keeper import AuditKeeper, check_target
from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.audit_log import BEGIN, END, AuditRow, read_rows, verify


@pytest.fixture
def keeper(tmp_path: Path) -> Iterator[AuditKeeper]:
    kept = AuditKeeper(tmp_path / "audit.sqlite", lambda: 12.0, {"scenario": "hands-on"})
    yield kept
    if kept._thread.is_alive():
        kept.close()


def problems_of(keeper: AuditKeeper, action: str) -> list[str]:
    """Result of keeping an action: an empty text once it is on disk."""
    reports: list[str] = []
    keeper.put(keeper.entry(action, "ana"), reports.append)
    assert becomes(lambda: keeper.take() or reports)
    return reports


def test_who_waits_for_a_row_is_told_when_it_is_in_the_file(keeper):
    seen: list[AuditRow] = []
    keeper.on_rows = seen.extend

    assert problems_of(keeper, "acknowledge") == [""]
    rows = read_rows(keeper.path)
    assert [row.action for row in rows] == [BEGIN, "acknowledge"]
    assert rows[0].details == {"scenario": "hands-on"}
    assert (rows[1].author, rows[1].time_s) == ("ana", 12.0)
    assert seen[-1] == rows[1]
    assert (keeper.number, keeper.head) == (2, rows[1].hash)


def test_a_console_that_ends_writes_what_waits_and_says_that_it_ended(keeper):
    for number in range(1200):
        keeper.put(keeper.entry(f"step {number}"))
    keeper.close()

    actions = [row.action for row in read_rows(keeper.path)]
    assert actions == [BEGIN, *(f"step {number}" for number in range(1200)), END]
    assert verify(keeper.path).is_ended


def test_on_a_full_disk_nobody_is_told_that_it_is_done_and_nothing_is_lost(keeper, monkeypatch):
    monkeypatch.setattr(audit_keeper, "RETRY_DELAY_S", 0.01)
    assert problems_of(keeper, "before") == [""]
    keeper._log._file.execute("PRAGMA max_page_count = 1")
    big: dict[str, Any] = {"text": "x" * 100_000}
    reports: list[str] = []
    keeper.put(keeper.entry("assign", **big), reports.append)
    assert becomes(lambda: keeper.take() or reports)
    assert "full" in reports[0]
    assert "full" in keeper.problem

    keeper._log._file.execute("PRAGMA max_page_count = 100000")
    assert becomes(lambda: keeper.take() or not keeper.problem)
    assert [row.action for row in read_rows(keeper.path)] == [BEGIN, "before", "assign"]


def test_what_waits_for_a_full_disk_is_bounded_and_what_was_lost_is_told(keeper, monkeypatch):
    monkeypatch.setattr(audit_keeper, "MAX_WAITING", 0)
    reports: list[str] = []
    keeper.put(keeper.entry("one too many"), reports.append)
    monkeypatch.undo()
    keeper.close()

    assert "too much waits" in reports[0]
    assert re.search(r"\b1\b", read_rows(keeper.path)[-1].text)


def test_without_a_file_the_log_is_gone_with_the_console():
    kept = AuditKeeper(None, lambda: 0.0, {})
    assert not kept.is_lasting
    assert problems_of(kept, "note") == [""]
    assert kept.path.exists()
    kept.close()

    assert not kept.path.parent.exists()


@pytest.mark.parametrize(
    ("name", "words"),
    [("audit.txt", "should end in .sqlite"), ("no/folder.sqlite", "does not exist")],
)
def test_where_no_log_can_be_kept_is_told_before_anything_starts(tmp_path, name, words):
    with pytest.raises(ConfigError, match=words):
        check_target(tmp_path / name)
