"""Outbox of requests to the simulation: bounded, and urgent ones first."""

from __future__ import annotations

import json
from collections import deque

from dva_sim.console.wire.actions import ACTIONS, OF_THE_WEB, Asked, Queueing
from dva_sim.console.wire.limits import MOST_ACTIONS, MOST_BATCHES, MOST_URGENT


class OutgoingLines:
    """Lines to the simulation that have not been written yet.

    Only the newest input, watched robots and viewed logs of each client wait.
    Of a phone's samples all count, in their order; if too many wait, the oldest are lost, which
    their numbers tell.

    Attributes:
        refused: Number of actions rejected for lack of room.
    """

    def __init__(self) -> None:
        self._urgent: deque[Asked] = deque()
        self._actions: deque[Asked] = deque()
        self._newest: dict[tuple[str, str], Asked] = {}
        self._samples: dict[str, deque[Asked]] = {}
        self.refused = 0

    def put(self, asked: Asked) -> bool:
        """Add a line: whether there was room."""
        kind, client = asked["do"], asked.get("client", "")
        known = ACTIONS.get(kind) or OF_THE_WEB.get(kind)
        waits = known.waits if known is not None else Queueing.IN_TURN
        if waits is Queueing.NEWEST:
            self._newest[client, kind] = asked
            return True
        if waits is Queueing.BATCH:
            self._samples.setdefault(client, deque(maxlen=MOST_BATCHES)).append(asked)
            return True
        if kind == "gone":
            for hand in ("input", "manual"):
                self._newest.pop((client, hand), None)
            self._samples.pop(client, None)
        is_urgent = waits is Queueing.FIRST
        queue = self._urgent if is_urgent else self._actions
        if len(queue) >= (MOST_URGENT if is_urgent else MOST_ACTIONS):
            self.refused += 1
            return False
        queue.append(asked)
        return True

    def next(self) -> bytes | None:
        """The next line to write, with its end; None if there is nothing to say."""
        if self._urgent:
            asked = self._urgent.popleft()
        elif self._actions:
            asked = self._actions.popleft()
        elif self._newest:
            asked = self._newest.pop(next(iter(self._newest)))
        elif self._samples:
            asked = self._next_samples()
        else:
            return None
        return json.dumps(asked, separators=(",", ":")).encode() + b"\n"

    def _next_samples(self) -> Asked:
        """Return the next samples, of each phone in turn."""
        client = next(iter(self._samples))
        waiting = self._samples.pop(client)
        asked = waiting.popleft()
        if waiting:
            self._samples[client] = waiting
        return asked
