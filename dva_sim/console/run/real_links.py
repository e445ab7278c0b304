"""Real sockets in place of the modelled link: what others join, on loopback or a network."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from typing import Any

from typing_extensions import override

from dva_sim.console.run.recorder import ConsoleRecorder
from dva_sim.kernel.clock import Clock
from dva_sim.network.emulator.crossing import CrossedLink
from dva_sim.network.emulator.forwarder import FAR, NEAR
from dva_sim.network.emulator.report import LinkReport
from dva_sim.network.keys import KeyRing
from dva_sim.network.link import LinkConfig
from dva_sim.network.realtime import PacedClock
from dva_sim.network.sockets import NodeCrossing, SocketNetwork
from dva_sim.simulation.full.observations import Listener, Senders
from dva_sim.simulation.full.stage import id_of, kind_of
from dva_sim.simulation.scenario import Scenario

_ENDS = re.compile(
    rb"<DestinationID>([0-9A-F:]{17})</DestinationID>.{0,200}?<SourceID>([0-9A-F:]{17})<", re.DOTALL
)
_AT_FAR_END = {"robot", "guard", "detector"}
LOOK_AT_LINK = 0.5  # between looks at whether it is still there [s]
_HEADER = 400  # so many bytes hold it
TITLE = "the links are real: they are what the network of this machine makes them"
EMULATED = "the links are real, and emulated as --link says, from beginning to end"


MakeSockets = Callable[[Scenario, PacedClock, ConsoleRecorder], "ConsoleSockets"]


def start_of_day(clock: Clock) -> tuple[float, bool]:
    """Return when a clock was at zero, by the wall clock [s since midnight]; if exactly."""
    started = time.time() - clock.now
    local = time.localtime(started)
    return local.tm_hour * 3600 + local.tm_min * 60 + local.tm_sec + started % 1.0, True


class RobotCrossing(NodeCrossing):
    """An emulated link between robots, guards and detectors, and all other devices.

    Args:
        config: The link.
        seed: Random seed of its losses and jitter.

    Raises:
        EmulatorError: it cannot be set up here; the line says what is missing.
    """

    def __init__(self, config: LinkConfig, seed: int) -> None:
        self.link = CrossedLink(config, seed)

    @override
    def place(self, port: int) -> str:
        return f"ipc://{self.link.place(port)}"

    @override
    def way(self, node: str, peer: str, endpoint: str) -> str | None:
        here = _end_of(node)
        if here == _end_of(peer):
            return None
        return f"ipc://{self.link.way(here, int(endpoint.rpartition(':')[2]))}"


def _end_of(node: str) -> str:
    return FAR if kind_of(node)[0] in _AT_FAR_END else NEAR


class ConsoleSockets:
    """The sockets of all devices of a console; each has two ports of its own.

    Args:
        scenario: Says what is set on the sockets.
        clock: Waits for them.
        recorder: Recorder of messages and failures.
        host: Address to listen on.
        port: Port for the DVA's requests; its publications have the next one, and the DVAs of other
            regions those behind. 0: any free ones.
        ring: Keys of the devices; None to run without.
        emulated: Random seed of the scenario's link, which is emulated between robots, guards and
            detectors and everybody else; None: it is not.

    Attributes:
        dva: Address of the DVA, or that of the first region, once it listens.
        crossing: The emulated link, if there is one.
        packets: Report on the packets, at the end.
    """

    packets: LinkReport | None

    def __init__(
        self,
        scenario: Scenario,
        clock: PacedClock,
        recorder: ConsoleRecorder,
        host: str = "127.0.0.1",
        port: int = 0,
        ring: KeyRing | None = None,
        emulated: int | None = None,
    ) -> None:
        self._clock = clock
        self._recorder = recorder
        self._host = host
        self._port = port
        self.dva = ""
        self.packets = None
        self.crossing = None if emulated is None else RobotCrossing(scenario.link, emulated)
        self.network = SocketNetwork(clock, ring, self._tell, scenario.zeromq, self.crossing)
        if self.crossing is not None:
            clock.every(LOOK_AT_LINK, self._look_at_link)
        self._senders = Senders(self.network.is_here)

    def begin(self) -> None:
        """Let the time of the emulated link, if there is one, begin with that of the world."""
        if self.crossing is not None:
            self.crossing.link.begin()

    @property
    def has_lost_link(self) -> bool:
        """True if the emulated link has ended by itself."""
        return self.crossing is not None and self.crossing.link.has_ended

    def refuse_lost_link(self) -> None:
        """Refuse to go on without the emulated link.

        Raises:
            LinkEnded: it has ended by itself.
        """
        if self.crossing is not None and self.has_lost_link:
            raise self.crossing.link.ended()

    def _look_at_link(self) -> bool:
        if self.has_lost_link:
            self._clock.stop()
        return not self.has_lost_link

    def _tell(self, line: str) -> None:
        self._recorder.tell(self._clock.now, "console", line, "link")

    def join(self, kind: str, number: int) -> str:
        """Open the ports of a device; see `RealLinks`.

        Raises:
            NetworkError: a port that is taken, or a host that is not this machine.
        """
        is_dva = kind == "dva"
        port = self._port + 2 * (number - 1) if is_dva and self._port else 0
        address = self.network.join(id_of(kind, number), self._host, port)
        if is_dva and number == 1:
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
            to = ends[1].decode()
            source = ends[2].decode()
            if sent:
                self._senders.note(node, payload)
                listener.sent(now, node, to, payload)
                self._recorder.message_sent(now, node, to, len(payload), payload)
            else:
                self._recorder.message_taken(node, payload)
                listener.delivered(now, self._senders.sender(source, payload), node, payload)

        self.network.watcher = note

    def close(self) -> None:
        """Close all; what was sent last has a moment to leave."""
        self.network.close()
        if self.crossing is not None:
            self.packets = self.crossing.link.report()
            self.crossing.link.close()
