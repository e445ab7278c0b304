"""A console's world with a rosbridge server, and clients of it that are not ours."""

import contextlib
import json
import threading

from helpers.processes.patience import Patient
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
from websockets.sync.client import connect

from dva_sim.console.world.world import ConsoleWorld
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.network.realtime import PacedClock
from dva_sim.ros.gateway import RosGateway
from dva_sim.ros.server import RosbridgeServer
from dva_sim.serving.open_port import open_port
from dva_sim.simulation.scenario import build

SOURCE = {
    "description": "Two robots in a hall; nothing happens.",
    "robot": {"count": 2},
    "guard": {"count": 0},
    "operator": {"count": 1},
    "bystander": {"count": 0},
    "events": [{"kind": "fire", "false_alarm": True}],
}


class ServedWorld(Patient):
    """Everything on one clock; clients are in threads of their own.

    Attributes:
        url: Address of the server, with its token.
    """

    def __init__(self, *changes: str, token: bool = True) -> None:
        scenario = build(SOURCE, parse_changes(changes))
        self.world = ConsoleWorld(scenario, "test", 1, clock=PacedClock())
        self.clock = self.world.clock
        self.clock.go()
        door = open_port("127.0.0.1", 0, "--rosbridge", token)
        self.url, self.lines = door.url, []
        stage = self.world.run.stage
        self.gateway = RosGateway(stage, lambda: self.world.seating.console)
        self.server = RosbridgeServer(self.clock, door, self.gateway, stage.site, self.lines.append)
        self.until(lambda: len(self.gateway.robots) == 2)

    def robot(self, label: str):
        robots = self.world.run.field.robots.values()
        return next(robot for robot in robots if robot.device.label == label)

    def client(self, url: str = "") -> "ScriptedRosClient":
        client = ScriptedRosClient(url or self.url)
        self.until(lambda: client.is_open or client.refused)
        return client

    def close(self) -> None:
        self.server.close()
        self.world.phones.close()


class ScriptedRosClient:
    """A client of rosbridge that knows the protocol and nothing of us.

    Attributes:
        came: All received operations.
        refused: Status of a refused handshake.
        closed: Close code, once the connection is over.
    """

    def __init__(self, url: str, **headers: str) -> None:
        self.came, self.refused, self.closed, self.is_open = [], 0, 0, False
        self._url, self._headers, self._count = url, headers, 0
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        asked = {"additional_headers": self._headers, "compression": None, "max_size": None}
        try:
            with connect(self._url, **asked) as socket:
                self._socket, self.is_open = socket, True
                self._hear()
        except InvalidStatus as error:
            self.refused = error.response.status_code
        except (OSError, EOFError, WebSocketException):
            self.refused = -1

    def _hear(self) -> None:
        with contextlib.suppress(ConnectionClosed, OSError):
            for text in self._socket:
                self.came.append(json.loads(text))
        self.closed, self.is_open = self._socket.close_code or 1006, False

    def say(self, operation) -> None:
        raw = operation if isinstance(operation, str | bytes) else json.dumps(operation)
        self._socket.send(raw)

    def send_raw(self, data: bytes) -> None:
        """Send bytes as they are, whatever frames they make."""
        self._socket.socket.sendall(data)

    def subscribe(self, topic: str, kind: str | None = None, **more) -> None:
        typed = {} if kind is None else {"type": kind}
        self.say({"op": "subscribe", "topic": topic, **typed, **more})

    def twist(self, topic: str, speed: float, turn_rate: float = 0.0) -> None:
        linear, angular = {"x": speed, "y": 0, "z": 0}, {"x": 0, "y": 0, "z": turn_rate}
        self.say({"op": "publish", "topic": topic, "msg": {"linear": linear, "angular": angular}})

    def of(self, topic: str) -> list[dict]:
        return [each["msg"] for each in self.came if each.get("topic") == topic]

    @property
    def statuses(self) -> list[str]:
        return [each["msg"] for each in self.came if each["op"] == "status"]

    def call(self, world: ServedWorld, service: str, **args) -> dict:
        """Call a service: the values of its response."""
        self._count += 1
        number = f"call:{self._count}"
        self.say({"op": "call_service", "service": service, "args": args, "id": number})

        def answers():
            return [each for each in self.came if each.get("id") == number]

        world.until(answers)
        (answer,) = answers()
        return answer["values"] | {"result": answer["result"]}

    def leave(self) -> None:
        """Vanish without a close frame."""
        self._socket.socket.shutdown(2)
        self._socket.socket.close()
