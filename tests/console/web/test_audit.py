"""The audit log by plain requests: rows, measures, verification, export, and who may ask."""

import csv
import io
import json
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from helpers.console.declared_lines import STRICT
from helpers.console.served_console import Served, serving
from pydantic import TypeAdapter, ValidationError

from dva_sim.console.audit.audit_measures import measured
from dva_sim.console.web.audit import csv_of
from dva_sim.console.web.rest import json_answer
from dva_sim.console.wire.audit_answers import AuditCheck, AuditMeasures
from dva_sim.recordings.audit_log import (
    BEGIN,
    NOTHING_BEFORE,
    AuditEntry,
    AuditLog,
    AuditRow,
    read_rows,
    row_of,
)


def entry(action: str, **more: Any) -> AuditEntry:
    return AuditEntry(time_s=1.0, at_utc="", author="ana", action=action, **more)


def rows(*entries: AuditEntry) -> list[AuditRow]:
    """Entries as the rows of a log."""
    found, before = list[AuditRow](), NOTHING_BEFORE
    for number, one in enumerate(entries, 1):
        found.append(row_of(one, number, before))
        before = found[-1].hash
    return found


def assigned(
    event: int, whom: str, advised: str | None, role: str = "dispatch", **more: Any
) -> Any:
    details = {"waited_s": 10.0 * event, "arrival_s": 74.0, "advised": advised, "advised_s": 41.0}
    return entry("assign", event=event, subject=whom, role=role, details=details | more)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "audit.sqlite"
    log = AuditLog(path)
    log.append([entry(BEGIN), *(entry("note", event=n, text=f"note {n}") for n in range(1, 1200))])
    log.close()
    return path


@pytest.fixture(scope="module")
def served(file: Path) -> Iterator[Served]:
    with serving("--audit", str(file)) as one:
        yield one


def test_rows_come_by_the_thousand_after_a_number(served):
    first = served.ask("/api/audit", token=served.look).json
    rest = served.ask("/api/audit?after=1000", token=served.look).json

    assert (len(first["rows"]), first["more"]) == (1000, True)
    assert (len(rest["rows"]), rest["more"]) == (200, False)
    assert rest["rows"][0]["before"] == first["rows"][-1]["hash"]


def test_answers_are_as_declared(served):
    assert AuditCheck.__pydantic_config__ is STRICT
    for path, declared in (("check", AuditCheck), ("measures", AuditMeasures)):
        TypeAdapter(declared).validate_json(
            served.ask(f"/api/audit/{path}", token=served.look).body
        )
    row = served.ask("/api/audit", token=served.look).json["rows"][0]
    assert row.keys() == {field.name for field in fields(AuditRow)}
    overridden = measured(rows(assigned(1, "guard-1", "robot-2")))
    assert len(overridden["newest_overrides"]) == 1
    TypeAdapter(AuditMeasures).validate_python(overridden)
    with pytest.raises(ValidationError, match="did_s"):
        TypeAdapter(AuditMeasures).validate_python(
            measured(rows(assigned(1, "guard-1", "robot-2", arrival_s="soon")))
        )


def test_a_number_that_is_none_is_refused(served):
    for after in ("-1", "x", "1e3", "9" * 13):
        assert served.ask(f"/api/audit?after={after}", token=served.look).status == 400, after


def test_nobody_reads_it_without_a_token_and_without_a_log_there_is_none(served):
    for path in ("", "/check", "/measures", ".csv", ".json"):
        assert served.ask(f"/api/audit{path}").status == 401
    with serving() as without:
        assert without.ask("/api/audit", token=without.look).status == 404


def test_a_change_is_told_and_so_is_a_file_that_is_gone(file, tmp_path):
    copy = Path(shutil.copy(file, tmp_path))
    with serving("--audit", str(copy)) as served:
        assert served.ask("/api/audit/check", token=served.look).json["problem"] is None
        with closing(sqlite3.connect(copy, isolation_level=None)) as by_hand:
            by_hand.execute("DROP TRIGGER audit_is_not_changed")
            by_hand.execute("UPDATE audit SET text = 'other' WHERE number = 700")

        problem = served.ask("/api/audit/check", token=served.look).json["problem"]
        assert problem["row"] == 700
        copy.unlink()
        for path in ("", "/check", "/measures"):
            assert served.ask(f"/api/audit{path}", token=served.look).status == 503


def test_what_a_spreadsheet_would_compute_is_exported_as_words():
    words = ["=cmd|' /C calc'!A0", "+1", "-1", "@SUM(1)", "\t=1", "plain"]
    text = csv_of(rows(*(entry("note", text=word) for word in words)))

    found = [row["text"] for row in csv.DictReader(io.StringIO(text))]
    assert found == [f"'{word}" for word in words[:-1]] + ["plain"]


def test_the_export_holds_every_row(served, file):
    answer = served.ask("/api/audit.csv", token=served.look)

    assert "attachment" in answer.headers["content-disposition"]
    found = list(csv.DictReader(io.StringIO(answer.body.decode())))
    assert [row["hash"] for row in found] == [row.hash for row in read_rows(file)]


def test_times_count_the_first_time_for_each_event_and_overrides_are_told():
    found = measured(
        rows(
            entry("acknowledge", event=1, details={"waited_s": 4.0}),
            entry("acknowledge", event=2, details={"waited_s": 8.0}),
            entry("acknowledge", event=1, outcome="refused", details={"waited_s": 1.0}),
            assigned(1, "guard-1", "robot-2"),
            assigned(1, "robot-2", "robot-2", waited_s=99.0),
            assigned(2, "robot-2", "robot-2", role=""),
            assigned(3, "robot-2", None),
        )
    )

    assert found["acknowledge"] == {"events": 2, "median_s": 6.0, "largest_s": 8.0}
    assert found["assign"] == {"events": 3, "median_s": 20.0, "largest_s": 30.0}
    assert (found["assigned_by_people"], found["assigned_by_policy"]) == (3, 1)
    assert found["overrides"] == 2
    assert found["lost_s"] == 33.0
    assert [one["advised"] for one in found["newest_overrides"]] == ["robot-2", None]


def test_half_a_character_in_an_answer_is_escaped():
    assert json.loads(json_answer({"author": "\ud800"}).body) == {"author": "\ud800"}


def test_of_a_log_without_decisions_there_is_nothing_to_measure():
    found = measured(rows(entry(BEGIN)))

    assert found["acknowledge"] == {"events": 0, "median_s": None, "largest_s": None}
    assert (found["overrides"], found["lost_s"]) == (0, None)
