"""Logs of messages: what devices of the run are asked and answer, told to the web in batches.

Every device of the run has a log, by its label: `dva`, `robot-1`, ... The web says which ones
somebody looks at; only those have a tap on the network, so that the others cost nothing. What a
page then gets is a line of the kind `log`, at most five times a second and of at most 200
exchanges: of a flood the newest, and numbers that tell how many were left out.

`keep` makes a log that is always written, and `listen` lets others in this process have each
exchange as it happens:

    world.logs.keep("robot-1")
    world.logs.listen("robot-1", latency.take)   # an `Exchange` of `dva_sim.network.tap`
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final

from dva_sim.console.wire.limits import LOG_BATCH, LOG_BYTES
from dva_sim.console.wire.records import ExchangesLine
from dva_sim.network.messaging import Transport
from dva_sim.network.tap import Exchange, Tap
from dva_sim.protocol.schema import MAX_BYTES

Take = Callable[[Exchange], object]

CUT: Final = MAX_BYTES + 1  # enough of a message to show that it is too long [B]


class MessageLog:
    """Exchanges of one device since the web process was told last.

    Args:
        name: Label of the device.
        node: Its id.
        transport: Transport that carries its messages.

    Attributes:
        kept: True if it is written even when nobody looks.
        wants_all: True if it always includes publications.
        listeners: Further receivers of each exchange.
    """

    def __init__(self, name: str, node: str, transport: Transport) -> None:
        self.name = name
        self._node = node
        self._transport = transport
        self.kept = self.wants_all = False
        self.listeners: list[Take] = []
        self._tap = Tap(transport.clock, self._take, publications=False)
        self._waiting: deque[Exchange] = deque(maxlen=LOG_BATCH)
        self._sent = self._total = 0

    def look(self, looks: bool, publications: bool) -> None:
        """Set whether somebody looks, and wants publications as well."""
        taps = self._transport.taps
        self._tap.publications = publications or self.wants_all
        if looks or self.kept or self.listeners:
            taps[self._node] = self._tap
        elif taps.get(self._node) is self._tap:
            del taps[self._node]
            self._waiting.clear()

    def batch(self) -> ExchangesLine | None:
        """Return what is new, the newest where that is too much; None if there is nothing."""
        if not self._waiting:
            return None
        lines: list[list[Any]] = []
        room = LOG_BYTES
        while self._waiting and room > 0:
            line = _line_of(self._waiting.pop())
            room -= len(line[2]) + len(line[3] or "")
            lines.append(line)
        self._waiting.clear()
        self._sent = self._total
        return {"k": "log", "log": self.name, "lines": lines[::-1]}

    def _take(self, exchange: Exchange) -> None:
        for listener in self.listeners:
            listener(exchange)
        again = exchange.number <= self._total
        self._total = max(self._total, exchange.number)
        if not again or exchange.number <= self._sent:
            self._waiting.append(exchange)  # one that waits is told with what became of it


def _line_of(exchange: Exchange) -> list[Any]:
    """Describe an exchange; see `ExchangesLine`."""
    reply = exchange.reply
    took = exchange.service_s
    return [
        exchange.number,
        round(1000 * exchange.arrived),
        exchange.data[:CUT].decode("latin-1"),
        None if reply is None else reply[:CUT].decode("latin-1"),
        None if took is None else round(1e6 * took),
        int(exchange.published),
    ]


class Logs:
    """All logs of a run.

    Args:
        transport: Transport that carries the messages.
        node_of: Function that returns the id of a device by its label; None: there is none of that
            label.
    """

    def __init__(self, transport: Transport, node_of: Callable[[str], str | None]) -> None:
        self._transport = transport
        self._node_of = node_of
        self._logs: dict[str, MessageLog] = {}
        self._looked: dict[str, bool] = {}

    def keep(self, name: str) -> None:
        """Write a log from now on, whether somebody looks or not."""
        log = self._log(name)
        if log is not None:
            log.kept = True
            self._apply(log)

    def listen(self, name: str, take: Take, publications: bool = False) -> None:
        """Let somebody in this process have each exchange of a device; it must not wait."""
        log = self._log(name)
        if log is not None:
            log.listeners.append(take)
            log.wants_all |= publications
            self._apply(log)

    def look(self, looked: Mapping[str, bool]) -> None:
        """Select the logs that pages look at; whether they want publications, too."""
        self._looked = dict(looked)
        for name in looked:
            self._log(name)
        for log in self._logs.values():
            self._apply(log)

    def batches(self) -> list[ExchangesLine]:
        """Return what is to be told now."""
        batches = (log.batch() for log in self._logs.values())
        return [line for line in batches if line is not None]

    def _apply(self, log: MessageLog) -> None:
        log.look(log.name in self._looked, self._looked.get(log.name, False))

    def _log(self, name: str) -> MessageLog | None:
        node = self._node_of(name)
        if name not in self._logs and node is not None:
            self._logs[name] = MessageLog(name, node, self._transport)
        return self._logs.get(name)
