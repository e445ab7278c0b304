"""A small machine of ROS for tests: a rosbridge server in a thread, and a robot that drives.

The server is that of `websockets`, so that no code of ours is at both ends.
"""

import base64
import contextlib
import json
import math
import threading
import time
from pathlib import Path

from helpers.paths import ROOT
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import serve

FIXTURES = ROOT / "tests/data/rosbridge"
PERIOD = 0.02
JPEG = base64.b64decode(json.loads((FIXTURES / "picture.json").read_text())["msg"]["data"])


def fixture(name: str):
    """A message of a rosbridge server, as the protocol has it."""
    return json.loads((FIXTURES / f"{name}.json").read_text())


class RosMachine:
    """A robot behind a rosbridge server on a free port.

    Attributes:
        heard: All received operations, in order.
        commands: Speed and turn rate of each velocity command.
        x, y, heading, speed, turn_rate: State of the robot.
        obeys: True if it follows commands; otherwise it keeps its motion.
        tells: True if odometry is published.
        lag: Additional age of odometry [s].
        pictures: True if pictures are published.
    """

    def __init__(self, frame: str = "odom", pictures: bool = False) -> None:
        self.heard: list[dict] = []
        self.commands: list[tuple[float, float]] = []
        self.x, self.y, self.heading, self.speed, self.turn_rate = 20.0, 10.0, 0.0, 0.0, 0.0
        self.obeys, self.tells, self.lag, self.pictures = True, True, 0.0, pictures
        self.frame, self.connections = frame, 0
        self._open: set = set()
        self._port = 0
        self._over = threading.Event()
        self.start()

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self._port}"

    def start(self) -> None:
        """Begin to serve, at the same port as before."""
        self._over.clear()
        self._server = serve(
            self._talk, "127.0.0.1", self._port, max_size=None, compression=None, close_timeout=0.1
        )
        self._port = self._server.socket.getsockname()[1]
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End all connections without a close frame, and stop serving."""
        self._over.set()
        self._server.shutdown()
        for connection in list(self._open):
            with contextlib.suppress(OSError):
                connection.socket.shutdown(2)
            connection.socket.close()
        self._thread.join()

    def say(self, message: dict | str | bytes) -> None:
        """Send something to all clients."""
        text = message if isinstance(message, str | bytes) else json.dumps(message)
        for connection in list(self._open):
            connection.send(text)

    def ops(self, op: str) -> list[dict]:
        return [each for each in self.heard if each["op"] == op]

    def _talk(self, connection) -> None:
        self._open.add(connection)
        self.connections += 1
        threading.Thread(target=self._publish, args=(connection,), daemon=True).start()
        with contextlib.suppress(ConnectionClosed, OSError):
            for text in connection:
                operation = json.loads(text)
                self.heard.append(operation)
                if operation["op"] == "publish":
                    self._obey(operation["msg"])
        self._open.discard(connection)

    def _obey(self, message: dict) -> None:
        twist = message.get("twist", message)
        command = twist["linear"]["x"], twist["angular"]["z"]
        self.commands.append(command)
        if self.obeys:
            self.speed, self.turn_rate = command

    def _publish(self, connection) -> None:
        with contextlib.suppress(ConnectionClosed, OSError):
            while not self._over.wait(PERIOD) and connection in self._open:
                self.heading += self.turn_rate * PERIOD
                self.x += self.speed * PERIOD * math.cos(self.heading)
                self.y += self.speed * PERIOD * math.sin(self.heading)
                if self.tells:
                    connection.send(json.dumps(self.odometry()))
                if self.pictures:
                    connection.send((FIXTURES / "picture.json").read_text())

    def odometry(self) -> dict:
        """The newest odometry."""
        message = fixture("odometry-ros2")
        reported = message["msg"]
        when = time.time() - self.lag
        reported["header"] = {
            "stamp": {"sec": int(when), "nanosec": int(when % 1 * 1e9)},
            "frame_id": self.frame,
        }
        turn = {
            "x": 0.0,
            "y": 0.0,
            "z": math.sin(self.heading / 2),
            "w": math.cos(self.heading / 2),
        }
        place = {"x": self.x, "y": self.y, "z": 0.0}
        reported["pose"]["pose"] = {"position": place, "orientation": turn}
        reported["twist"]["twist"]["linear"]["x"] = self.speed
        reported["twist"]["twist"]["angular"]["z"] = self.turn_rate
        return message


def write_profile(folder: Path, **changed: str) -> Path:
    """A profile as it ships, with some lines changed: `odometry="/o"` changes `odometry:`."""
    text = (ROOT / "agents/ros/differential.yaml").read_text()
    for key, value in changed.items():
        lines = [
            f"{line[: len(line) - len(line.lstrip())]}{key}: {value}"
            if line.strip().startswith(f"{key}:")
            else line
            for line in text.splitlines()
        ]
        text = "\n".join(lines) + "\n"
    path = folder / "robot.yaml"
    path.write_text(text)
    return path
