"""Lines for people, written aside: an output that nobody reads holds nothing up."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Final

MOST_WAITING: Final = 1000  # lines; what is more is not told
LAST_LINES: Final = 0.5  # for what waits when all is over [s]


class LineWriter:
    """Says lines in a thread of its own, in their order.

    Args:
        say: Called with each line; it may wait, as a terminal does that was told to, and fail.
    """

    def __init__(self, say: Callable[[str], object]) -> None:
        self._lines: queue.Queue[str | None] = queue.Queue(MOST_WAITING)
        self._thread = threading.Thread(target=self._say, args=(say,), daemon=True)
        self._thread.start()

    def __call__(self, line: str) -> None:
        """Say a line soon, or never if too many wait."""
        with suppress(queue.Full):
            self._lines.put_nowait(line)

    def _say(self, say: Callable[[str], object]) -> None:
        with suppress(OSError):  # the reader has gone
            while (line := self._lines.get()) is not None:
                say(line)

    def close(self) -> None:
        """Give what waits a moment."""
        with suppress(queue.Full):
            self._lines.put_nowait(None)
            self._thread.join(LAST_LINES)
