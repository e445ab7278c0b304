"""What people ask for who play guards; all of it becomes messages of the guard's device."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dva_sim.agents.people.person_guard import KINDS, SAYINGS, SEVERITIES, PersonGuard
from dva_sim.console.refusal import Refused, Said
from dva_sim.console.world import ConsoleWorld

Line = dict[str, Any]
MOST_REASON = 200  # characters


class GuardActions:
    """Does what guards' pages ask for.

    Args:
        world: In which.
    """

    def __init__(self, world: ConsoleWorld) -> None:
        self._world, self._guards = world, world.guards
        self.doers: Mapping[str, Callable[[str, Line, Said], object]] = {
            "guard_join": self._join,
            "guard_leave": self._leave,
            "guard_answer": self._answer,
            "guard_say": self._say,
            "guard_place": self._place,
            "guard_report": self._report,
        }

    def _guard(self, client: str) -> PersonGuard:
        guard = self._guards.by_client.get(client)
        if guard is None:
            raise Refused("say first which guard you are")
        return guard

    def _join(self, client: str, line: Line, said: Said) -> None:
        label = line.get("guard")
        guard = self._guards.named(label) if isinstance(label, str) else None
        if guard is None:
            raise Refused(f"there is no guard {label!r} for people to play")
        if self._guards.by_client.get(client) is guard:
            said(True, f"you are {label} already")
            return
        if guard.attended:
            raise Refused(f"somebody else is {label}")
        self._guards.leave(client)
        self._guards.join(client, guard)
        said(True, f"you are {label}")

    def _leave(self, client: str, _: Line, said: Said) -> None:
        self._guards.leave(client)
        said(True, "nobody plays the guard now")

    def _answer(self, client: str, line: Line, said: Said) -> None:
        accepts, reason = line.get("accept"), line.get("reason", "")
        if not isinstance(accepts, bool):
            raise Refused("accept should be true or false")
        if not isinstance(reason, str) or len(reason) > MOST_REASON:
            raise Refused(f"reason should be a text of {MOST_REASON} characters at most")
        self._guard(client).answer(accepts, reason, said)

    def _say(self, client: str, line: Line, said: Said) -> None:
        what = line.get("what")
        if what not in SAYINGS:
            raise Refused(f"what should be one of {', '.join(SAYINGS)}")
        self._guard(client).say(str(what), said)

    def _place(self, client: str, line: Line, said: Said) -> None:
        self._guard(client).stand_at(*self._point(line), said)

    def _report(self, client: str, line: Line, said: Said) -> None:
        kind, severity = line.get("kind"), line.get("severity")
        if kind not in KINDS:
            raise Refused(f"kind should be one of {', '.join(KINDS)}")
        if severity not in SEVERITIES:
            raise Refused(f"severity should be one of {', '.join(SEVERITIES)}")
        self._guard(client).report(str(kind), *self._point(line), str(severity), said)

    def _point(self, line: Line) -> tuple[float, float]:
        """A place on the site [m].

        Raises:
            Refused: it is none.
        """
        x, y = line.get("x_m"), line.get("y_m")
        left, low, right, high = self._world.run.stage.site.extent
        if not (_is_within(x, left, right) and _is_within(y, low, high)):
            raise Refused("x_m and y_m should be a place on the site")
        return float(x), float(y)  # type: ignore[arg-type]


def _is_within(value: Any, least: float, most: float) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and least <= value <= most
