"""Cost of a command over sockets, against the floor and a bare echo of the same size.

The floor is what any REQ and ROUTER in Python take that write and validate each message by our
codec, and do nothing else: no robot, no clock, no second connection.

python tests/benchmarks/echo.py compare
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import zmq
from helpers.dva.permissions import give
from helpers.paths import TESTS

from dva_sim.agents.device import AgentDevice
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.exchange import Outbox
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.stage import Stage, id_of

ROBOT, OPERATOR = id_of("robot", 1), id_of("operator", 1)
SESSION = 1425
BLOCKS, ROUND_TRIPS = 30, 200  # in turns, so that noise hits both
TICK = 86_320  # [ms]
COMMAND = m.SetTeleOp(0.1, 0.05, TICK)
SETTINGS = {"robot.processing_s": 0, "robot.watchdog_s": 60, "robot.max_age_s": 120}


def stage(network: SocketNetwork) -> Stage:
    scenario = scenarios.build(scenarios.load("drive-to-event"), SETTINGS)
    join = lambda kind, number: network.join(id_of(kind, number))  # noqa: E731
    return Stage(scenario, 1, network, Recorder(), join)


# --- the other process ---------------------------------------------------------------------


def be_a_robot() -> None:
    """A robot as in any run, whom an operator may drive."""
    network = SocketNetwork(LiveClock())
    field = Field(stage(network))
    field.populate()
    robot = field.robots[ROBOT]
    robot.controller.clock_offset = TICK / 1000  # so that the command's tick is never to come
    grant = m.PermissionGrant(OPERATOR, "teleoperation", SESSION)
    assert give(robot.controller, grant).code == m.OK
    network.clock.watch(sys.stdin.fileno(), network.clock.stop)
    print(network.address(ROBOT), flush=True)
    network.clock.run()


def be_the_floor() -> None:
    """A ROUTER that reads and validates each command, and says yes."""
    router, outbox = zmq.Context.instance().socket(zmq.ROUTER), Outbox(ROBOT)
    port = router.bind_to_random_port("tcp://127.0.0.1")
    print(f"127.0.0.1:{port}", flush=True)
    while True:
        *route, data = router.recv_multipart()
        command = decode(data)
        reply = m.Reply(command.message_id, m.OK, "")
        router.send_multipart([*route, outbox.encode(command.source, reply, 0.0, SESSION)])


def be_an_echo() -> None:
    """Nothing but pyzmq."""
    socket = zmq.Context.instance().socket(zmq.REP)
    port = socket.bind_to_random_port("tcp://127.0.0.1")
    print(f"127.0.0.1:{port}", flush=True)
    while (data := socket.recv()) != b"end":
        socket.send(data)


@contextmanager
def start(role: str) -> Iterator[str]:
    """The address of another process, which ends when this one is done with it."""
    command = [sys.executable, __file__, role]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    tests = {"PYTHONPATH": str(TESTS)}
    with subprocess.Popen(command, env=os.environ | tests, **pipes) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().decode().strip()
        finally:
            process.kill()


# --- this process --------------------------------------------------------------------------


class Phone:
    """An operator's end: encodes a command, decodes and validates the reply."""

    def __init__(self, robot: str) -> None:
        self.network = SocketNetwork(LiveClock())
        self.network.introduce(ROBOT, robot)
        self._device: AgentDevice = stage(self.network).device("operator", 1)
        self._left, self.times = 0, list[float]()
        self._began = 0.0

    def begin(self) -> None:
        """Start to drive."""
        replies: list[m.Reply] = []

        def answered(reply: m.Reply) -> None:
            replies.append(reply)
            self.network.clock.stop()

        self._device.ask(ROBOT, m.StartTeleOp(), answered, session=SESSION)
        self.network.clock.run()
        assert [reply.code for reply in replies] == [m.OK]

    def drive(self, commands: int) -> list[float]:
        """Send commands, each as soon as the last one is answered: how long each took [s]."""
        self._left, self.times = commands, []
        self._ask()
        self.network.clock.run()
        return self.times

    def _ask(self) -> None:
        self._began = time.perf_counter()
        self._device.ask(ROBOT, COMMAND, self._answered, session=SESSION)

    def _answered(self, reply: m.Reply) -> None:
        self.times.append(time.perf_counter() - self._began)
        assert reply.code == m.OK
        self._left -= 1
        if self._left:
            self._ask()
        else:
            self.network.clock.stop()

    def message(self) -> bytes:
        return self._device.outbox.encode(ROBOT, COMMAND, self.network.clock.now, SESSION)


def echo(socket: zmq.Socket[bytes], data: bytes, count: int) -> list[float]:
    times = []
    for _ in range(count):
        began = time.perf_counter()
        socket.send(data)
        assert len(socket.recv()) == len(data)
        times.append(time.perf_counter() - began)
    return times


def floor(socket: zmq.Socket[bytes], count: int) -> list[float]:
    outbox, times = Outbox(OPERATOR), []
    for _ in range(count):
        began = time.perf_counter()
        socket.send(outbox.encode(ROBOT, COMMAND, 0.0, SESSION))
        reply = decode(socket.recv()).body
        times.append(time.perf_counter() - began)
        assert isinstance(reply, m.Reply)
        assert reply.code == m.OK
    return times


@contextmanager
def connected(address: str) -> Iterator[zmq.Socket[bytes]]:
    """A REQ socket to an address."""
    with zmq.Context() as context, context.socket(zmq.REQ) as socket:
        socket.linger = 0
        socket.connect(f"tcp://{address}")
        yield socket


def compare() -> None:
    """Tell what each takes, and the ratios.

    Goal: 1.3 times the floor; Waiting at both ends in a poller,
    which serves all sockets and the next event, makes 1.2 of it by itself. The rest is what the
    floor leaves out: a time-out for each request, repetitions known by what they say, and a robot
    that looks who asks, queues, decides and moves, each time after a sleep in which it has left
    the caches.
    """
    with (
        start("robot") as robot,
        start("floor") as lowest,
        start("echo") as plain,
        connected(lowest) as floor_socket,
        connected(plain) as echo_socket,
    ):
        phone = Phone(robot)
        try:
            phone.begin()
            data = phone.message()
            kinds = (
                phone.drive,
                lambda count: floor(floor_socket, count),
                lambda count: echo(echo_socket, data, count),
            )
            command, least, echoed = in_turns(kinds)
        finally:
            phone.network.close()
    print(
        f"a live command over the floor: {command / least:.2f}, and over an echo of {len(data)} "
        f"bytes: {command / echoed:.2f} ({command * 1e6:.0f}, {least * 1e6:.0f} and "
        f"{echoed * 1e6:.0f} us, by the clock)"
    )


def in_turns(kinds: Sequence[Callable[[int], list[float]]]) -> list[float]:
    """Median time of each kind of round trip [s]; in turns, so that noise hits all."""
    times = [list[float]() for _ in kinds]
    for _ in range(1 + BLOCKS):  # the first time connections open and caches fill
        for kind, taken in zip(kinds, times, strict=True):
            taken += kind(ROUND_TRIPS)
    return [statistics.median(taken[ROUND_TRIPS:]) for taken in times]


if __name__ == "__main__":
    roles = {"robot": be_a_robot, "floor": be_the_floor, "echo": be_an_echo, "compare": compare}
    roles[sys.argv[1]]()
