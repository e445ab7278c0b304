"""Doors of programs that run: what comes in is used as it is there, and then something is asked.

Each takes the bytes of a mutant in a child process, which may end in any state.
"""

from __future__ import annotations

import asyncio
import json
import re
import shutil
import socket
import time
from collections.abc import Iterator
from functools import cache, partial
from itertools import product
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, Literal, NotRequired, get_args, get_origin

import pytest
from helpers.console.simulated_console import Page
from helpers.dva.dispatch_office import GUARD, OPERATOR, OTHER_GUARD, ROBOT, Office
from helpers.paths import ROOT, TESTS
from starlette.requests import Request as WebRequest

from dva_sim.console.web.audit import AuditPages
from dva_sim.console.web.clients import Driver
from dva_sim.console.web.hub import USER, Hub
from dva_sim.console.web.logins import Logins
from dva_sim.console.web.rest import ROLE, Rest, TooStrange
from dva_sim.console.web.simulation import Simulation
from dva_sim.console.wire.actions import ACTIONS, OF_THE_WEB
from dva_sim.console.wire.kinds import BadMessage, Kind, hints_of
from dva_sim.console.wire.roles import Role
from dva_sim.core.assignments import Rules
from dva_sim.core.store import Store
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.keys import KeyRing
from dva_sim.network.messaging import Request
from dva_sim.network.virtual_network import VirtualSubscription
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.recordings.audit_log import AuditEntry, AuditLog
from dva_sim.ros.gateway import RosGateway
from dva_sim.ros.peers import RosPeer
from dva_sim.ros.server import RosbridgeServer
from dva_sim.serving.open_port import open_port

STEP_S = 0.3  # of the run, from one line to the next


class Unanswered(Exception):
    """A question after a mutant that has no answer, or a wrong one."""


# --- web lines ----------------------------------------------------------------------------


@cache
def page() -> Page:
    """Return a console's run with a drive under way, from which children begin."""
    with pytest.MonkeyPatch.context() as patch:
        run = Page(patch, "hands-on")
        run.let(20.0)
        run.sets_out(0.5, then=3.0)
        run.let_go()
        return run


def in_its_time(world: Any) -> None:
    """Let the clocks of this process show the time of a run."""
    time.monotonic = lambda: world.clock.now


def valid(hint: Any, rng: Random) -> Any:
    """Draw a value of an argument, within its limits."""
    kinds = [one for one in getattr(hint, "__metadata__", ()) if isinstance(one, Kind)]
    if kinds and kinds[0].words.startswith(("a robot", "a list of robots")):
        return 0 if kinds[0].words.startswith("a robot") else [0]
    limits = kinds[0]._limits if kinds else {}
    inner = get_args(hint)[0] if kinds or get_origin(hint) is NotRequired else hint
    if inner in (int, float):
        low, high = limits.get("ge", 0), limits.get("le", 1)
        return inner(rng.choice([low, min(low + 1, high), high]))
    if inner is str:
        return rng.choice(["robot-1", "guard-1", "c1", "a" * limits.get("max_length", 9)])
    if inner is bool:
        return rng.random() < 0.5
    if get_origin(inner) is Literal:
        return rng.choice(get_args(inner))
    if get_origin(inner) is list:
        least = limits.get("min_length", 1)
        return [valid(get_args(inner)[0], rng) for _ in range(max(least, 1))]
    if get_origin(inner) is dict:
        return {"robot-1": valid(get_args(inner)[1], rng)}
    return valid(get_args(inner)[0], rng) if get_args(inner) else None


def web_lines(rng: Random) -> Iterator[dict[str, Any]]:
    """Yield what pages and programs may say: each action, and what a page looks at."""
    for name, action in (ACTIONS | OF_THE_WEB).items():
        hints = hints_of(action.arguments)
        yield {"do": name, "id": f"a{name}", **{key: valid(hints[key], rng) for key in hints}}
    for name in ("take", "emergency", "fake", "link", "samples", "event_assign"):
        hints = hints_of(ACTIONS[name].arguments) if name in ACTIONS else {}
        arguments = {key: valid(hints[key], rng) for key in hints}
        yield {"action": name, "id": f"b{name}", "arguments": arguments, "robots": [0]}
    yield {"do": "ping", "at": 5}
    yield {"do": "watch", "robots": [0]}
    yield {"do": "look", "logs": {"dva": {"publications": True}}, "tables": ["devices"]}


