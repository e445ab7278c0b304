"""What a server complains about: mistakes of ours, a few times; never what clients sent.

Standard error may be a pipe that nobody reads until the end: whoever could fill it from outside
would hold up the whole process.
"""

from __future__ import annotations

import asyncio
import logging

MOST_COMPLAINTS = 5


def limit_complaints() -> None:
    """Let the loggers of the server and of its event loop complain a few times in all."""
    handler = Complaints()
    for name in ("uvicorn.error", "asyncio"):
        logger = logging.getLogger(name)
        logger.handlers, logger.propagate = [handler], False
        logger.setLevel(logging.WARNING)


class Complaints(logging.StreamHandler):  # type: ignore[type-arg]
    """A mistake of ours in full, the first times; what clients sent, and how they ended, not."""

    NOISE = ("Invalid", "Cancel", "Unsupported", "No supported", "ASGI callable")

    def __init__(self, level: int = logging.WARNING) -> None:
        super().__init__()
        self.setLevel(level)
        self._count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Write a complaint, unless it is of a client or there were enough."""
        cut_off = record.exc_info and isinstance(record.exc_info[1], asyncio.CancelledError)
        if cut_off or record.getMessage().startswith(self.NOISE):
            return
        self._count += 1
        if self._count <= MOST_COMPLAINTS:  # nobody may read them
            super().emit(record)
