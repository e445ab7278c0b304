"""Lines of the web process to one page."""

from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict

from dva_sim.console.wire.events import (
    AlarmsLine,
    AuditLine,
    ControlLine,
    EventsLine,
    HazardsLine,
    StoryLine,
    StorySoFarLine,
)
from dva_sim.console.wire.records import PicturesLine, ShelfLine
from dva_sim.console.wire.rows import RowsLine
from dva_sim.console.wire.scenes import OrderShown, Place, SceneShown


class YouLine(TypedDict):
    """Identity of a page; `user`: who is logged in there, or empty."""

    k: Literal["you"]
    client: str
    key: str
    role: str
    user: str


class PongLine(TypedDict):
    """An answer to a ping, with the time of this machine [ms]."""

    k: Literal["pong"]
    at: Any
    now: float


class MovedLine(TypedDict):
    """Agents that have moved, and that have left the site."""

    k: Literal["d"]
    t: int
    p: list[Place]
    gone: NotRequired[list[int]]


class OtherSeatLine(TypedDict):
    """Public part of a seat."""

    k: Literal["seat"]
    short: bool
    seat: str
    label: str
    phase: str
    order: OrderShown | None
    robots: list[int | None]


# A message, and what came of it, in a table.
LogEntry = TypedDict(
    "LogEntry",
    {
        "n": int,
        "t": int,
        "kind": str,
        "payload": str,
        "from": str,
        "from_label": str,
        "to": str,
        "to_label": str,
        "session": str,
        "code": int | None,
        "word": str,
        "text": str,
        "service_us": int | None,
        "published": bool,
    },
)


class LogLine(TypedDict):
    """News of a log that a page looks at; `first`: replaces what was shown before."""

    k: Literal["log"]
    log: str
    total: int
    first: bool
    missed: int
    lines: list[LogEntry]


class SnapState(TypedDict, total=False):
    """The newest of everything."""

    pos: list[Place]
    story: list[StoryLine]
    story_from: int
    seats: list[OtherSeatLine]
    rows: RowsLine
    hazards: HazardsLine
    events: EventsLine
    control: ControlLine
    alarms: AlarmsLine
    audit: AuditLine
    pictures: PicturesLine
    story_so_far: StorySoFarLine
    shelf: ShelfLine


class SnapLine(TypedDict):
    """All there is, for a page that begins."""

    k: Literal["snap"]
    t: int
    scene: SceneShown | None
    state: SnapState
