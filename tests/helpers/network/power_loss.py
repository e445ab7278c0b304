"""A robot on a machine of its own that loses its power: a program for a network namespace.

Its connections end without a word to the other side. That takes two network stacks, each a
namespace, with a bridge between them that stays.
"""

import json
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from helpers.processes.patience import PATIENCE_S, becomes

from dva_sim.network.messaging import Requester
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork

HOST, PORT = "10.9.0.2", 5600
PERIOD_S = 0.1


def serve_as_robot() -> None:
    """Answer each request, and publish."""
    clock = LiveClock()
    network = SocketNetwork(clock)
    network.join("robot", HOST, PORT)
    network.serve("robot", lambda request: request.answer(b"heard"))
    clock.every(PERIOD_S, lambda: network.publish("robot", "status|", b"here", 4) or True)
    clock.run(clock.now + PATIENCE_S)


def ip(*words: str) -> None:
    subprocess.run(["ip", *" ".join(words).split()], check=True)


def has_connections() -> bool:
    """True if any connection of this network stack passes for established."""
    rows = Path("/proc/net/tcp").read_text().splitlines()[1:]
    return any(row.split()[3] == "01" for row in rows)


class Machine:
    """A machine that has its power, and on which no robot's program runs yet."""

    def __init__(self) -> None:
        own = Path("/proc/self/ns/net").readlink()
        self._stack = subprocess.Popen(["unshare", "--net", "sleep", str(PATIENCE_S)])
        pid = str(self._stack.pid)
        self._inside = f"nsenter --target {pid} --net".split()
        self._programs = [self._stack]
        assert becomes(lambda: Path(f"/proc/{pid}/ns/net").readlink() != own)
        ip("link add cable type veth peer name port address 02:00:00:00:00:02 netns", pid)
        ip("link set cable master bridge up")
        for words in (f"addr add {HOST}/24 dev port", "link set port up", "link set lo up"):
            subprocess.run([*self._inside, "ip", *words.split()], check=True)

    def run_robot(self) -> None:
        robot = [*self._inside, sys.executable, __file__, "robot"]
        self._programs.append(subprocess.Popen(robot))

    def lose_power(self) -> None:
        ip("link set cable down")  # before anything can say goodbye
        for process in self._programs:
            process.kill()
            process.wait()
        with suppress(subprocess.CalledProcessError):
            ip("link del cable")  # unless it disappeared with the machine


class Operator:
    """Listens to the robot, and asks it."""

    def __init__(self) -> None:
        self._clock = LiveClock()
        self._network = SocketNetwork(self._clock)
        self._network.introduce("robot", f"{HOST}:{PORT}")
        self._requester = Requester(self._network, "operator", "robot", timeout=PATIENCE_S)
        self._requester.open()
        self._heard = self._answers = 0
        self._network.subscribe("operator", "robot", "status|", self._hear)

    def gives_up_connections(self) -> bool:
        """True once no dead connection passes for established."""
        return self._lives_until(lambda: not has_connections())

    def hears(self) -> bool:
        """True once something more was published."""
        before = self._heard
        return self._lives_until(lambda: self._heard > before)

    def is_answered(self) -> bool:
        """True if a request is answered without being sent a second time."""
        before = self._answers
        self._requester.request(b"stop", self._answer)
        return self._lives_until(lambda: self._answers > before) and not self._requester.timeouts

    def close(self) -> None:
        self._requester.close()
        self._network.close()

    def _lives_until(self, true) -> bool:
        def lives() -> bool:
            self._clock.run(self._clock.now + PERIOD_S)
            return true()

        return becomes(lives)

    def _hear(self, _: bytes) -> None:
        self._heard += 1

    def _answer(self, _: bytes) -> None:
        self._answers += 1


def main() -> None:
    """Print whether the operator heard the robot and was answered, before and after."""
    ip("link set lo up")
    ip("link add bridge type bridge")
    ip("addr add 10.9.0.1/24 dev bridge")
    ip("link set bridge up")
    machine, operator = Machine(), Operator()
    found = []
    try:
        machine.run_robot()
        found += [operator.hears(), operator.is_answered()]
        machine.lose_power()
        machine = Machine()
        found += [operator.gives_up_connections()]  # sooner than a program starts
        machine.run_robot()
        found += [operator.hears(), operator.is_answered()]
    finally:
        operator.close()
        machine.lose_power()
    print(json.dumps(found))


if __name__ == "__main__":
    serve_as_robot() if "robot" in sys.argv else main()
