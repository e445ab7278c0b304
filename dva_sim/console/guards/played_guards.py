"""Guards played by people, and the messages that they receive."""

from __future__ import annotations

from collections.abc import Iterator

from dva_sim.agents.people.person_guard import PersonGuard
from dva_sim.console.views.feed import Feed
from dva_sim.console.wire.seats import GuardLine, GuardOrder, WayThere
from dva_sim.simulation.full.run import Run


class PlayedGuards:
    """Assignment of people to guards.

    Args:
        feed: About it.

    Attributes:
        by_client: The guards that somebody plays, by their pages.
    """

    def __init__(self, run: Run, feed: Feed) -> None:
        self._run = run
        self._feed = feed
        self.by_client: dict[str, PersonGuard] = {}
        self._ways: dict[str, tuple[object, WayThere]] = {}  # the newest, and what it is of
        self._left: list[str] = []  # who is to be told so

    def named(self, label: str) -> PersonGuard | None:
        """Return the guard of a label, if people may play it."""
        guards = (g for g in self._run.field.guards if g.device.label == label)
        guard = next(guards, None)
        return guard if isinstance(guard, PersonGuard) else None

    def join(self, client: str, guard: PersonGuard) -> None:
        """Let a page's person play a guard."""
        self.by_client[client] = guard
        guard.join()

    def leave(self, client: str) -> bool:
        """End the play of a page's person; return True if there was one."""
        guard = self.by_client.pop(client, None)
        if guard is not None:
            guard.leave()
            self._left.append(client)
            self._ways.pop(client, None)
        return guard is not None

    def lines(self) -> Iterator[tuple[str, GuardLine]]:
        """Yield a line for each who plays, and one more for who plays no longer."""
        gone = self._left
        self._left = []
        for client in gone:
            if client not in self.by_client:
                yield client, self._line(client, None)
        for client, guard in self.by_client.items():
            yield client, self._line(client, guard)

    def _line(self, client: str, guard: PersonGuard | None) -> GuardLine:
        device = None if guard is None else guard.device
        return {
            "k": "guard",
            "t": self._feed.now_ms,
            "seat": client,
            "guard": None if device is None else self._feed.numbers[device.id_tag],
            "label": "" if device is None else device.label,
            "doing": "" if guard is None else guard.activity,
            "order": None if guard is None else self._order(client, guard),
            "alert": "" if guard is None else guard.alert or guard.device.dva_alert,
        }

    def _order(self, client: str, guard: PersonGuard) -> GuardOrder | None:
        """Return the order, and the way there from where the person stands."""
        order = guard.order
        if order is None:
            return None
        of = order, guard.walking.place
        if client not in self._ways or self._ways[client][0] != of:
            self._ways[client] = of, self._way(guard)
        return {
            "event": order.event_id,
            "kind": order.kind,
            "task": order.task,
            **self._ways[client][1],
            "answered": guard.answered,
        }

    def _way(self, guard: PersonGuard) -> WayThere:
        goal = guard.goal()
        assert goal is not None
        (x, y), length, points = goal
        return {
            "x_m": round(x, 2),
            "y_m": round(y, 2),
            "room": self._run.stage.site.room_at(x, y),
            "distance_m": round(length, 1) if length < 1e6 else None,
            "way_m": points,
        }
