"""The DVA's log of requests, read by messages, as lines of the log that pages show."""

from __future__ import annotations

from base64 import b64decode
from collections.abc import Callable
from typing import Any, Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.console.wire.records import ExchangesLine
from dva_sim.console.wire.rows import LogShown
from dva_sim.protocol import messages as m

LOG: Final = "dva"  # name of the log
LOOKED: Final = 0.4  # from one question to the next while a page looks [s]
UNLOOKED: Final = 2.0  # while none does: what comes meanwhile is still kept by the DVA [s]
REFUSED: Final = 10.0  # after a refusal: the DVA may be another one by then [s]


class RequestReader:
    """Asks for new requests again and again, as long as the DVA shows them.

    Args:
        agent: Control room that asks.
        tell: Callback for lines of the log.

    Attributes:
        is_looked: True while a page looks at the log.
        shown: State of the log: unknown, kept by the DVA, not kept, or not permitted.
    """

    def __init__(self, agent: ControlRoomAgent, tell: Callable[[ExchangesLine], object]) -> None:
        self._agent = agent
        self._tell = tell
        self.is_looked = False
        self.shown: LogShown = "unknown"
        self._newest: int | None = None  # None: nothing was told yet
        self._asked = -REFUSED
        self._is_asking = False

    def go_on(self) -> None:
        """Ask if it is time to, unless this console's role does not allow it."""
        dispatch = self._agent.dispatch
        if dispatch is not None and dispatch.role == "look":
            self.shown = "not_permitted"
            return
        refused = self.shown in ("not_kept", "not_permitted")
        pause = REFUSED if refused else LOOKED if self.is_looked else UNLOOKED
        if not self._is_asking and self._now - self._asked >= pause:
            self._ask()

    @property
    def _now(self) -> float:
        return self._agent.device.clock.now

    def _ask(self) -> None:
        self._is_asking = True
        self._asked = self._now
        self._agent.ask(m.GetRequestLog(self._newest or None), self._answered, self._failed)

    def _failed(self) -> None:
        self._is_asking = False

    def _answered(self, reply: m.Reply) -> None:
        self._is_asking = False
        if isinstance(reply.content, m.RequestLog):
            self.shown = "kept"
            self._take(reply.content)
        elif reply.code == m.NOT_PERMITTED:
            self.shown = "not_permitted"
        elif reply.code in (m.NOT_SUPPORTED, m.BAD_MESSAGE):  # or one before version 1.8
            self.shown = "not_kept"

    def _take(self, log: m.RequestLog) -> None:
        """Tell what is new; a DVA that has restarted counts from 1 again."""
        is_anew = self._newest is None or log.newest < self._newest
        if is_anew and self._newest:
            self._newest = None
            self._ask()
            return
        if is_anew or log.requests:
            rows = [self._row(entry) for entry in log.requests]
            line: ExchangesLine = {"k": "log", "log": LOG, "lines": rows}
            self._tell({**line, "replaces": True} if is_anew else line)
        self._newest = log.requests[-1].request_number if log.requests else self._newest or 0
        if log.requests:
            self._ask()  # more may wait

    def _row(self, entry: m.LoggedRequest) -> list[Any]:
        """Describe a request; see `ExchangesLine`."""
        took = entry.service_time
        return [
            entry.request_number,
            round(1000 * (self._now - entry.ago)),
            b64decode(entry.request).decode("latin-1"),
            None if entry.reply is None else b64decode(entry.reply).decode("latin-1"),
            None if took is None else round(1e6 * took),
            0,
            entry.code,
            entry.text or "",
            entry.size,
        ]
