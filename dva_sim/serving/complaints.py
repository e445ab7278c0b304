"""Limits what a server writes to standard error: a few mistakes of ours, no faults of clients.

Standard error may be a pipe that nobody reads until the end. A client that could fill it would stop
the whole process.
"""

from __future__ import annotations

import asyncio
import logging

MOST_COMPLAINTS = 5


def limit_complaints() -> None:
    """Limit the loggers of the server and of its event loop to a few complaints in all."""
    handler = Complaints()
    for name in ("uvicorn.error", "asyncio"):
        logger = logging.getLogger(name)
        logger.handlers, logger.propagate = [handler], False
        logger.setLevel(logging.WARNING)


class Complaints(logging.StreamHandler):  # type: ignore[type-arg]
    """Writes the first few records in full, and none about what clients sent or how they left."""

    NOISE = ("Invalid", "Cancel", "Unsupported", "No supported", "ASGI callable")

    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Write a complaint, unless it is of a client or there were enough."""
        cut_off = record.exc_info and isinstance(record.exc_info[1], asyncio.CancelledError)
        if cut_off or record.getMessage().startswith(self.NOISE):
            return
        self._count += 1
        if self._count <= MOST_COMPLAINTS:  # nobody may read them
            super().emit(record)
