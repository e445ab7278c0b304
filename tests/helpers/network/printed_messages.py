"""A client and a robot of another make: ZeroMQ, and XML as the samples print it.

Nothing here knows the program that is tested.
"""

import re
import threading
from itertools import count

import zmq
from helpers.network.free_ports import free_port
from helpers.paths import ROOT
from helpers.processes.patience import PATIENCE_S

SAMPLES = ROOT / "protocol" / "samples" / "valid"
DVA = "02:00:00:00:00:01"
TABLET = "56:2B:04:E4:56:D8"
ROBOT = "70:1A:04:F9:81:D6"
PERIOD_S = 0.2  # interval at which the robot reads its sockets and publishes [s]


def printed(name: str, **values: object) -> str:
    """A sample with other values in some of its elements."""
    text = (SAMPLES / f"{name}.xml").read_text(encoding="utf-8")
    for element, value in values.items():
        text, changes = re.subn(
            f"<{element}>.*?</{element}>", f"<{element}>{value}</{element}>", text
        )
        assert changes, f"{name} has no {element}"
    return text


def field(element: str, xml: str) -> str:
    """The text of the first element of that name."""
    found = re.search(f"<{element}>(.*?)</{element}>", xml)
    assert found, f"no {element} in {xml}"
    return found[1]


class PrintedClient:
    """The tablet of the dissertation.

    Args:
        dva: Address of the DVA.
    """

    def __init__(self, dva: str) -> None:
        self.dva = dva
        self._context = zmq.Context()
        self._numbers = count(1)

    def say(self, data: bytes, to: str = "", within_s: float = PATIENCE_S) -> str:
        """The reply to a request; empty if none comes."""
        with self._context.socket(zmq.REQ) as socket:
            socket.linger = 0
            socket.connect(f"tcp://{to or self.dva}")
            socket.send(data)
            return socket.recv().decode() if socket.poll(1000 * within_s) else ""

    def ask(self, name: str, to: str = "", **values: object) -> str:
        """The reply to a sample with a number of its own."""
        values = {"MessageID": next(self._numbers), "SourceID": TABLET} | values
        return self.say(printed(name, **values).encode(), to)

    def register(self) -> str:
        """The reply to the registration as it is printed, once mended."""
        return self.ask("registration")

    def permission(self, robot: str = ROBOT) -> str:
        """The reply to a request for a robot."""
        self.register()
        return self.ask("permission-request", DeviceID=robot)

    def give_back(self, session: str, robot: str = ROBOT) -> None:
        """End a permission."""
        about = {"DestinationID": DVA, "DeviceID": robot, "HolderID": TABLET, "Session": session}
        assert field("Code", self.ask("permission-revocation", **about)) == "0"

    def close(self) -> None:
        """Close all sockets."""
        self._context.destroy(linger=0)


class PrintedRobot:
    """A robot that agrees to everything, and says where it is.

    Args:
        client: Client through which it registers.
        id_tag: Id of the robot.
        label: Name for people.
        senses: True if it has sensors.

    Attributes:
        heard: Requests received.
    """

    def __init__(
        self,
        client: PrintedClient,
        id_tag: str = ROBOT,
        label: str = "theirs",
        *,
        senses: bool = False,
    ) -> None:
        self._client = client
        self._id = id_tag
        self._label = label
        self._senses = senses
        self.heard: list[str] = []
        self._port = free_port()
        self._subscriber = self._holder = ""
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def register(self) -> str:
        """The reply to its registration."""
        named = {"DeviceLabel": self._label, "DeviceType": "Robot"}
        address = f"127.0.0.1:{self._port}"
        return self._client.ask("registration", SourceID=self._id, IpAddr=address, **named)

    def has_heard(self, element: str) -> bool:
        """True if a request to it had that element."""
        return any(f"<{element}>" in text for text in self.heard)

    def close(self) -> None:
        """Fall silent for good."""
        self._is_over.set()
        self._thread.join()

    def _run(self) -> None:
        with zmq.Context() as context:
            requests, news = context.socket(zmq.REP), context.socket(zmq.PUB)
            with requests, news:
                requests.linger = news.linger = 0
                requests.bind(f"tcp://127.0.0.1:{self._port}")
                news.bind(f"tcp://127.0.0.1:{self._port + 1}")
                for number in count(1):
                    if self._is_over.is_set():
                        return
                    if requests.poll(1000 * PERIOD_S):
                        requests.send_string(self._reply(requests.recv_string(), number))
                    for topic, text in self._news(number):
                        news.send_multipart([topic.encode(), text.encode()])

    def _reply(self, text: str, number: int) -> str:
        self.heard.append(text)
        if "<PermissionGrant>" in text:
            self._holder = field("HolderID", text)
        if "<PermissionRevocation>" in text:
            self._holder = ""
        if "<DevSub>" in text:
            self._subscriber = field("SourceID", text)
        tells = self._senses and "<GetSensorInfo>" in text
        name = "reply-sensor-info-sensors" if tells else "reply-ok"
        ends = {"DestinationID": field("SourceID", text), "SourceID": self._id}
        return printed(name, MessageID=number, Answers=field("MessageID", text), **ends)

    def _news(self, number: int) -> list[tuple[str, str]]:
        own = {"MessageID": number, "SourceID": self._id}
        said = [
            ("heartbeat|", printed("heartbeat", **own)),
            ("status|", printed("robot-status", Tick=number, **own)),
        ]
        if self._holder:
            said.append(("holder|", printed("robot-holder", HolderID=self._holder, **own)))
        if self._subscriber:
            topic = f"sensor/smoke/{self._subscriber}|"
            values = {"DestinationID": self._subscriber, "SensorName": "smoke", "Unit": "1/m"}
            said.append((topic, printed("sensor-value", Tick=number, **own, **values)))
        return said
