"""A robot that is off until somebody registers it at a DVA, and then opens its port."""

from __future__ import annotations

import socket
from collections.abc import Callable
from contextlib import closing

from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.console.asking.refusal import Refused
from dva_sim.console.wire.rows import StationShown
from dva_sim.network.real_network import NetworkError, RealNetwork
from dva_sim.network.sockets import PORT_TRIES
from dva_sim.protocol import messages as m

Then = Callable[[bool, str], object]
OFF_STATE = "off"
REGISTERED = "registered"
LISTENING = "listening"


class OwnStation:
    """Takes one robot from off to registered, and to listening.

    The address that it registers is known before its port is open, as the order wants it: until
    then nobody reaches it.

    Args:
        network: Its sockets.
        host: Address to listen on.
        port: Port for requests; publications have the next one. 0: any two free ones.

    Attributes:
        state: `off`, `registered` or `listening`.
        dva: Address of its latest or next registration.
        deaf: Callback when it stops or starts hearing.
    """

    def __init__(self, robot: RobotAgent, network: RealNetwork, host: str, port: int) -> None:
        self._robot = robot
        self._network = network
        self._host = host
        self._port = port
        self.state = OFF_STATE
        self.dva = ""
        self.deaf: Callable[[bool], object] = lambda _: None
        self._problem = ""
        self._asking = False
        self._begun = False
        robot.device.silent = True
        robot.device.address = self._own_address()

    def line(self) -> StationShown:
        """Implement `RobotStation`."""
        return {
            "state": self.state,
            "address": self._robot.device.address,
            "dva": self.dva or None,
            "problem": self._problem,
            "asking": self._asking,
            "by_hand": True,
        }

    def register(self, dva: str, then: Then) -> None:
        """Ask a DVA at `HOST:PORT` to take the robot in.

        Raises:
            Refused: it is registered, or being registered.
        """
        device = self._robot.device
        if self.state != OFF_STATE or self._asking:
            raise Refused(f"it is {'asking already' if self._asking else self.state}")
        self.dva = dva
        self._asking = True
        self._problem = ""
        self._network.introduce(device.dva, dva)
        device.look_for_dva_at(dva)
        device.come_back()
        device.register_once(
            lambda reply: self._answered(reply, then), lambda: self._unanswered(then)
        )

    def _answered(self, reply: m.Reply, then: Then) -> None:
        if not self._asking:
            then(False, "it was switched off meanwhile")
            return
        self._asking = False
        if reply.code != m.OK:
            why = self._robot.device.why_refused(reply)
            self._fail(f"{self.dva}: {m.CODE_NAMES.get(reply.code, reply.code)}: {why}")
            then(False, self._problem)
            return
        self.state = REGISTERED
        self._robot.device.tell(f"is registered at {self.dva}", "link")
        then(True, f"registered at {self.dva}")

    def _unanswered(self, then: Then) -> None:
        device = self._robot.device
        if self._asking:
            self._asking = False
            waited = device.attempts * device.timeout
            self._fail(f"no DVA answers at {self.dva} within {waited:g} s")
        then(False, self._problem or "it was switched off meanwhile")

    def _fail(self, problem: str) -> None:
        self._problem = problem
        self._robot.device.leave()

    def listen(self) -> None:
        """Open the port that was registered.

        Raises:
            Refused: it is not registered, or listens already, or the port is taken.
        """
        if self.state != REGISTERED:
            raise Refused(f"The robot is {self.state}. It must be registered first.")
        device = self._robot.device
        host, _, port = device.address.rpartition(":")
        try:
            self._network.join(device.id_tag, host, int(port))
        except NetworkError as error:
            self._problem = f"{error}; switch it off and register it again"
            raise Refused(self._problem) from None
        self.state = LISTENING
        self._problem = ""
        device.tell(f"listens on {device.address}", "link")
        self.deaf(False)
        if not self._begun:
            self._begun = True
            self._robot.start()

    def switch_off(self) -> None:
        """Close the port and say nothing more: the DVA finds out as of any silent device."""
        device = self._robot.device
        if self.state == LISTENING:
            self.deaf(True)
            self._network.leave(device.id_tag)
        self._robot.hang()
        device.leave()
        device.tell("is switched off", "link")
        self.state = OFF_STATE
        self._asking = False
        self._problem = ""
        if not self._port:
            device.address = self._own_address()

    def _own_address(self) -> str:
        return f"{self._host}:{self._port or two_free_ports(self._host)}"


def two_free_ports(host: str) -> int:
    """Return the first of two ports in a row that are free now.

    Raises:
        NetworkError: there are none, or the host is not this machine.
    """
    problem: Exception = OSError("no two free ports in a row")
    for _ in range(PORT_TRIES):
        with closing(socket.socket()) as first, closing(socket.socket()) as second:
            try:
                first.bind((host, 0))
                port = int(first.getsockname()[1])
                second.bind((host, port + 1))
            except OverflowError:
                continue
            except OSError as error:
                problem = error
                continue
            return port
    raise NetworkError(f"cannot listen on {host}: {problem}")