def web(folder: Path) -> list[Path]:
    page()
    folder.mkdir(parents=True)
    found = []
    for number in range(4):
        lines = list(web_lines(Random(number)))
        Random(number).shuffle(lines)
        found.append(folder / f"{number}.jsonl")
        found[-1].write_text("".join(json.dumps(line) + "\n" for line in lines))
    return found


class WebProcess:
    """A web process without its port, and the run that it belongs to.

    Args:
        ours: End of the pipe at which the run is.
        theirs: The other end.
    """

    def __init__(self, ours: socket.socket, theirs: socket.socket) -> None:
        ours.setblocking(False)
        self._ours = ours
        self.simulation = Simulation()
        self.simulation.open(theirs.detach())
        self.hub = Hub(self.simulation)
        self.rest = Rest(self.hub)
        self.page = page()
        self._sent = 0
        self._rest = b""
        self.clients = {role: self.hub.clients.join(role) for role in Role if role.acts}
        self.hub._tell_here()

    async def goes_on(self, seconds: float) -> None:
        """Let the run take what was said, go on, and say what it has to say."""
        self._hear()
        self.page.let(seconds)
        for line in self.page.lines[self._sent :] + self.page.frames:
            if line["k"] != "frame":
                self.simulation._take(json.dumps(line).encode() + b"\n")
        self._sent = len(self.page.lines)
        self.page.frames.clear()
        await asyncio.sleep(0)
        self._hear()

    def _hear(self) -> None:
        try:
            self._rest += self._ours.recv(1 << 20)
        except BlockingIOError:
            return
        *lines, self._rest = self._rest.split(b"\n")
        for line in lines:
            self.page.actions.take(json.loads(line))

    async def request(self, handler: Any, body: bytes, role: Role) -> bytes:
        """Return the body of the answer to a request of a program."""

        async def receive() -> dict[str, Any]:
            return {"type": "http.request", "body": body, "more_body": False}

        scope = {"type": "http", "method": "POST", "path": "/", "query_string": b"", ROLE: role}
        scope |= {USER: "", "headers": [(b"content-type", b"application/json")]}
        asked = asyncio.ensure_future(handler(WebRequest(scope, receive)))
        for _ in range(300):  # longer than one waits for a robot over a slow link
            await self.goes_on(STEP_S)
            if asked.done():
                try:
                    return bytes(asked.result().body)
                except TooStrange as error:
                    return str(error).encode()
        raise Unanswered("a request has no answer within a minute")


def read_web(data: bytes) -> str:
    """Give lines to all doors of a console; what it says afterwards."""
    return asyncio.run(_read_web(data))


async def _read_web(data: bytes) -> str:
    in_its_time(page().world)
    ours, theirs = socket.socketpair()
    process = WebProcess(ours, theirs)
    await process.goes_on(STEP_S)
    said = []
    for number, line in enumerate(data.splitlines()):
        client = process.clients[[*process.clients][number % len(process.clients)]]
        client.driver = client.driver or Driver()
        for hear in (
            lambda text, one=client: process.hub._hear_driver(one, one.driver, text),
            lambda text, one=client: process.hub._hear_looker(one, text),
        ):
            try:
                hear(line.decode("utf-8", "replace"))
            except BadMessage as error:
                said.append(str(error))
        for handler in (process.rest.action, process.rest.emergency)[: 1 + (number % 4 == 0)]:
            said.append((await process.request(handler, line, client.role)).decode())
        try:
            plain = json.loads(line)
        except (ValueError, RecursionError):
            plain = None
        if isinstance(plain, dict):  # as of a web process that checks nothing but who asks
            who = {"client": client.name, "role": "supervise", "id": f"d{number}"}
            process.page.actions.take(plain | who)
        await process.goes_on(STEP_S)
        said += _drained(client)
    body = json.dumps({"action": "mark", "id": "last", "arguments": {"text": "still here"}})
    answer = json.loads(await process.request(process.rest.action, body.encode(), Role.SUPERVISE))
    if not answer["ok"]:
        raise Unanswered(f"a mark is answered with {answer}")
    if process.simulation._complaints:
        raise Unanswered("a line of the run makes no sense to the web process")
    return "\n".join(said)


