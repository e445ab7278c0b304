"""Lines sent to pages, each kind declared once.

A line has a kind `k`, and most have a time `t` of the world's clock [ms]. Lengths are in metres and
angles in radians, unless a name says otherwise. What is null is unknown; what may be left out says
so. Pages know the same types (`static/js/lines.js`) by their names without `Line` and `Shown`.
"""

from typing import Final, Protocol, TypeAlias

from dva_sim.console.wire.events import (
    AlarmsLine,
    AuditLine,
    ControlLine,
    EventsLine,
    HazardsLine,
    StoryLine,
    StorySoFarLine,
)
from dva_sim.console.wire.pages import (
    LogLine,
    MovedLine,
    OtherSeatLine,
    PongLine,
    SnapLine,
    YouLine,
)
from dva_sim.console.wire.records import ByeLine, ExchangesLine, PicturesLine, ShelfLine
from dva_sim.console.wire.rows import DevicesLine, PlacesLine, RobotWindowLine, RowsLine
from dva_sim.console.wire.scenes import EmptySceneLine, SceneLine
from dva_sim.console.wire.seats import DoneLine, GuardLine, SeatLine
from dva_sim.serving.pipes import LineKinds

# Lines from a console to the web process.
WorldLine: TypeAlias = (
    SceneLine
    | EmptySceneLine
    | PlacesLine
    | RowsLine
    | RobotWindowLine
    | DevicesLine
    | HazardsLine
    | EventsLine
    | ControlLine
    | AlarmsLine
    | AuditLine
    | StoryLine
    | StorySoFarLine
    | SeatLine
    | GuardLine
    | ExchangesLine
    | ShelfLine
    | PicturesLine
    | DoneLine
    | ByeLine
)
# Lines from the web process to pages, numbered by `s`.
ToPage: TypeAlias = (
    SnapLine
    | MovedLine
    | RowsLine
    | RobotWindowLine
    | DevicesLine
    | HazardsLine
    | EventsLine
    | ControlLine
    | AlarmsLine
    | AuditLine
    | StoryLine
    | StorySoFarLine
    | SeatLine
    | OtherSeatLine
    | GuardLine
    | LogLine
    | ShelfLine
    | PicturesLine
    | DoneLine
    | ByeLine
    | YouLine
    | PongLine
)


class Tell(Protocol):
    """Takes lines for pages, and a key for those of which the newest counts."""

    def __call__(self, line: WorldLine, key: object = "", /) -> object:
        """Take one."""


KINDS: Final = LineKinds(
    newest=frozenset({"pos", "seat", "rows", "hazards", "events", "devices", "story_so_far"}),
    kept=frozenset({"scene", "shelf", "done", "bye"}),
    first_dropped=frozenset({"log"}),  # whose numbers tell what is missing
)
