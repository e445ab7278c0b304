"""Real sockets in place of the modelled link: what others join, on loopback or a network."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from typing import Any

from dva_sim.console.run.recorder import ConsoleRecorder
from dva_sim.kernel.clock import Clock
from dva_sim.network.carriers import Carrier, free_port
from dva_sim.network.keys import KeyRing
from dva_sim.network.mqtt import open_broker
from dva_sim.network.realtime import PacedClock
from dva_sim.simulation.full.observations import Listener, Senders
from dva_sim.simulation.full.stage import id_of
from dva_sim.simulation.scenario import Scenario

_ENDS = re.compile(
    rb"<DestinationID>([0-9A-F:]{17})</DestinationID>.{0,200}?<SourceID>([0-9A-F:]{17})<", re.DOTALL
)
_HEADER = 400  # so many bytes hold it
TITLE = "the links are real: they are what the network of this machine makes them"


MakeSockets = Callable[[Scenario, PacedClock, ConsoleRecorder], "ConsoleSockets"]


def start_of_day(clock: Clock) -> tuple[float, bool]:
    """When a clock was at zero, by the clock on the wall [s since midnight]; exactly."""
    started = time.time() - clock.now
    local = time.localtime(started)
    return local.tm_hour * 3600 + local.tm_min * 60 + local.tm_sec + started % 1.0, True


class ConsoleSockets:
    """The sockets of all devices of a console; over ZeroMQ each has two ports of its own.

    Args:
        scenario: Says what is set on the sockets.
        clock: Waits for them.
        recorder: Told what goes wrong, and of each message.
        host: Address of this machine to listen on.
        port: Of the DVA's requests; its publications have the next one. 0: any two that are free.
        ring: Keys of the devices; None to run without.
        carrier: What carries the messages; None: ZeroMQ.

    Attributes:
        dva: Where the DVA listens, once it does.
    """

    def __init__(
        self,
        scenario: Scenario,
        clock: PacedClock,
        recorder: ConsoleRecorder,
        host: str = "127.0.0.1",
        port: int = 0,
        ring: KeyRing | None = None,
        carrier: Carrier | None = None,
    ) -> None:
        self._clock, self._recorder, self._host, self._port = clock, recorder, host, port
        self.dva = ""
        carrier, broker, self._broker = carrier or Carrier(), "", None
        if carrier.is_mqtt:
            self._port = port or free_port(host)
            broker, self._broker = f"{host}:{self._port}", open_broker(host, self._port)
        self.network = carrier.open(clock, ring, self._tell, scenario.zeromq, broker)
        self._said = Senders(self.network.is_here)

    def _tell(self, line: str) -> None:
        self._recorder.tell(self._clock.now, "console", line, "link")

    def join(self, kind: str, number: int) -> str:
        """See `RealLinks`.

        Raises:
            NetworkError: a port that is taken, or a host that is not this machine.
        """
        is_dva = kind == "dva"
        port = self._port if is_dva else 0
        address = self.network.join(id_of(kind, number), self._host, port)
        if is_dva:
            self.dva = address
        return address

    def time_of_day(self) -> tuple[float, bool]:
        """See `RealLinks`: by the clock on the wall."""
        return start_of_day(self._clock)

    def watch(self, listener: Listener) -> None:
        """See `RealLinks`: all devices of ours are in this process, so each message is seen."""

        def note(node: str, payload: Any, sent: bool) -> None:
            now = self._clock.now
            if not isinstance(payload, bytes):
                if sent:
                    listener.sent(now, node, "", payload)
                    self._recorder.message_sent(now, node, "", 0, payload)
                return
            ends = _ENDS.search(payload, 0, _HEADER)
            if ends is None:
                return
            to, source = ends[1].decode(), ends[2].decode()
            if sent:
                self._said.note(node, payload)
                listener.sent(now, node, to, payload)
                self._recorder.message_sent(now, node, to, len(payload), payload)
            else:
                self._recorder.message_taken(node, payload)
                listener.delivered(now, self._said.sender(source, payload), node, payload)

        self.network.watcher = note

    def close(self) -> None:
        """Close all; what was sent last has a moment to leave."""
        self.network.close()
        if self._broker is not None:
            self._broker.close()
