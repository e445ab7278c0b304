"""The messages of a recording as logs: what a device was asked, what it answered, what it heard.

They stand in the order in which they were sent: of the way to the device a recording knows nothing.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable
from typing import Any

from dva_sim.console.wire.limits import LOG_BATCH
from dva_sim.console.wire.records import ExchangesLine
from dva_sim.kernel.recorder import Sent

FIRST = 2000  # of those before the moment that is shown
# What is published, to whom it may concern; nobody answers it.
PUBLISHED = re.compile(
    rb"<(HBMsg|RobotStatus|PersonStatus|RobotHolder|SensorValue|MissionStatus|EventStatus)>"
)
_REPLY = re.compile(rb"<reply>\s*<Answers>(\d+)</Answers>")
_NUMBER = re.compile(rb"<MessageID>(\d+)</MessageID>")
_COMMAND = b"<SetTeleOp>"


class ExchangeLog:
    """The exchanges of one device, by time.

    Args:
        traffic: All messages of a run, by time.
        node: Id of the device.
    """

    def __init__(self, traffic: Iterable[Sent], node: str) -> None:
        self._lines: list[list[Any]] = []
        self._times: list[float] = []
        asked: dict[tuple[str, bytes], list[Any]] = {}
        for sent in traffic:
            data = sent.payload
            if not isinstance(data, bytes) or node not in (sent.source, sent.destination):
                continue
            answered = _REPLY.search(data)
            if sent.source == node:
                line = asked.get((sent.destination, answered[1])) if answered else None
                if line is not None:
                    line[3], line[5] = data.decode("latin-1"), 0
            elif answered is None:
                self._add(asked, sent, data)

    def _add(self, asked: dict[tuple[str, bytes], list[Any]], sent: Sent, data: bytes) -> None:
        """A command counts as published until it is found to be answered."""
        is_published = PUBLISHED.search(data) is not None or _COMMAND in data
        when = round(1000 * sent.time)
        line = [len(self._lines) + 1, when, data.decode("latin-1"), None, None, int(is_published)]
        self._lines.append(line)
        self._times.append(sent.time)
        if number := _NUMBER.search(data):
            asked[sent.source, number[1]] = line

    def until(self, now: float) -> int:
        """Return how many there were up to a moment [s]."""
        return bisect_right(self._times, now)

    def batches(self, name: str, sent: int, end: int) -> list[ExchangesLine]:
        """Lines for pages, of those after the first `sent` up to the first `end`."""
        starts = range(max(sent, end - FIRST), end, LOG_BATCH)
        return [
            {"k": "log", "log": name, "lines": self._lines[start : min(end, start + LOG_BATCH)]}
            for start in starts
        ]