def _drained(client: Any) -> Iterator[str]:
    for following in (client.feed.next, client.driver.next):
        while (text := following()) is not None:
            json.loads(text)
            yield text


# --- rosbridge ----------------------------------------------------------------------------


class Deaf:
    """A connection of a client of ROS that keeps what is sent."""

    waiting = 0

    def __init__(self) -> None:
        self.sent: list[dict[str, Any]] = []
        self.heard_at = 0.0

    def send(self, data: bytes) -> None:
        self.sent.append(json.loads(data))

    def ping(self) -> None:
        self.heard_at = time.monotonic()

    def close(self, *_: object, **__: object) -> None:
        """Stay."""

    end = close


@cache
def bridge() -> tuple[Page, RosbridgeServer]:
    with pytest.MonkeyPatch.context() as patch:
        run = Page(patch, "hands-on", seed=2)
        world = run.world
        gateway = RosGateway(world.run.stage, lambda: world.seating.console)
        port = open_port("127.0.0.1", 0, "--rosbridge", False)
        tell = lambda what: None  # noqa: E731
        server = RosbridgeServer(world.clock, port, gateway, world.run.stage.site, tell)
        run.until(lambda: gateway.robots)
    return run, server


def operations() -> Iterator[dict[str, Any]]:
    """Yield what a client may ask of the server, for its first robot."""
    name = next(iter(bridge()[1]._gateway.robots))
    twist = {"linear": {"x": 0.1, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.1}}
    for topic in bridge()[1].topics():
        yield {"op": "subscribe", "topic": topic, "throttle_rate": 5, "queue_length": 1, "id": "s"}
        yield {"op": "unsubscribe", "topic": topic}
    for service in bridge()[1].services():
        args = {"type": "sensor_msgs/LaserScan", "topic": f"/{name}/odom"}
        yield {"op": "call_service", "service": service, "args": args, "id": "c"}
    topic = f"/{name}/cmd_vel"
    yield {"op": "advertise", "topic": topic, "type": "geometry_msgs/Twist"}
    yield {"op": "call_service", "service": f"/{name}/take_control", "args": {}, "id": "t"}
    yield from [{"op": "publish", "topic": topic, "msg": twist}] * 5
    yield {"op": "publish", "topic": topic, "msg": {"header": {}, "twist": twist}}
    yield {"op": "set_level", "level": "error"}


def rosbridge(folder: Path) -> list[Path]:
    folder.mkdir(parents=True)
    found = []
    for number in range(4):
        lines = list(operations())
        Random(number).shuffle(lines)
        found.append(folder / f"{number}.jsonl")
        found[-1].write_text("".join(json.dumps(line) + "\n" for line in lines))
    return found


def read_rosbridge(data: bytes) -> str:
    """Let a client of ROS say lines to a server of robots, and then ask it for the time."""
    run, server = bridge()
    in_its_time(run.world)
    connection = Deaf()
    peer = RosPeer("a client", connection, server)
    server._peers[connection] = peer
    for line in data.splitlines():
        peer.take(line)
        connection.ping()
        run.let(STEP_S)
    other = Deaf()
    last = RosPeer("another", other, server)
    last.take(b'{"op": "call_service", "service": "/rosapi/get_time", "id": "last"}')
    if not other.sent or not other.sent[-1]["result"]:
        raise Unanswered(f"the time is answered with {other.sent}")
    return "\n".join(str(each["msg"]) for each in connection.sent if each["op"] == "status")


