"""Real time: the same kernel, driven by the wall clock and real sockets.

Between two events the kernel waits in the ZeroMQ poller, so that a message is handled as
soon as it arrives. One thread does everything.
"""

from __future__ import annotations

import math
import selectors
import time
from collections.abc import Callable
from typing import Any, Final

import zmq
from typing_extensions import override

from dva_sim.kernel.clock import US, Clock

HEEDED_SLEEP: Final = 1.0  # shortest suspension of the machine that is reported [s]
LATE_EVENTS_PER_TURN = 500  # maximum late events before messages have their turn
MAX_WAIT = 60.0  # longest wait of one poll [s]

POLLIN: Final = int(zmq.POLLIN)  # pyzmq's enumerations cost more than a system call


Socket = zmq.Socket[bytes]


def has_more(socket: Socket) -> bool:
    """Return True if something can be read.

    To try in vain costs ten times as much, and the option `EVENTS` three times.
    """
    return bool(zmq.zmq_poll([(socket, POLLIN)], 0))


def slept() -> float:
    """Return for how long this machine has been suspended since it was started [s]."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) - time.clock_gettime(time.CLOCK_MONOTONIC)


class Poller:
    """Waits for sockets, at a cost that does not grow with those that have nothing to say.

    `zmq.Poller` asks every socket each time, so that a message among a thousand sockets costs a
    thousand questions. The file descriptor of a ZeroMQ socket says only that it should be asked:
    once asked it is quiet, whatever is left to read. So a socket is asked again for as long as
    it had something, unless all was read (`read_out`), and after everything else that may have
    asked it, as sending does (`look`).
    """

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._files: dict[Any, int] = {}
        self._sockets: set[Socket] = set()
        self._ask: dict[Socket, None] = {}

    def register(self, source: Any) -> None:
        """Begin to wait for a socket of ZeroMQ, or for a file descriptor."""
        file = source
        if isinstance(source, zmq.Socket):
            file = int(source.getsockopt(zmq.FD))
            self._sockets.add(source)
        self._selector.register(file, selectors.EVENT_READ, source)
        self._files[source] = file
        self.look(source)

    def unregister(self, source: Any) -> None:
        """Stop waiting for a socket, before it is closed."""
        self._selector.unregister(self._files.pop(source))
        self._sockets.discard(source)
        self._ask.pop(source, None)

    def look(self, source: Any) -> None:
        """Ask a registered socket again, since it was used by others."""
        if source in self._sockets:
            self._ask[source] = None

    def has_more(self, source: Socket) -> bool:
        """Return True if a socket has something to read; otherwise its file will signal it."""
        more = has_more(source)
        if not more:
            self.read_out(source)
        return more

    def read_out(self, source: Socket) -> None:
        """Note that a socket has nothing to read until its file signals."""
        self._ask.pop(source, None)

    def poll(self, wait: float) -> list[Any]:
        """Return the sources that have something to read, after at most `wait` [s]; maybe none."""
        ready = {socket: None for socket in self._ask if has_more(socket)} if self._ask else {}
        waiting: list[Any] = []
        for key, _ in self._selector.select(0.0 if ready else wait):
            source = key.data
            if source not in self._sockets:
                waiting.append(source)
            elif source not in ready and has_more(source):
                ready[source] = None
        self._ask = ready
        return [*ready, *waiting]

    def close(self) -> None:
        """Release the system's resources."""
        self._selector.close()


