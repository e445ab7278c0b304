"""A rosbridge server of a run: topics and services of its robots, for clients of ROS."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from typing import Any, Final
from urllib.parse import urlsplit

from dva_sim.agents.observation import CameraFrame
from dva_sim.network.realtime import LiveClock
from dva_sim.ros import published
from dva_sim.ros.gateway import KnownRobot, RosGateway
from dva_sim.ros.peers import RosPeer
from dva_sim.ros.rosbridge import encode
from dva_sim.ros.websocket import WebSocketConnection
from dva_sim.serving.admission import RequestFacts
from dva_sim.serving.open_port import OpenPort
from dva_sim.serving.port_connections import PortConnection, PortConnections
from dva_sim.worlds.site import Site

Json = dict[str, Any]
Answer = Callable[[bool, Json], object]

MAX_PEERS: Final = 16  # maximum clients with all rights; further ones may only stop robots
MAX_SERVED: Final = 32  # design: maximum clients of both kinds together
MAX_CONNECTIONS: Final = 64  # design: maximum connections, including those without a token yet
STOPS = 1  # rank of a client that may only stop robots
DOES_ALL = 2  # rank of a client with all rights
PING: Final = 2.0  # design: interval between two pings [s]
SILENT: Final = 5.0  # design: silence, pongs included, after which a client is cut [s]
SWEEP: Final = 1.0  # design: interval of checks for silent connections [s]
LARGEST: Final = 100_000  # design: maximum size of a client's message; a Twist has 200 [B]
CLOCK_PERIOD: Final = 0.1  # interval of messages on /clock [s]
TYPES: Final = {
    "odom": "nav_msgs/Odometry",
    "scan": "sensor_msgs/LaserScan",
    "image/compressed": "sensor_msgs/CompressedImage",
    "cmd_vel": "geometry_msgs/Twist",
}
SHARED: Final = {
    "/tf": "tf2_msgs/TFMessage",
    "/clock": "rosgraph_msgs/Clock",
    "/map": "nav_msgs/OccupancyGrid",
}
CONTROL: Final = "take_control", "release_control", "emergency_stop"
TRIGGER: Final = "std_srvs/Trigger"
ROSAPI: Final = {
    "/rosapi/topics": "rosapi/Topics",
    "/rosapi/topic_type": "rosapi/TopicType",
    "/rosapi/topics_for_type": "rosapi/TopicsForType",
    "/rosapi/services": "rosapi/Services",
    "/rosapi/service_type": "rosapi/ServiceType",
    "/rosapi/services_for_type": "rosapi/ServicesForType",
    "/rosapi/nodes": "rosapi/Nodes",
    "/rosapi/get_time": "rosapi/GetTime",
}


class RosbridgeServer:
    """Serves the robots of a gateway.

    Args:
        clock: Polls the sockets.
        port: Port to serve.
        gateway: The robots.
        site: Site whose map is served.
        tell: Function that adds a line to the story of the run.
    """

    def __init__(
        self,
        clock: LiveClock,
        port: OpenPort,
        gateway: RosGateway,
        site: Site,
        tell: Callable[[str], object],
    ) -> None:
        self._clock = clock
        self._listener = port.listener
        self._gateway = gateway
        self._site = site
        self._admission = port.admission()
        self._tell = tell
        self._places = PortConnections(MAX_CONNECTIONS, MAX_SERVED)
        self._peers: dict[WebSocketConnection, RosPeer | None] = {}
        self._count = 0
        self._map = b""
        gateway.on_frame = self._on_frame
        gateway.on_scan = self._on_scan
        gateway.on_picture = self._on_picture
        self._listen()
        clock.every(CLOCK_PERIOD, self._tick)
        clock.every(PING, self._ping)
        clock.every(SWEEP, lambda: self._places.sweep(clock.now))

    @property
    def port(self) -> int:
        """Return the port that it listens on."""
        return int(self._listener.getsockname()[1])

    def tell(self, what: str) -> None:
        """Add a line to the story."""
        self._tell(what)

    def now(self) -> float:
        """Return the current time [s]."""
        return self._clock.now

    # --- connections ---------------------------------------------------------------------

    def _listen(self) -> None:
        if self._listener.fileno() >= 0:
            self._clock.watch(self._listener.fileno(), self._accept)

    def _accept(self) -> None:
        from websockets.server import ServerProtocol  # late: start-up

        wait = self._places.wait(self._clock.now)
        if wait > 0.0:
            self._clock.unwatch(self._listener.fileno())
            self._clock.call_after(wait, self._listen)
            return
        with suppress(OSError):
            sock, _ = self._listener.accept()
            slot = self._places.enter(self._clock.now)
            protocol = ServerProtocol(max_size=LARGEST)
            connection = WebSocketConnection(
                self._clock,
                sock,
                protocol,
                lambda data: self._take(connection, data),
                lambda why: self._ended(connection, slot, why),
            )
            slot.drop = lambda: connection.end("its place was needed, or it showed no token")
            connection.on_event = lambda event: self._greet(connection, slot, protocol, event)
            self._peers[connection] = None

    def _ping(self) -> None:
        """Ping every client; cut those that have been silent for too long."""
        for connection, peer in list(self._peers.items()):
            if peer is not None and self._clock.now - connection.heard_at > SILENT:
                connection.end(f"silent for {SILENT:g} s")
            elif peer is not None:
                connection.ping()

    def _greet(
        self, connection: WebSocketConnection, slot: PortConnection, protocol: Any, request: Any
    ) -> None:
        """Answer the opening handshake."""
        if protocol.handshake_exc is not None:
            return
        refusal = self._refusal(request)
        if refusal is not None:
            protocol.send_response(protocol.reject(*refusal))
            connection.push()
            connection.end(refusal[1])
            return
        protocol.send_response(protocol.accept(request))
        if protocol.handshake_exc is None:
            self._count += 1
            name = f"ROS client {self._count}"
            self._peers[connection] = peer = RosPeer(name, connection, self)
            self._admit(peer, slot)

    def _admit(self, peer: RosPeer, slot: PortConnection) -> None:
        """Set the rank of a client with a token; those beyond the limit may only stop robots."""
        peers = [each for each in self._peers.values() if each is not None and each is not peer]
        peer.only_stops = sum(not each.only_stops for each in peers) >= MAX_PEERS
        rank = STOPS if peer.only_stops else DOES_ALL
        slot.begin(rank, self._clock.now, is_limited=not peer.only_stops)
        self.tell(f"{peer.name} has come{', and may only stop robots' if peer.only_stops else ''}")

    def _refusal(self, request: Any) -> tuple[HTTPStatus, str] | None:
        """Return status and reason of refusing a client: a foreign name or page, or no token."""
        headers = request.headers
        try:
            facts = RequestFacts(headers.get("Host", ""), headers.get("Origin"), changes=True)
            query = urlsplit(request.path).query
            bearer = headers.get("Authorization", "")
        except (ValueError, LookupError):  # LookupError: a repeated header
            return HTTPStatus.BAD_REQUEST, "the address or the headers make no sense\n"
        refusal = self._admission.refusal(facts, query, bearer)
        return None if refusal is None else (HTTPStatus(refusal[0]), f"{refusal[1]}\n")

    def _take(self, connection: WebSocketConnection, data: bytes) -> None:
        peer = self._peers.get(connection)
        if peer is not None:
            peer.take(data)

    def _ended(self, connection: WebSocketConnection, slot: PortConnection, why: str) -> None:
        slot.leave()
        peer = self._peers.pop(connection, None)
        if peer is None:
            return
        self.tell(f"{peer.name} has gone: {why}")
        if peer.driver is not None:
            self._gateway.retire(peer.driver)
            peer.driver = None
        self.changed()

    def close(self) -> None:
        """End all connections, and stop the robots that clients drove."""
        self._clock.unwatch(self._listener.fileno())
        self._listener.close()
        for connection in list(self._peers):
            connection.close(reason="the run is over")

    # --- topics and services ------------------------------------------------------------

    def topics(self) -> dict[str, str]:
        """Return all topics with their types."""
        of_robots = {
            f"/{name}/{topic}": kind
            for name in self._gateway.robots
            for topic, kind in TYPES.items()
        }
        return of_robots | SHARED

    def services(self) -> dict[str, str]:
        """Return all services with their types."""
        of_robots = {
            f"/{name}/{word}": TRIGGER for name in self._gateway.robots for word in CONTROL
        }
        return of_robots | ROSAPI

    def type_of(self, topic: str) -> str | None:
        """Return the message type of a topic, also for robots that have not registered yet."""
        name, _, topic_name = topic.lstrip("/").partition("/")
        return SHARED.get(topic) or (TYPES.get(topic_name) if name else None)

    def subscribed(self, peer: RosPeer, topic: str) -> None:
        """Handle a client's subscription to a topic."""
        self.changed()
        if topic == "/map":
            self._map = self._map or self._packed("/map", published.occupancy(self._site.grid))
            peer.offer(topic, self._map)

    def changed(self) -> None:
        """Subscribe to exactly the robots' topics that clients want."""
        topics = {
            topic for peer in self._peers.values() if peer is not None for topic in peer.wants
        }
        for name in self._gateway.robots:
            self._gateway.listen(
                name,
                frames=bool(topics & {f"/{name}/odom", "/tf"}),
                scan=f"/{name}/scan" in topics,
                pictures=f"/{name}/image/compressed" in topics,
            )

    def _tick(self) -> None:
        self.changed()  # robots may have registered
        self._send("/clock", lambda: published.clock(self._clock.now))

    # --- readings ------------------------------------------------------------------------

    def _on_frame(self, robot: KnownRobot, frame: CameraFrame) -> None:
        name = robot.name
        observation = frame.observation
        at = frame.captured
        self._send(f"/{name}/odom", lambda: published.odometry(name, observation, at))
        self._send("/tf", lambda: published.transform(name, observation, at))

    def _on_scan(self, robot: KnownRobot, ranges: tuple[float, ...]) -> None:
        name = robot.name
        now = self._clock.now
        self._send(f"/{name}/scan", lambda: published.scan(name, ranges, now))

    def _on_picture(self, robot: KnownRobot, jpeg: bytes, captured: float) -> None:
        name = robot.name
        self._send(f"/{name}/image/compressed", lambda: published.picture(name, jpeg, captured))

    def _send(self, topic: str, make: Callable[[], Json]) -> None:
        """Send a message to all subscribers; without subscribers it is not made."""
        peers = [p for p in self._peers.values() if p is not None and topic in p.wants]
        if peers:
            data = self._packed(topic, make())
            for peer in peers:
                peer.offer(topic, data)

    @staticmethod
    def _packed(topic: str, message: Json) -> bytes:
        return encode({"op": "publish", "topic": topic, "msg": message})

    # --- control -------------------------------------------------------------------------

    def command(self, peer: RosPeer, topic: str, speed: float, turn_rate: float) -> str:
        """Drive a robot for a client; return the reason of a refusal, or ""."""
        name, _, topic_name = topic.lstrip("/").partition("/")
        robot = self._gateway.robots.get(name)
        if topic_name != "cmd_vel" or robot is None:
            return "no robot has this topic; see /rosapi/topics"
        if peer.driver is None:
            return "it is not yours: call take_control first"
        return peer.driver.drive(robot.id_tag, speed, turn_rate)

    def call(self, peer: RosPeer, service: str, args: Any, answer: Answer) -> None:
        """Call a service for a client."""
        if service in ROSAPI:
            values = self._rosapi(service, args if isinstance(args, dict) else {})
            answer(True, values)
            return
        name, _, word = service.lstrip("/").partition("/")
        robot = self._gateway.robots.get(name)
        if robot is None or word not in CONTROL:
            answer(False, {"message": f"there is no service {service}; see /rosapi/services"})
            return

        def on_result(done: bool, text: str) -> None:
            answer(True, {"success": done, "message": text})

        if word == "emergency_stop":
            self._gateway.emergency(name, on_result)
        elif peer.only_stops:
            on_result(False, "too many clients are connected: only emergency_stop is served")
        elif word == "take_control":
            self._let_take(peer, robot, on_result)
        elif peer.driver is None:
            on_result(False, "it is not yours")
        else:
            peer.driver.release(robot.id_tag, on_result)

    def _let_take(
        self, peer: RosPeer, robot: KnownRobot, on_result: Callable[[bool, str], object]
    ) -> None:
        peer.driver = peer.driver or self._gateway.driver()
        if peer.driver is None:
            on_result(False, "too many clients are in control")
            return
        peer.driver.take(robot.id_tag, on_result)

    def _rosapi(self, service: str, args: Json) -> Json:
        topics = self.topics()
        services = self.services()
        kind = str(args.get("type", ""))
        match service.rpartition("/")[2]:
            case "topics":
                return {"topics": list(topics), "types": list(topics.values())}
            case "topic_type":
                return {"type": topics.get(str(args.get("topic")), "")}
            case "topics_for_type":
                return {"topics": [name for name, each in topics.items() if each == kind]}
            case "services":
                return {"services": list(services)}
            case "service_type":
                return {"type": services.get(str(args.get("service")), "")}
            case "services_for_type":
                return {"services": [name for name, each in services.items() if each == kind]}
            case "nodes":
                return {"nodes": ["/dva_sim"]}
            case _:
                return {"time": published.make_time(self._clock.now)}
