"""A robot over real sockets that 20 connections flood, while one person drives it.

They send rubbish, or valid messages over connections made anew each second, so that none is ever
left unread. Prints the round trips of the holder's commands and of emergencies, without and with
the flood. The robot takes 50 ms for a message by its profile, which is part of each round trip.
"""

from __future__ import annotations

import multiprocessing
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zmq
from helpers.processes.programs import Programs, all_gone_after

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.exchange import Outbox
from dva_sim.simulation.full.stage import DVA, id_of

ME, ROBOT = id_of("operator", 1), id_of("robot", 1)
COMMANDS, EMERGENCIES = 200, 40
RUBBISH = b"<msg><SimpleMsg><Rubbish>" + b"x" * 300 + b"</Rubbish></SimpleMsg></msg>"


class Client:
    """A person's device, as anybody may program one."""

    def __init__(self, context: zmq.Context[Any], dva: str) -> None:
        self._outbox, self._context = Outbox(ME, exact=True), context
        self._session = 0
        self._at: dict[str, zmq.Socket[Any]] = {DVA: self._connected(dva)}

    def _connected(self, address: str) -> zmq.Socket[Any]:
        made = self._context.socket(zmq.REQ)
        made.linger, made.rcvtimeo = 0, 20_000
        made.connect(f"tcp://{address}")
        return made

    def code(self, body: m.Body) -> int:
        """What the robot answers to its holder."""
        return self.ask(ROBOT, body).code

    def ask(self, to: str, body: m.Body, over: zmq.Socket[Any] | None = None) -> m.Reply:
        """The reply to a request."""
        session = 0 if to == DVA or isinstance(body, m.Emergency) else self._session
        asked = over or self._at[to]
        asked.send(self._outbox.encode(to, body, time.time() % 40_000, session))
        reply = decode(asked.recv()).body
        assert isinstance(reply, m.Reply)
        return reply

    def register(self) -> None:
        """Say that one is there."""
        assert self.ask(DVA, m.Registration("bench", "TeleOp", "127.0.0.1:5999")).code == m.OK

    def take(self) -> None:
        """Register, and take the robot."""
        self.register()
        for _ in range(200):
            reply = self.ask(DVA, m.PermissionRequest(ROBOT, "teleoperation"))
            if isinstance(reply.content, m.Permission) and reply.content.address:
                self._session = reply.content.session
                self._at[ROBOT] = self._connected(reply.content.address)
                self.urgent = self._connected(reply.content.address)
                self.address = reply.content.address
                return
            time.sleep(0.1)
        raise AssertionError("no permission")

    def start(self) -> None:
        """Begin to drive, once the robot knows."""
        while self.ask(ROBOT, m.StartTeleOp()).code != m.OK:
            time.sleep(0.2)


VALID: dict[str, m.Body] = {
    "GetSensorInfo": m.GetSensorInfo(),
    "StartTeleOp": m.StartTeleOp(),
    "EmergencyMsg": m.Emergency(),
}
FLOODS = [("nothing", 0), ("rubbish", 20_000), *((name, 500) for name in VALID)]


class Stranger:
    """One of those who flood."""

    def __init__(self, context: zmq.Context[Any], number: int, address: str, what: str) -> None:
        self._outbox, self._body = Outbox(f"02:00:00:0F:00:{number:02X}"), VALID.get(what)
        self._context, self._address = context, address
        self._socket: zmq.Socket[Any] | None = None
        self.connect()

    def connect(self) -> None:
        """Over a new connection."""
        if self._socket is not None:
            self._socket.close(0)
        self._socket = self._context.socket(zmq.DEALER)
        self._socket.linger = 0
        self._socket.connect(f"tcp://{self._address}")

    def send(self) -> bool:
        """Whether the robot reads as fast."""
        data = RUBBISH
        if self._body is not None:
            data = self._outbox.encode(ROBOT, self._body, time.time() % 40_000)
        assert self._socket is not None
        try:
            self._socket.send_multipart((b"", data), zmq.NOBLOCK)
        except zmq.Again:
            return False
        return True


def flood(address: str, what: str, rate: int, sent: Any, stop: Any) -> None:
    """Send from 20 connections until told to stop."""
    context: zmq.Context[Any] = zmq.Context()
    strangers = [Stranger(context, number, address, what) for number in range(20)]
    begun, count, renewed = time.monotonic(), 0, time.monotonic()
    while not stop.is_set():
        now = time.monotonic()
        if what in VALID and now > renewed + 1.0:
            renewed = now
            for stranger in strangers:
                stranger.connect()
        due = int((now - begun) * rate)
        sent.value += sum(strangers[number % 20].send() for number in range(count, due))
        count = max(due, count)
        time.sleep(0.001)
    context.destroy(0)


@contextmanager
def flooded(address: str, what: str, rate: int) -> Iterator[Any]:
    """While it comes."""
    spawn = multiprocessing.get_context("spawn")
    sent, stop = spawn.Value("q", 0, lock=False), spawn.Event()
    process = spawn.Process(target=flood, args=(address, what, rate, sent, stop), daemon=True)
    process.start()
    time.sleep(2.0 if rate else 0.0)
    try:
        yield sent
    finally:
        stop.set()
        process.join(10.0)
        process.kill()


def trips(client: Client, stopped: bool) -> tuple[list[float], list[float]]:
    """Round trips of commands at 10 Hz, and of emergencies [ms].

    Args:
        client: The holder.
        stopped: Emergencies come all the time, so that no command is obeyed.
    """
    commands, emergencies = [], []
    for number in range(COMMANDS):
        if number % 20 == 0:
            client.register()  # who is silent for ten seconds holds nothing any more
        begun = time.perf_counter()
        code = client.code(m.SetTeleOp(0.0, 0.01 * (number % 2)))
        assert code == m.OK or stopped
        commands.append((time.perf_counter() - begun) * 1000)
        time.sleep(max(0.0, 0.1 - (time.perf_counter() - begun)))
    for number in range(EMERGENCIES):
        if number % 10 == 0:
            client.register()
        begun = time.perf_counter()
        client.ask(ROBOT, m.Emergency(), client.urgent)
        emergencies.append((time.perf_counter() - begun) * 1000)
        time.sleep(0.05)
    return commands, emergencies


def free_port() -> int:
    """Of two free ones in a row, most likely."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    yield from all_gone_after(tmp_path)


def test_commands_and_emergencies_of_a_robot_that_is_flooded(programs):
    dva = f"127.0.0.1:{free_port()}"
    quiet = ("--set", "events=[{kind: fire, at_s: 5000}]", "--set", "horizon_s=6000")
    for part in ("dva", "world"):
        programs.start("live", "drive-to-event", "--only", part, "--dva", dva, *quiet)
    context: zmq.Context[Any] = zmq.Context()
    client = Client(context, dva)
    client.take()
    print(file=sys.stderr)
    for what, rate in FLOODS:
        client.start()
        with flooded(client.address, what, rate) as sent:
            before, begun = sent.value, time.monotonic()
            commands, emergencies = trips(client, stopped=what == "EmergencyMsg")
            arrived = (sent.value - before) / (time.monotonic() - begun)
        for which, times in (("commands", commands), ("emergencies", emergencies)):
            p50, p99 = np.percentile(times, (50, 99))
            told = f"{arrived:7.0f} {what} sent a second: {which:11} p50 {p50:5.1f}"
            print(f"{told} ms, p99 {p99:5.1f} ms, longest {max(times):5.1f} ms", file=sys.stderr)
        client.register()
    context.destroy(0)
    assert len(commands) == COMMANDS
