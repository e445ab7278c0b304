"""Feed of one page: never a queue, always the newest of what it does not have yet.

Positions merge (a page that slept gets all who moved meanwhile, once), other kinds are replaced by
their newest line, the story is a bounded list: who is too far behind gets a snapshot instead. What
is meant for this page alone waits in a short list.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from dva_sim.console.web.logs import TABLES, Looks
from dva_sim.console.web.state import LATEST, RunState, Versioned, body_of
from dva_sim.console.wire.limits import OWN_KEPT

Sources = tuple[str, ...]
SOURCES: Sources = ("seat", "guard", "windows", "d", *LATEST, "story", "others", "log", *TABLES)


class PageFeed:
    """State of a page, and so what it lacks.

    Args:
        state: State of the run.
        seat: Seat of this page; its lines come in full.
        acts: True if the page may drive.

    Attributes:
        looks: Logs and tables that it views.
        watches: Robots at which it looks.
    """

    def __init__(self, state: RunState, seat: str, acts: bool = True) -> None:
        self._state = state
        self._seat = seat
        self.looks = Looks(state.logs, acts)
        self.watches: frozenset[int] = frozenset()
        self._have_windows: dict[int, int] = {}
        self._own: deque[str] = deque()
        self._count = 0
        self._turn = 0
        self._wants_snapshot = True
        self._have: dict[str, int] = {}
        self._have_seats: dict[str, int] = {}
        self._have_places = 0
        self._have_story = 0
        self._have_scene = -1

    def resync(self) -> None:
        """Begin again with all there is."""
        self._wants_snapshot = True

    def put(self, line: Mapping[str, Any]) -> bool:
        """Add a line for this page alone; False if too many wait, as of a page that is not read."""
        if len(self._own) >= OWN_KEPT:
            return False
        self._own.append(body_of(line))
        return True

    def next(self) -> str | None:
        """Return the next message, as JSON; None if the page has everything."""
        body = self._next_body()
        if body is None:
            return None
        self._count += 1
        return f'{{"s":{self._count},{body}'

    def _next_body(self) -> str | None:
        if self._own:
            return self._own.popleft()
        if self._wants_snapshot or self._have_scene != self._state.scene_version:
            return self._snapshot()
        # Each source has its turn, so that a fast one does not starve the others of a slow page.
        for step in range(len(SOURCES)):
            turn = (self._turn + step) % len(SOURCES)
            if (body := self._from(SOURCES[turn])) is not None:
                self._turn = (turn + 1) % len(SOURCES)
                return body
        return None

    def _snapshot(self) -> str:
        state = self._state
        self._wants_snapshot = False
        self._have_scene = state.scene_version
        self._have = {kind: known.version for kind, known in state.latest.items()}
        self._have_places = state.place_version
        self._have_story = state.story_count
        self._have_seats = {seat: known.version for seat, known in state.seats_short.items()}
        self._have_windows.clear()
        for own in ("seat", "guard"):
            self._have.pop(own, None)
        return state.snapshot()

    def _from(self, source: str) -> str | None:
        if source == "d":
            return self._moved()
        if source == "story":
            return self._next_story_line()
        if source == "others":
            return self._others()
        if source == "windows":
            return self._window()
        if source == "log":
            line = self.looks.next()
            return None if line is None else body_of(line)
        if source in TABLES:
            looked = source in self.looks.tables
            return self._newer(source, self._state.tables.get(source)) if looked else None
        if source == "seat":
            return self._newer("seat", self._state.seats.get(self._seat))
        if source == "guard":
            return self._newer("guard", self._state.guards.get(self._seat))
        return self._newer(source, self._state.latest.get(source))

    def _window(self) -> str | None:
        """Return news of the robot that the page looks at; it knows no other."""
        have = self._have_windows = {
            i: v for i, v in self._have_windows.items() if i in self.watches
        }
        for index in self.watches:
            window = self._state.windows.get(index)
            if window is not None and window.version > have.get(index, 0):
                have[index] = window.version
                return window.body
        return None

    def _newer(self, kind: str, newest: Versioned | None) -> str | None:
        if newest is None or newest.version <= self._have.get(kind, 0):
            return None
        self._have[kind] = newest.version
        return newest.body

    def _moved(self) -> str | None:
        state = self._state
        if state.place_version <= self._have_places:
            return None
        since = self._have_places
        self._have_places = state.place_version
        return state.moved_since(since)

    def _next_story_line(self) -> str | None:
        state = self._state
        missing = state.story_count - self._have_story
        if missing <= 0:
            return None
        if missing > len(state.story):
            return self._snapshot()
        self._have_story += 1
        return body_of(state.story[-missing])

    def _others(self) -> str | None:
        for seat, newest in self._state.seats_short.items():
            if seat != self._seat and newest.version > self._have_seats.get(seat, 0):
                self._have_seats[seat] = newest.version
                return newest.body
        return None
