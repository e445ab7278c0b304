"""A bench whose DVA runs in the process that has started this one, over a pipe."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any, Final

from dva_sim.agents.device import do_nothing
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.wire.rows import ServerShown
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import split_address
from dva_sim.protocol.devices import ControlRoomRole
from dva_sim.serving.pipes import LineKinds, LinePipe

PLAIN: Final = LineKinds(newest=frozenset(), kept=frozenset({"ask", "say", "done"}))


class PipedBench:
    """The DVA's own process, as its page knows it; see `Bench`.

    Args:
        pipe: Pipe to that process.
        address: Address at which the DVA listens.
    """

    def __init__(self, pipe: LinePipe, address: str) -> None:
        self._pipe = pipe
        self._address = address
        self._listens = True
        self._roles: dict[str, ControlRoomRole] = {}
        self._numbers = count(1)
        self._asked: dict[int, Callable[[bool, str], object]] = {}
        self._moved: Callable[[str], object] = do_nothing

    def follow(self, clock: LiveClock, moved: Callable[[str], object]) -> None:
        """Hear that process from now on; the clock stops once it has ended.

        Args:
            clock: Clock of this process.
            moved: Callback when the DVA listens elsewhere.
        """
        self._moved = moved

        def hear() -> None:
            for line in self._pipe.lines():
                self._hear(line)
            if not self._pipe.is_open:
                clock.unwatch(self._pipe.fileno())
                clock.stop()

        clock.watch(self._pipe.fileno(), hear)

    def say(self, text: str) -> None:
        """Have a line printed there."""
        self._pipe.put({"k": "say", "text": text})

    def server(self) -> ServerShown:
        """Implement `Bench`."""
        return {
            "listens": self._listens,
            "address": self._address,
            "port": split_address(self._address)[1],
            "modelled": False,
        }

    def open_server(self, port: int, on_result: OnResult) -> None:
        """Implement `Bench`."""
        self._ask("start", on_result, port=port)

    def close_server(self, on_result: OnResult) -> None:
        """Implement `Bench`."""
        self._ask("stop", on_result)

    def appoint(
        self, room: str, role: ControlRoomRole, then: Callable[[], object] = do_nothing
    ) -> None:
        """Implement `Bench`."""
        if self._roles.get(room) == role:
            then()
            return
        self._roles[room] = role
        self._ask("appoint", lambda *_: then(), room=room, role=role)

    def forget(self, device: str, then: Callable[[], object] = do_nothing) -> None:
        """Implement `Bench`."""
        self._ask("forget", lambda *_: then(), device=device)

    def _ask(self, what: str, then: Callable[[bool, str], object], **more: Any) -> None:
        number = next(self._numbers)
        self._asked[number] = then
        self._pipe.put({"k": "ask", "n": number, "what": what, **more})

    def _hear(self, line: dict[str, Any]) -> None:
        self._listens = line["listens"]
        if line["address"] != self._address:
            self._address = line["address"]
            self._moved(self._address)
        self._asked.pop(line["n"])(line["ok"], line["text"])
