"""What a command to a robot costs over sockets, against a bare echo of the same size.

python tests/benchmarks/echo.py compare
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import zmq

from dva_sim.agents.device import AgentDevice
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.stage import DVA, Stage, id_of

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
    message = m.Message(ROBOT, 1, DVA, "12:00:00", SESSION, grant)
    assert robot.controller.handle(message, 0.0, 0.0, False).code == m.OK
    network.clock.watch(sys.stdin.fileno(), network.clock.stop)
    print(network.address(ROBOT), flush=True)
    network.clock.run()


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
    tests = {"PYTHONPATH": str(Path(__file__).parents[1])}
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


def compare() -> None:
    """Tell what both take, and the ratio.

    Goal: 1.6. A loop that polls, with a ROUTER that does nothing, comes to that by itself; the rest
    is the code that runs at both ends, each time after a sleep in which it has left the caches.
    """
    with (
        start("robot") as robot,
        start("echo") as address,
        zmq.Context() as context,
        context.socket(zmq.REQ) as socket,
    ):
        socket.linger = 0
        socket.connect(f"tcp://{address}")
        phone = Phone(robot)
        try:
            phone.begin()
            data = phone.message()
            ours, bare = in_turns(phone, socket, data)
        finally:
            phone.network.close()
    command, echoed = statistics.median(ours), statistics.median(bare)
    print(
        f"a live command over an echo of {len(data)} bytes: {command / echoed:.2f} "
        f"({command * 1e6:.0f} us over {echoed * 1e6:.0f} us, by the clock)"
    )


def in_turns(
    phone: Phone, socket: zmq.Socket[bytes], data: bytes
) -> tuple[list[float], list[float]]:
    """How long each command and each echo took [s]."""
    ours, bare = list[float](), list[float]()
    phone.drive(ROUND_TRIPS)  # connections are open, caches warm
    echo(socket, data, ROUND_TRIPS)
    for _ in range(BLOCKS):
        ours += phone.drive(ROUND_TRIPS)
        bare += echo(socket, data, ROUND_TRIPS)
    return ours, bare


if __name__ == "__main__":
    {"robot": be_a_robot, "echo": be_an_echo, "compare": compare}[sys.argv[1]]()
