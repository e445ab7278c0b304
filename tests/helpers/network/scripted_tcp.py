"""A TCP connection over links whose every packet's fate is written down beforehand."""

from collections.abc import Callable, Iterable
from dataclasses import replace

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp import TcpConnection, TcpEndpoint, TcpOptions

EXACT = TcpOptions(tick=0.0)  # timers that ring when they are due


class ScriptedLink:
    """Each packet takes `delay` [s]; some are lost, some are late, by their number from 1 on."""

    def __init__(self, delay: float) -> None:
        self.delay = delay
        self.lost: set[int] = set()
        self.late: dict[int, float] = {}
        self.dead = False
        self.carried: list[tuple[float, int]] = []

    def carry(self, now: float, size: int) -> float | None:
        self.carried.append((round(now, 6), size))
        number = len(self.carried)
        if self.dead or number in self.lost:
            return None
        return now + self.delay + self.late.get(number, 0.0)

    def lose(self, *ahead: int) -> None:
        """Lose the next packet (1), the one after it (2), ..."""
        self.lost |= {len(self.carried) + number for number in ahead}

    def since(self, start: float) -> list[tuple[float, int]]:
        """Segments sent from `start` [s] on: time and size in bytes."""
        return [(at, size) for at, size in self.carried if at >= start]


class Pair:
    """An opener that writes and a peer that reads at once; open when made."""

    def __init__(
        self,
        delay: float = 0.05,
        opener: TcpOptions = EXACT,
        peer: TcpOptions = EXACT,
        reads: bool = True,
    ) -> None:
        self.clock = Clock()
        self.out, self.back = ScriptedLink(delay), ScriptedLink(delay)
        self.connection = TcpConnection(self.clock, self.out, self.back, opener, peer)
        self.opener, self.peer = self.connection.opener, self.connection.peer
        self.arrivals: list[tuple[float, int]] = []
        if reads:
            self.peer.on_readable = self.read
            self.opener.on_readable = lambda: self.opener.read(self.opener.readable)
        self.connection.open(lambda: None)
        self.clock.run(3 * delay + 0.001)

    def read(self) -> None:
        self.arrivals.append((round(self.clock.now, 6), self.peer.read(self.peer.readable)))

    def at(self, time: float, action: Callable[..., object], *args: object) -> None:
        self.clock.call_at(time, action, *args)

    def write_at(self, times: Iterable[float], size: int = 400) -> None:
        for time in times:
            self.clock.call_at(time, self.opener.write, size)

    def sent(self, start: float, longer: int = 60) -> list[float]:
        """Times of the opener's data segments from `start` [s] on."""
        return [at for at, size in self.out.since(start) if size > longer]


def options(**changes: object) -> TcpOptions:
    """Exact timers, and these changes."""
    return replace(EXACT, **changes)  # type: ignore[arg-type]


def keep_writing(end: TcpEndpoint, size: int = 65_536) -> None:
    """Write whenever there is room."""

    def fill() -> None:
        while end.write(size) == size:
            pass

    end.on_writable = fill
    fill()