def read_bridge(data: bytes) -> str:
    """Read what the bridge of a robot elsewhere says."""
    from dva_sim.network.realtime import LiveClock
    from dva_sim.ros.client import RosbridgeClient, Subscribed
    from dva_sim.ros.profile import RosProfile
    from dva_sim.ros.readings import BadReading, RosReader
    from dva_sim.ros.websocket import WebSocketUrl

    recorder = Recorder()
    reader = RosReader(RosProfile())
    takes = {
        "nav_msgs/Odometry": reader.odometry,
        "tf2_msgs/TFMessage": lambda message: reader.transform(message, None),
        "sensor_msgs/BatteryState": reader.charge,
        "sensor_msgs/LaserScan": reader.scan,
        "sensor_msgs/CompressedImage": reader.picture,
    }

    def take(kind: str, message: Any) -> None:
        try:
            takes[kind](message)
        except BadReading as error:
            recorder.tell(0.0, kind, str(error))

    topics = {
        f"/{kind}": Subscribed(kind, lambda message, one=kind: take(one, message), 4_000_000)
        for kind in takes
    }
    client = RosbridgeClient(
        LiveClock(),
        WebSocketUrl("ws://127.0.0.1:1", "--ros"),
        topics,
        {},
        on_change=partial(recorder.tell, 0.0, "bridge"),
        on_bad=partial(recorder.tell, 0.0),
    )
    for line in data.splitlines():
        client._take(line)
    answers: list[str] = []
    client._calls["last"] = lambda done, text: answers.append(text)
    client._take(b'{"op": "service_response", "id": "last", "values": {"success": true}}')
    if not answers:
        raise Unanswered("an answer is not taken any more")
    return "\n".join(moment.what for moment in recorder.timeline)


BRIDGED = {
    "odometry-ros2": "nav_msgs/Odometry",
    "odometry-ros1": "nav_msgs/Odometry",
    "tf": "tf2_msgs/TFMessage",
    "battery": "sensor_msgs/BatteryState",
    "scan": "sensor_msgs/LaserScan",
    "picture": "sensor_msgs/CompressedImage",
}


def bridged(folder: Path) -> list[Path]:
    """Messages of a robot elsewhere, as a bridge sends them."""
    folder.mkdir(parents=True)
    messages = [
        json.loads((TESTS / f"data/rosbridge/{name}.json").read_text()) | {"topic": f"/{kind}"}
        for name, kind in BRIDGED.items()
    ]
    messages.append(json.loads((TESTS / "data/rosbridge/status.json").read_text()))
    messages.append({"op": "service_response", "id": "x", "values": {"message": ""}})
    file = folder / "bridge.jsonl"
    file.write_text("".join(json.dumps(message) + "\n" for message in messages))
    return [file]


# --- messages ------------------------------------------------------------------------------

_ENDS = re.compile(rb"(<DestinationID>)[^<]*(.*<SourceID>)[^<]*", re.DOTALL)


def messages(folder: Path) -> list[Path]:
    page()
    folder.mkdir(parents=True)
    valid = sorted((ROOT / "protocol/samples/valid").glob("*.xml"))
    return [Path(shutil.copy(path, folder)) for path in valid]


def read_message(data: bytes) -> str:
    """Let every device of a run hear a message from each other one, as requests and published."""
    run = page()
    in_its_time(run.world)
    network = run.world.run.network
    nodes = [*network._services]
    heard = {
        (one.peer, one._handler)
        for node in nodes
        for one in network._clients[node]
        if isinstance(one, VirtualSubscription)
    }
    answers: list[bytes] = []
    for node, source in product(nodes, nodes):
        ends = b"\\g<1>" + node.encode() + b"\\g<2>" + source.encode()
        network._services[node](Request(_ENDS.sub(ends, data, count=1), answers.append))
    for peer, take in heard:
        take(_ENDS.sub(b"\\g<1>" + peer.encode() + b"\\g<2>" + peer.encode(), data, count=1))
    run.let(5.0)
    if not run.do("mark", text="still here")[0]:
        raise Unanswered("a mark is refused")
    replies = [decode(answer).body for answer in answers]
    return "\n".join(str(reply.text) for reply in replies if isinstance(reply, m.Reply))


# --- memory of a DVA ----------------------------------------------------------------------

RULES = Rules(containment=True, escalate_after=60.0)


def state(folder: Path) -> list[Path]:
    """The memory of a DVA in the midst of a day."""
    folder.mkdir(parents=True)
    file = folder / "dva.state"
    office, memory = Office(rules=RULES), Store(file)
    office.register(OTHER_GUARD, "Guard", at=60)
    office.fire(12, now=1.0)
    office.fire(80, now=2.0, kind="flood")
    office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation", ("heat_flux",)), 3.0)
    office.progress(OPERATOR, "departed", 4.0)
    office.say(ROBOT, m.RobotEmergency(OPERATOR, 0, 5), 4.5)
    office.fire(300, now=4.7)
    problem = memory.keep(office.core, office.core.events.changes(), 5.0)
    assert problem is None, problem
    memory.close()
    return [file]