class LiveClock(Clock):
    """A clock that follows the wall clock; see `Clock`.

    Times are seconds since `epoch`, taken from a clock that never steps back.

    Args:
        epoch: The run's start by `time.monotonic` [s]; processes of a machine that share it share
            their time. Default: now.

    Attributes:
        lateness: The longest that an event had to wait [s].
    """

    def __init__(self, epoch: float | None = None) -> None:
        super().__init__()
        elapsed = 0.0 if epoch is None else time.monotonic() - epoch
        self._origin = time.monotonic_ns() // 1000 - round(elapsed * US)
        self._poller = Poller()
        self._handlers: dict[Any, Callable[[], object]] = {}
        self._running = False
        self._slept = slept()
        self._on_suspended = list[Callable[[float], object]]()
        self.lateness = 0.0
        self._catch_up(math.inf)

    def watch(self, source: Any, handler: Callable[[], object]) -> None:
        """Call `handler()` whenever a socket or file descriptor has something to read."""
        if source not in self._handlers:
            self._poller.register(source)
        self._handlers[source] = handler

    @override
    def on_suspended(self, handler: Callable[[float], object]) -> None:
        self._on_suspended.append(handler)

    def _look_for_sleep(self) -> None:
        """Report a suspension before anything is read that arrived or waited meanwhile.

        This clock stood still like all others, so that what is old would count as new.
        """
        gap = slept() - self._slept
        if gap >= HEEDED_SLEEP:
            self._slept += gap
            for handler in self._on_suspended:
                handler(gap)

    def unwatch(self, source: Any) -> None:
        """Stop watching it."""
        if self._handlers.pop(source, None) is not None:
            self._poller.unregister(source)

    def look(self, source: Any) -> None:
        """Look at a socket that was used: what it has to read may be told by nothing else."""
        self._poller.look(source)

    def has_more(self, source: Socket) -> bool:
        """Return True if a watched socket has something to read."""
        return self._poller.has_more(source)

    def read_out(self, source: Socket) -> None:
        """Note that a watched socket has no more to read until its file says so."""
        self._poller.read_out(source)

    def stop(self) -> None:
        """Let `run` return after what is being done now."""
        self._running = False

    def run(self, until: float = math.inf) -> None:
        """Run until a time [s], or until `stop` is called; messages are read even when behind."""
        self._running = True
        end = math.inf if math.isinf(until) else round(until * US)
        self._catch_up(end)
        while self._running:
            self._wait(end)
            if self._now_us >= end:
                break
        self._running = False

    def _wait(self, end: float) -> None:
        """Wait for the next event or message; events that are due by then go first."""
        due = min(self.env.peek(), end)
        wait = (due - self._real()) / US
        wait = 0.0 if wait < 0.0 else wait if wait < MAX_WAIT else MAX_WAIT
        ready = self._poller.poll(wait)
        self._look_for_sleep()
        self._catch_up(end)
        for source in ready:
            handler = self._handlers.get(source)
            if handler is not None:  # nobody unwatched it since
                handler()
        if self.env.peek() <= self._now_us:
            self._catch_up(end)

    def _catch_up(self, end: float) -> None:
        """Process the events that are due, in order, then advance to the current time."""
        env = self.env
        real = self._real()
        until = real if real < end else end
        for _ in range(LATE_EVENTS_PER_TURN):
            due = env.peek()
            if due > until:
                break
            self.lateness = max(self.lateness, (real - due) / US)
            self.step()
            if not self._running:
                return
        # Never beyond the next event, whose own step would turn time back.
        until = min(env.peek(), until)
        if until > self._now_us:
            self._set(int(until))

    def _real(self) -> int:
        return time.monotonic_ns() // 1000 - self._origin


class ProgramClock(LiveClock):
    """Real time by `time.monotonic`, for programs whose times are measured.

    What is late happens when it does happen, not when it was due. The kernel's waits end before the
    next event: they count whole milliseconds.

    Args:
        serve: Does what is pending until a time [s], or for a shorter while; by default it waits
            for the sockets that are watched.
    """

    def __init__(self, serve: Callable[[float], object] | None = None) -> None:
        super().__init__(epoch=0.0)
        self._serve = serve or self._poll

    @override
    def step(self) -> None:
        self._set(max(self._now_us, self._real()))
        self.env.step()

    @override
    def _wait(self, end: float) -> None:
        self._serve(min(self.env.peek(), end) / US)
        self._catch_up(end)

    def _poll(self, until: float) -> None:
        ready = self._poller.poll(max(0.0, until - time.monotonic() - 0.001))
        self._set(max(self._now_us, self._real()))
        for source in ready:
            handler = self._handlers.get(source)
            if handler is not None:
                handler()


MAX_BEHIND = 1.0  # longest lag that a paced clock makes up for; more is given up [s]
HEEDED = 0.02  # an event less late than this is in time [s]
FASTEST = 20.0  # maximum speed of a paced clock, as a multiple of real time


