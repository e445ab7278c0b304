"""Measures of a control room from its audit log: times, and overrides of the policy.

Each figure is made of rows alone, so that an exported log gives the same.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from statistics import median
from typing import Any

from dva_sim.console.wire.audit_answers import AuditMeasures, Override, TimesTaken
from dva_sim.recordings.audit_log import AuditRow

MAX_OVERRIDES = 50  # of the last that are told one by one


def measured(rows: Iterable[AuditRow]) -> AuditMeasures:
    """Return times to acknowledge and to assign, and what people did otherwise than the policy.

    Times count from the first report of an event to the first time that it was done.
    """
    done = [row for row in rows if row.outcome == "done" and row.event is not None]
    assigned = [row for row in done if row.action == "assign"]
    by_people = [row for row in assigned if row.role]
    overrides = [row for row in by_people if is_override(row)]
    return {
        "acknowledge": _times(row for row in done if row.action == "acknowledge"),
        "assign": _times(assigned),
        "assigned_by_people": len(by_people),
        "assigned_by_policy": len(assigned) - len(by_people),
        "overrides": len(overrides),
        "lost_s": _lost(overrides),
        "newest_overrides": [_override(row) for row in overrides[-MAX_OVERRIDES:]],
    }


def is_override(row: AuditRow) -> bool:
    """Return True if somebody else was sent than the policy would have sent."""
    return "advised" in row.details and row.details["advised"] != row.subject


def _times(rows: Iterable[AuditRow]) -> TimesTaken:
    """Return how long it took, the first time for each event."""
    first: dict[int, float] = {}
    for row in rows:
        waited = _number(row.details.get("waited_s"))
        if row.event is not None and waited is not None:
            first.setdefault(row.event, waited)
    if not first:
        return {"events": 0, "median_s": None, "largest_s": None}
    times = list(first.values())
    return {
        "events": len(times),
        "median_s": round(median(times), 1),
        "largest_s": round(max(times), 1),
    }


def _lost(overrides: Sequence[AuditRow]) -> float | None:
    """Return how much later those sent are expected than the policy's, in the median [s]."""
    ages = [
        did - advised
        for row in overrides
        if (did := _number(row.details.get("arrival_s"))) is not None
        and (advised := _number(row.details.get("advised_s"))) is not None
    ]
    return round(median(ages), 1) if ages else None


def _override(row: AuditRow) -> Override:
    details = row.details
    return {
        "number": row.number,
        "event": row.event,
        "author": row.author,
        "did": row.subject,
        "did_s": details.get("arrival_s"),
        "advised": details["advised"],
        "advised_s": details.get("advised_s"),
        "cause": row.cause,
    }


def _number(value: Any) -> float | None:
    is_one = type(value) in (int, float) and abs(value) <= sys.float_info.max
    return float(value) if is_one else None
