"""The newest state of a run, as its lines tell it; older state is not kept, but for the story.

Each change has a version. The version that a page got last tells what is new to it,
however long it slept: nothing is queued for anybody.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from dva_sim.console.web.logs import TABLES, KeptLogs
from dva_sim.console.wire.limits import STORY_KEPT

if TYPE_CHECKING:
    from dva_sim.console.wire.pages import MovedLine, OtherSeatLine

Line = dict[str, Any]  # as it arrives

STORY_SHOWN = 200  # of them in a snapshot
# Kinds of which only the newest counts.
LATEST = (
    *("rows", "hazards", "events", "control", "alarms", "audit", "pictures"),
    *("story_so_far", "shelf"),
)
MAX_SEATS = 256  # of which anything is remembered


class Versioned(NamedTuple):
    """The newest line of a kind: since which version, and as JSON without its first brace."""

    version: int
    body: str


def encode(line: Mapping[str, Any]) -> str:
    """Return a line as compact JSON."""
    return json.dumps(line, separators=(",", ":"))


def body_of(line: Mapping[str, Any]) -> str:
    """Return a line as JSON without its first brace, so that a number can be put before it."""
    return encode(line)[1:]


class RunState:
    """State of a run.

    Attributes:
        version: Counts changes.
        time: Time of the newest line [ms].
        scene: Static content; None until it arrives.
        latest: The newest line by its kind.
        places: Positions by index: a row of `pos` each.
        seats: State of each seat: the part for its holder, and the public part.
        guards: State for each page of a guard.
        windows: Content of a robot's windows, by its index.
        tables: The newest line of each kind that only some pages look at.
        logs: Requests to devices, and their replies.
    """

    def __init__(self) -> None:
        self.version = 0
        self.time = 0
        self.scene: Line | None = None
        self.scene_text = "null"
        self.scene_version = 0
        self.lines: dict[str, Line] = {}
        self.latest: dict[str, Versioned] = {}
        self.places: dict[int, list[int]] = {}
        self._moved: dict[int, int] = {}
        self._left: dict[int, int] = {}
        self.place_version = 0
        self.place_time = 0
        self.story: deque[Line] = deque(maxlen=STORY_KEPT)
        self.story_count = 0
        self.seats: dict[str, Versioned] = {}
        self.seats_short: dict[str, Versioned] = {}
        self.guards: dict[str, Versioned] = {}
        self.windows: dict[int, Versioned] = {}
        self.tables: dict[str, Versioned] = {}
        self.logs = KeptLogs()
        self._deltas: dict[int, str] = {}
        self._snapshot: tuple[int, str] = -1, ""

    def row_of(self, robot: int) -> Line:
        """Return the newest row of a robot, by its index; empty: there is none."""
        rows = self.lines.get("rows", {}).get("robots", ())
        return next((row for row in rows if row["i"] == robot), {})

    def take(self, line: Line) -> str:
        """Learn from a line; its kind."""
        kind = str(line.get("k", ""))
        self.version += 1
        if isinstance(when := line.get("t"), int):
            self.time = when
        if kind == "scene":
            self._take_scene(line)
        elif kind == "pos":
            self._take_places(line)
        elif kind == "seat":
            self._take_seat(line)
        elif kind == "guard":
            self._take_guard(line)
        elif kind == "robot":
            self.windows[line["i"]] = Versioned(self.version, body_of(line))
        elif kind == "story":
            self.story_count += 1
            self.story.append(line)
        elif kind == "log":
            self.logs.take(line)
        elif kind in TABLES:
            self.tables[kind] = Versioned(self.version, body_of(line))
            self.logs.meet({str(one["id"]): one["label"] for one in line["devices"]})
        elif kind in LATEST:
            self.lines[kind] = line
            self.latest[kind] = Versioned(self.version, body_of(line))
        return kind

    # --- lines by their kind -------------------------------------------------------------

    def _take_scene(self, line: Line) -> None:
        self.scene = {key: value for key, value in line.items() if key not in ("k", "t")}
        self.scene_text = encode(self.scene)
        self.scene_version = self.version
        self.logs.meet({str(thing["id"]): thing["label"] for thing in line.get("things", ())})

    def _take_places(self, line: Line) -> None:
        here = {row[0]: row for row in line["p"]}
        for index, row in here.items():
            if self.places.get(index) != row:
                self._moved[index] = self.version
            self._left.pop(index, None)
        for index in self.places.keys() - here.keys():
            self._left[index] = self.version
            self._moved.pop(index, None)
        self.places = here
        self.place_version, self.place_time = self.version, line.get("t", 0)
        self._deltas.clear()

    def _take_seat(self, line: Line) -> None:
        seat = str(line["seat"])
        if seat not in self.seats and len(self.seats) >= MAX_SEATS:
            self.forget_seat(next(iter(self.seats)))
        self.seats[seat] = Versioned(self.version, body_of(line))
        short = body_of(short_seat(line))
        newest = self.seats_short.get(seat)
        if newest is None or newest.body != short:
            self.seats_short[seat] = Versioned(self.version, short)

    def _take_guard(self, line: Line) -> None:
        seat = str(line["seat"])
        if seat not in self.guards and len(self.guards) >= MAX_SEATS:
            del self.guards[next(iter(self.guards))]
        self.guards[seat] = Versioned(self.version, body_of(line))

    def forget_seat(self, seat: str) -> None:
        """Forget a seat whose client is gone for good."""
        self.guards.pop(seat, None)
        self.seats.pop(seat, None)
        self.seats_short.pop(seat, None)

    def seats_known(self) -> list[Line]:
        """Return the public part of all seats."""
        return [json.loads("{" + seat.body) for seat in self.seats_short.values()]

    # --- what a page gets ----------------------------------------------------------------

    def moved_since(self, version: int) -> str:
        """Return who moved or left after a version, as JSON without its first brace.

        The same text serves all pages that are equally far.
        """
        if version not in self._deltas:
            rows = [self.places[i] for i, at in self._moved.items() if at > version]
            line: MovedLine = {"k": "d", "t": self.place_time, "p": rows}
            if left := [index for index, at in self._left.items() if at > version]:
                line["gone"] = left
            self._deltas[version] = body_of(line)
        return self._deltas[version]

    def snapshot(self) -> str:
        """Return all there is, as JSON without its first brace; one text for all who ask."""
        if self._snapshot[0] != self.version:
            state = {
                "pos": list(self.places.values()),
                "story": list(self.story)[-STORY_SHOWN:],
                "story_from": self.story_count - min(STORY_SHOWN, len(self.story)),
                "seats": self.seats_known(),
                **self.lines,
            }
            head = f'"k":"snap","t":{self.time},"scene":{self.scene_text},"state":'
            self._snapshot = self.version, f"{head}{encode(state)}}}"
        return self._snapshot[1]


def short_seat(line: Line) -> OtherSeatLine:
    """Return the public part of a seat: that it is held, its robots, and its phase."""
    return {
        "k": "seat",
        "short": True,
        "seat": line["seat"],
        "phase": line["phase"],
        "order": line["order"],
        "label": line["label"],
        "robots": [drive["i"] for drive in line["drives"]],
    }