def open_state(data: bytes) -> None:
    """Open the memory of a DVA."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "dva.state")
        file.write_bytes(data)
        Store(file).close()


def read_state(data: bytes) -> str:
    """Let a DVA recall its memory, take a report, assign somebody, and keep that."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "dva.state")
        file.write_bytes(data)
        memory = Store(file)
        office = Office(rules=RULES)
        office.core = office.new_core()
        memory.recall(office.core, 10.0)
        office.sent += office.core.go_on()
        for id_tag, kind in ((GUARD, "Guard"), (ROBOT, "Robot"), (OPERATOR, "TeleOp")):
            office.register(id_tag, kind, now=11.0)
        office.register("02:00:00:04:00:01", "Sensor", now=11.0)
        office.report_place(GUARD, 0, 11.0)
        office.status(ROBOT, 10, 11.0)
        office.fire(2000, now=12.0)
        for at in range(13, 400, 20):
            sends = office.tick(float(at))
            office.ok(sends, float(at)) if at % 40 else office.no(sends, float(at))
            if problem := memory.keep(office.core, office.core.events.changes(), float(at)):
                raise Unanswered(problem)
        memory.copy()
        memory.close()
        again = Store(file)
        again.recall(office.new_core(), 500.0)
        again.close()
    return ""


# --- users, keys and audit logs -----------------------------------------------------------


def read_users(data: bytes) -> str:
    """Let everybody in the file try to log in."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "users.json")
        file.write_bytes(data)
        logins = Logins(file, lambda: 0.0)

        async def tries() -> None:
            for name in [*logins._users][:2]:
                token = await logins.log_in(name, "a long password", name)
                if token is not None:
                    logins.user_of(token)

        asyncio.run(tries())
        return "\n".join(logins._users)


def audit(folder: Path) -> list[Path]:
    folder.mkdir(parents=True)
    log = AuditLog(folder / "audit.sqlite")
    entry = {"time_s": 12.5, "at_utc": "2026-01-01T00:00:00Z", "author": "ana", "event": 1}
    details = {"arrival_s": 30.0, "advised": "guard-1", "advised_s": 12.0, "waited_s": 4.0}
    actions = ("begin", "acknowledge", "assign", "assign", "note", "end")
    people = {"role": "dispatch", "subject": "guard-2"}
    log.append([AuditEntry(**entry, **people, action=one, details=details) for one in actions])
    log.close()
    return [folder / "audit.sqlite"]


def read_audit(data: bytes) -> str:
    """Show a log as pages and programs get it, check it, and go on with it."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "audit.sqlite")
        file.write_bytes(data)
        pages = AuditPages(file)
        scope = {"type": "http", "query_string": b"after=1", "headers": []}

        async def all_answers() -> list[bytes]:
            doors = pages.rows, pages.check, pages.measures, pages.as_csv, pages.as_json
            return [bytes((await door(WebRequest(scope))).body) for door in doors]

        said = b"\n".join(asyncio.run(all_answers())).decode()
        log = AuditLog(file)
        entry = AuditEntry(time_s=1.0, at_utc="2026-01-01T00:00:00Z", author="ana", action="end")
        log.append([entry])
        log.close()
        return said


def keys(folder: Path) -> list[Path]:
    from dva_sim.network.keys import create_keys

    create_keys(folder, ["02:00:00:00:00:01"])
    return sorted(path for path in folder.rglob("*") if path.is_file())


def read_key(data: bytes) -> str:
    """Use a key as a public and as a secret one, beside others."""
    from dva_sim.network.keys import create_keys

    with TemporaryDirectory() as name:
        folder = Path(name)
        device = "02:00:00:00:00:01"
        create_keys(folder, [device, "02:00:00:00:00:02"])
        is_secret = b"secret-key" in data
        part = "secret/{}.key_secret" if is_secret else "public/{}.key"
        folder.joinpath(part.format(device.replace(":", "-"))).write_bytes(data)
        ring = KeyRing(folder)
        ring.owner(ring.pair("02:00:00:00:00:02")[0])
        ring.refresh()
        ring.pair(device)
        return "\n".join(ring.devices)
