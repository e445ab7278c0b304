"""Logs of messages, recordings, and the end."""

from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict


class ExchangesLine(TypedDict):
    """Exchanges of a device; the flag says to discard earlier lines.

    Each has a number, time [ms], request, reply, service time [us] and 1 for a publication; bytes
    as latin-1. Where only the first bytes of either may be known, code and text of the reply
    follow, and the size of the request [B].
    """

    k: Literal["log"]
    log: str
    lines: list[list[Any]]
    replaces: NotRequired[bool]


class ShelfEntry(TypedDict):
    """A recording that can be played."""

    name: str
    bytes: int
    part: str
    person: int | None
    trial: int | None
    levels: list[Any]
    values: list[Any]


class MeasureShown(TypedDict):
    """A column of the list of recordings."""

    title: str
    unit: str


class ShelfLine(TypedDict):
    """The recordings that can be played."""

    k: Literal["shelf"]
    folder: str
    question: str
    report: bool
    factors: list[str]
    measures: list[MeasureShown]
    worst_by: str
    recordings: list[ShelfEntry]


class PicturesLine(TypedDict):
    """Availability of pictures, and why there are none."""

    k: Literal["pictures"]
    ok: bool
    text: str
    t: NotRequired[int]


class ByeLine(TypedDict):
    """It is over."""

    k: Literal["bye"]
    why: str
    t: NotRequired[int]
