"""What clients ask of the simulation, on its way there: bounded, and the urgent first."""

from __future__ import annotations

import json
from collections import deque
from typing import Any

URGENT = ("emergency", "gone")
MOST = 64  # actions that may wait, of each kind

Asked = dict[str, Any]


class OutgoingLines:
    """Lines to the simulation that have not been written yet.

    Of inputs and of watched robots only the newest waits, for each client.

    Attributes:
        refused: How many actions found no room.
    """

    def __init__(self) -> None:
        self._urgent: deque[Asked] = deque()
        self._actions: deque[Asked] = deque()
        self._newest: dict[tuple[str, str], Asked] = {}
        self.refused = 0

    def put(self, asked: Asked) -> bool:
        """Add a line: whether there was room."""
        kind, client = asked["do"], asked.get("client", "")
        if kind in ("input", "watch"):
            self._newest[client, kind] = asked
            return True
        if kind == "gone":
            self._newest.pop((client, "input"), None)
        queue = self._urgent if kind in URGENT else self._actions
        if len(queue) >= MOST:
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
        else:
            return None
        return json.dumps(asked, separators=(",", ":")).encode() + b"\n"
