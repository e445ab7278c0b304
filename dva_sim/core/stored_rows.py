"""Rows of a DVA's memory: their types, checked when they are read."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Final, Literal, NotRequired

from pydantic import Field, TypeAdapter, ValidationError
from typing_extensions import TypedDict

MAX_TIME_S: Final = 1e12  # longest time that makes sense, and keeps microseconds
Name = Annotated[str, Field(max_length=200)]
Words = Annotated[str, Field(max_length=10_000)]
Whole = Annotated[int, Field(ge=0, lt=2**64)]  # as sessions and numbers of messages
Time = Annotated[float, Field(ge=-MAX_TIME_S, le=MAX_TIME_S)]
Degrees = Annotated[float, Field(ge=-180.0, le=180.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
ChoiceRow = tuple[Name, Name, Name, Time, Words, Name]
GrantRow = tuple[
    Name,
    Name,
    Literal["teleoperation", "missions", "both", "sensors"],
    Whole,
    list[Name],
    Name | None,
]
RevocationRow = tuple[Name, Name, Whole]
StopRow = tuple[Name | None, Whole]


class StoredHandling(TypedDict):
    """Decisions on an event; see `Handling`."""

    decisions: Whole
    last: ChoiceRow | None
    acknowledged: ChoiceRow | None
    note: Words
    taken_off: list[Name]
    expected: dict[Name, tuple[Time, Time]]
    advised: Name


class StoredEvent(TypedDict):
    """An event; see `Event`, whose times are those of the memory here [s]."""

    number: Annotated[int, Field(ge=0, lt=2**63)]  # as SQLite has them
    kind: Name
    position: tuple[Degrees, Degrees]
    severity: Annotated[float, Field(ge=0.0, le=100.0)]
    needs_containment: bool
    state: Name
    reports: Whole
    sources: dict[Name, Share]
    responder: Name | None
    operator: Name | None
    actor: Name | None
    taken_up: bool
    act_taken_up: bool
    attempts: Whole
    preemptions: Whole
    waiting_since: Time
    failed: list[Name]
    sent: list[Name]
    times: dict[Name, Time]
    engaged: list[Name]
    handling: NotRequired[StoredHandling | None]


class StoredDevice(TypedDict):
    """A registered device, with the numbers and times of its last registrations."""

    device: tuple[Name, Name, Name, Name]
    registrations: list[tuple[Whole, Name]]
    silent: NotRequired[bool]  # not in older files


def read_row(kind: Any, data: str) -> Any:
    """Return a row that was written as JSON.

    Args:
        kind: Type of the row, one of those above.
        data: JSON.

    Raises:
        ValueError: it is none.
    """
    try:
        return _adapter(kind).validate_json(data, strict=True)
    except ValidationError as error:
        (first, *_) = error.errors()
        where = ".".join(map(str, first["loc"]))
        raise ValueError(f"{where}: {first['msg']}" if where else first["msg"]) from None


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)