class PacedClock(LiveClock):
    """Virtual time at the pace of the wall clock, or a multiple of it, which can be halted.

    A callback that takes too long makes it lag; it then runs after the wall clock, event by event
    and in order, and what it lags by more than `MAX_BEHIND` is given up for good.

    Args:
        factor: Virtual seconds per real second.

    Attributes:
        on_late: Callback with the lateness of an event in real time [s], if more than `HEEDED`.
        given_up: Real time that was never made up for, in all [s].
    """

    def __init__(self, factor: float = 1.0) -> None:
        self._factor = factor
        self._halted = False
        self._base = 0
        self._since = time.monotonic_ns() // 1000
        self._pulses: list[_Pulse] = []
        self.on_late: Callable[[float], object] = lambda _: None
        self.given_up = 0.0
        self._worst = 0.0
        super().__init__()

    @property
    def factor(self) -> float:
        """Virtual seconds per real second."""
        return self._factor

    @property
    def paused(self) -> bool:
        """True if virtual time is paused."""
        return self._halted

    def pace(self, factor: float | None = None, paused: bool | None = None) -> None:
        """Change the speed from now on, halt, or resume."""
        self._rebase(self._real())
        self._factor = self._factor if factor is None else factor
        self._halted = self._halted if paused is None else paused

    def go(self) -> None:
        """Resume virtual time from where it is, whatever real time has passed."""
        self._rebase(int(self._now_us))
        self._worst = 0.0

    def worst_lag(self) -> float:
        """Return the greatest lateness of an event since the last call [s]."""
        worst = self._worst
        self._worst = 0.0
        return worst

    def pulse(self, period: float, action: Callable[[], object]) -> None:
        """Run `action()` each `period` of real time [s], also while virtual time stands.

        Pulses missed during a long callback are left out.
        """
        self._pulses.append(_Pulse(period, action))

    def _rebase(self, virtual: int) -> None:
        self._base = virtual
        self._since = time.monotonic_ns() // 1000

    def _real(self) -> int:
        if self._halted:
            return self._base
        return self._base + round((time.monotonic_ns() // 1000 - self._since) * self._factor)

    @override
    def _wait(self, end: float) -> None:
        # Pulses have their turn between events and messages.
        wait = MAX_WAIT
        if not self._halted:
            wait = (min(self.env.peek(), end) - self._real()) / US / self._factor
        if self._pulses:
            wait = min(wait, min(pulse.due for pulse in self._pulses) - time.monotonic())
        ready = self._poller.poll(max(0.0, min(MAX_WAIT, wait)))
        self._look_for_sleep()
        self._catch_up(end)
        for pulse in self._pulses:
            pulse.beat(time.monotonic())
        for source in ready:
            handler = self._handlers.get(source)
            if handler is not None:
                handler()

    @override
    def _catch_up(self, end: float) -> None:
        # Those who watch the lag are notified before late events happen.
        env = self.env
        for _ in range(LATE_EVENTS_PER_TURN):
            due = env.peek()
            if due > min(self._real(), end):
                break
            self._look_behind(int(due))
            self.step()
            if not self._running:
                return
        self._set(int(max(self._now_us, min(self._real(), end, env.peek()))))

    def _look_behind(self, due: int) -> None:
        """Note how late an event comes that was due at a time."""
        behind = (self._real() - due) / US / self._factor
        if behind > self._worst:
            self._worst = behind
        if behind > HEEDED:
            self.on_late(behind)
        if behind > MAX_BEHIND:
            self.given_up += behind - MAX_BEHIND
            self._rebase(int(due + MAX_BEHIND * self._factor * US))


class _Pulse:
    """Action repeated by the wall clock."""

    def __init__(self, period: float, action: Callable[[], object]) -> None:
        self._period = period
        self._action = action
        self.due = time.monotonic()

    def beat(self, now: float) -> None:
        """Run the action if it is due."""
        if now >= self.due:
            missed = (now - self.due) // self._period
            self.due += (missed + 1.0) * self._period
            self._action()
