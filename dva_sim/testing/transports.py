"""Checks of transports, with both ends in this process, over the loopback."""

from __future__ import annotations

import socket
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.middleware import (
    CommandTransport,
    Rendezvous,
    TransportEnd,
    TransportError,
    load_transport,
)
from dva_sim.network.middleware.programs import TELE_OP
from dva_sim.testing.promises import Case, Outcome, broken_in, kept, part_by_part

COMMANDS: Final = 20
PICTURES: Final = (8, 2_000, 30_000)  # sizes of the pictures that are sent [B]
STEP: Final = 0.02  # interval between two messages [s]
CONNECTS_S: Final = 10.0
ARRIVES_S: Final = 5.0
ALONE_S: Final = 0.5  # time for which the operator's end waits for a missing robot
SLACK_S: Final = 2.0  # tolerance for a busy machine
LOST_COMMANDS: Final = 100  # commands sent while the robot takes none

CONNECTS: Final = "connects although the robot's end opens later"
CARRIES: Final = "delivers the commands that it took, byte for byte"
SHOWS: Final = "delivers pictures, byte for byte"
RETURNS: Final = "returns from serve() in time"
GOES_ON: Final = "returns from send() while the robot takes nothing"
NO_PEER_PROMISE: Final = "raises TransportError in time where nobody is at the other end"
LEAVES: Final = "lets go of its ports when it is closed"


def check_transport(
    transport: str | Callable[..., CommandTransport], options: Mapping[str, Any] | None = None
) -> Outcome:
    """See that a transport keeps what every transport promises.

    Args:
        transport: Name, as in a scenario, or its class.
        options: Keyword arguments of its constructor.

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is none of that name, it cannot be made with these options, or what it
            needs is not installed.
    """
    make = load_transport(transport, options)
    if missing := make().lacks():
        raise ConfigError(missing)
    trial = _Trial(make)
    return kept(broken_in(part_by_part(trial.parts)), (), trial.count, trial.slowest)


class _Trial:
    """Both ends, the robot's in a thread of its own.

    Attributes:
        count: Messages that were sent.
        slowest: The longest that one took to arrive [s].
    """

    def __init__(self, make: Callable[[], CommandTransport]) -> None:
        self._make = make
        self._port = _free_ports()
        self.count = 0
        self.slowest = 0.0
        self.parts = (self._carry, self._carry, self._stay_away, self._be_alone)

    def _carry(self) -> Iterator[Case]:
        """Yield commands and pictures; the second time on the ports of the first."""
        with _Robot(self._make, self._port) as robot:
            received: list[bytes] = []
            try:
                near = self._make().near(robot.place, received.append)
            except TransportError as error:
                yield (CONNECTS if not self.count else LEAVES), str(error)
                return
            if robot.problem:
                yield (CONNECTS if not self.count else LEAVES), robot.problem
            yield from self._commands(near, robot)
            if self._make().carries_pictures:
                sent = [bytes([number]) * size for number, size in enumerate(PICTURES, 1)]
                robot.pictures.extend(sent)
                yield from self._arrived(SHOWS, sent, received, near)
            near.close()

    def _commands(self, near: TransportEnd, robot: _Robot) -> Iterator[Case]:
        taken: list[bytes] = []
        for number in range(1, COMMANDS + 1):
            if near.send(TELE_OP.command(number)):
                taken.append(TELE_OP.command(number))
            if late := list(_served(near)):
                yield from late
                return
        if not taken:
            yield CARRIES, f"none of {COMMANDS} was taken"
        yield from self._arrived(CARRIES, taken, robot.heard, near)

    def _arrived(
        self, promise: str, sent: list[bytes], received: list[bytes], near: TransportEnd
    ) -> Iterator[Case]:
        """Wait for the last one: those before it may have been given up for it."""
        start = time.monotonic()
        while sent and sent[-1] not in received and time.monotonic() < start + ARRIVES_S:
            yield from _served(near)
        self.count += len(sent)
        self.slowest = max(self.slowest, time.monotonic() - start)
        if sent and sent[-1] not in received:
            yield promise, f"the last of {len(sent)} did not come within {ARRIVES_S:g} s"
        if strangers := [data for data in received if data not in sent]:
            yield promise, f"{strangers[0][:40]!r} was not sent"

    def _stay_away(self) -> Iterator[Case]:
        """Yield cases in which the robot's end takes nothing for a while."""
        with _Robot(self._make, self._port) as robot:
            near = self._make().near(robot.place, lambda _: None)
            robot.pause()
            start = time.monotonic()
            for number in range(1, LOST_COMMANDS + 1):
                near.send(TELE_OP.command(number))
            took = time.monotonic() - start
            robot.go_on()
            near.close()
        if took > SLACK_S:
            yield (
                GOES_ON,
                f"{LOST_COMMANDS} commands took {took:.1f} s; should be below {SLACK_S:g} s",
            )

    def _be_alone(self) -> Iterator[Case]:
        start = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            place = Rendezvous("127.0.0.1", "127.0.0.1", self._port, Path(folder), start + ALONE_S)
            try:
                self._make().near(place, lambda _: None).close()
            except TransportError:
                if (took := time.monotonic() - start - ALONE_S) > SLACK_S:
                    yield NO_PEER_PROMISE, f"{took:.1f} s too late"
            else:
                yield NO_PEER_PROMISE, "it says that it is connected"


class _Robot:
    """The robot's end in a thread of its own: keeps received commands, sends given pictures."""

    def __init__(self, make: Callable[[], CommandTransport], port: int) -> None:
        self._make = make
        self._folder = tempfile.TemporaryDirectory()
        by = time.monotonic() + CONNECTS_S
        self.place = Rendezvous("127.0.0.1", "127.0.0.1", port, Path(self._folder.name), by)
        self.heard: list[bytes] = []
        self.pictures: list[bytes] = []
        self.problem = ""
        self._over = threading.Event()
        self._paused = threading.Event()
        self._is_paused = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> _Robot:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._paused.clear()
        self._thread.join(SLACK_S + ARRIVES_S)
        self._folder.cleanup()

    def pause(self) -> None:
        """Take nothing more for now."""
        self._paused.set()
        self._is_paused.wait(SLACK_S)

    def go_on(self) -> None:
        """Resume, and take all data received meanwhile."""
        self._paused.clear()

    def _hear(self, data: bytes) -> bytes:
        self.heard.append(data)
        return b"obeyed"

    def _run(self) -> None:
        time.sleep(STEP)  # the operator's end is there first
        try:
            end = self._make().far(self.place, self._hear)
        except (TransportError, OSError) as error:
            self.problem = str(error)
            return
        while not self._over.is_set():
            if self._paused.is_set():
                self._is_paused.set()
                time.sleep(STEP)
                continue
            end.serve(time.monotonic() + STEP)
            if self.pictures and end.send(self.pictures[0]):
                self.pictures.pop(0)
        end.close()


def _served(near: TransportEnd) -> Iterable[Case]:
    until = time.monotonic() + STEP
    while time.monotonic() < until:
        near.serve(until)
    if (late := time.monotonic() - until) > SLACK_S:
        return [(RETURNS, f"{late:.1f} s too late")]
    return []


def _free_ports() -> int:
    """Return the first of three free ports in a row, as far as a look can tell."""
    while True:
        with _bound(0) as port:
            try:
                with _bound(port + 1), _bound(port + 2):
                    return port
            except OSError:
                continue


@contextmanager
def _bound(port: int) -> Iterator[int]:
    with socket.socket() as tried:
        tried.bind(("127.0.0.1", port))
        yield int(tried.getsockname()[1])
