"""Answers on the audit log, beside its rows: whether it holds, and what it says of people."""

from typing_extensions import TypedDict


class WrongRow(TypedDict):
    """The first row that does not hold, and what is wrong with it."""

    row: int
    text: str


class AuditCheck(TypedDict):
    """Result of a check of the whole chain."""

    rows: int
    hash: str
    problem: WrongRow | None
    doubts: list[str]


class TimesTaken(TypedDict):
    """Duration of something, the first time for each event."""

    events: int
    median_s: float | None
    largest_s: float | None


class Override(TypedDict):
    """Somebody else was sent than the policy would have sent."""

    number: int
    event: int | None
    author: str
    did: str
    did_s: float | None
    advised: str | None
    advised_s: float | None
    cause: str


class AuditMeasures(TypedDict):
    """Times to acknowledge and to assign, and what people did otherwise than the policy."""

    acknowledge: TimesTaken
    assign: TimesTaken
    assigned_by_people: int
    assigned_by_policy: int
    overrides: int
    lost_s: float | None
    newest_overrides: list[Override]
