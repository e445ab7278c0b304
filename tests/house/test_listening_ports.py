"""Questions that every port of the program has to answer, and a reason where one is left out.

Visitors of all kinds come to all ports at once, and in greater number than there are places. While
they are there, a client with the token is let in; those that say nothing of use are cut in time.
"""

import ast
import contextlib
import select
import socket
import ssl
import struct
import time
from dataclasses import dataclass, field
from urllib.parse import urlsplit

import pytest
from helpers.network.port_visitors import is_closed, request, upgrade
from helpers.paths import ROOT
from helpers.processes.programs import all_gone_after
from helpers.wording import unnamed

from dva_sim.console.robots.robot_station import two_free_ports

CALLS = {
    *("bind", "bind_to_random_port", "create_server", "create_unix_server", "start_server"),
    "start_unix_server",
}
IMPORTS = {  # modules that listen by calls with other names
    *("websockets.asyncio.server", "websockets.sync.server", "http.server", "socketserver"),
    *("wsgiref.simple_server", "xmlrpc.server", "zenoh", "cyclonedds.domain", "aiortc", "foxglove"),
}
OWN_CALLS = {"listen", "open_port", "listen_for_phones"}  # functions of ours that make a listener

# Each file that listens: the ports of it that are asked below, or why they are not.
LISTENERS = {
    "cameras/service.py": {"cameras"},
    "cli/live_screen.py": {"rosbridge", "foxglove"},
    "console/supervisor.py": {"rosbridge", "foxglove"},
    "console/web/__main__.py": {"console", "phones"},
    "console/web/phone_listener.py": {"phones"},
    "network/sockets.py": {"devices", "publications"},
    "serving/listening.py": {"console", "phones", "rosbridge", "foxglove", "cameras"},
    "serving/open_port.py": {"rosbridge", "foxglove"},
    "cli/link.py": "--publish, on loopback: passes bytes on to a program of the user",
    "live/supervisor.py": "tries whether ports are free, and closes them",
    "console/remote/beside.py": "tries whether a port is free, and closes it",
    "console/pages/processes.py": "tries whether a port is free, and closes it",
    "console/robots/robot_station.py": "tries whether two ports are free, and closes them",
    "network/emulator/crossing.py": "inside the emulated link, which nothing else reaches",
    "network/emulator/publishing.py": "serves the sockets of --publish",
    "network/emulator/relay.py": "on loopback, for a measurement; its peer is the other process",
    "network/middleware/udp.py": "inside the emulated link of a measurement",
    "network/middleware/dds.py": "inside the emulated link of a measurement",
    "network/middleware/websocket.py": "inside the emulated link of a measurement",
    "network/middleware/zenoh.py": "inside the emulated link of a measurement",
    "network/middleware/webrtc.py": "inside the emulated link of a measurement",
    "network/middleware/zeromq.py": "inside the emulated link of a measurement",
    "network/middleware/mqtt.py": "tries whether a port is free; mosquitto listens itself",
    "network/security.py": "inproc: between threads of one process",
    "testing/transports.py": "tries whether a port is free, and closes it",
    "validation/network/real_side/programs.py": "on loopback, for a measurement",
}

VISITS = "idle", "half-open", "slow", "frozen", "killed"
REFUSALS = {"wrong origin": 403, "wrong host": 421, "no token": 401}
NO_HTTP = "speaks ZMTP, not HTTP: a browser's request is no greeting"
# Questions that do not apply, and why.
LEFT_OUT = {
    ("cameras", "no token"): "their address goes to all devices, by messages of the DVA",
    **{(port, question): NO_HTTP for port in ("devices", "publications") for question in REFUSALS},
    ("devices", "frozen"): "a device that is silent is noticed by its heartbeats",
    ("publications", "frozen"): "the newest publications wait for it in a bounded queue",
}
VISITORS = 30  # of each kind at each port; rosbridge and Foxglove have 64 places in all
DRIP = 0.25  # from one byte of a slow visitor to its next [s]
ENDS_WITHIN = 60.0  # longest time until all are cut, on a busy machine [s]
EVIL = "https://evil.example"
GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00NULL".ljust(55, b"\0")
READY = b"\x04\x1a\x05READY\x0bSocket-Type\x00\x00\x00\x03SUB"


@dataclass
class Port:
    """A port, and the request that a good client makes of it.

    Attributes:
        url: Address; empty path and token where it has none.
        websocket: Its subprotocol; None: it speaks no WebSocket.
        path: Path of the request.
        status: Status of the answer; 0: the port speaks ZMTP.
    """

    url: str
    websocket: str | None = None
    path: str = "/"
    status: int = 101
    results: dict[str, object] = field(default_factory=dict)

    def address(self) -> tuple[str, int]:
        parts = urlsplit(self.url)
        return parts.hostname, parts.port

    def connected(self) -> socket.socket:
        sock = socket.create_connection(self.address(), 20.0)
        if self.url.startswith("https"):
            context = ssl._create_unverified_context()
            sock = context.wrap_socket(sock)
        return sock

    def hello(self, token: bool = True, **headers: str) -> bytes:
        if self.status == 0:
            return GREETING
        parts = urlsplit(self.url)
        query = f"?{parts.query}" if token and parts.query else ""
        url = f"http://{parts.netloc}{self.path}{query}"
        if self.websocket is None:
            return request(url, **headers)
        more = {"Sec-WebSocket-Protocol": self.websocket} if self.websocket else {}
        return upgrade(url, **more | headers)

    def answer(self, sock: socket.socket, hello: bytes) -> int:
        """Status of the answer, 0 for a greeting by ZMTP; -1: there is none."""
        data = b""
        with contextlib.suppress(OSError):
            sock.settimeout(20.0)
            sock.sendall(hello if self.status else hello + READY)
            while len(data) < (12 if self.status else 72) and (more := sock.recv(12)):
                data += more
        if not self.status:
            return 0 if b"READY" in data else -1
        return int(data.split()[1]) if data else -1

    def asked(self, **headers: str) -> int:
        """Status of the answer to one request."""
        with contextlib.closing(self.connected()) as sock:
            return self.answer(sock, self.hello(**headers))


class Visitor:
    """A connection of a kind, and the time after which it was cut [s]."""

    def __init__(self, port: Port, kind: str) -> None:
        # Half a handshake is half of TLS's where there is TLS.
        is_raw = kind == "half-open"
        sock = socket.create_connection(port.address(), 20.0) if is_raw else port.connected()
        self.sock, self.kind, self.cut_after = sock, kind, None
        self._rest = port.hello()[:-2] + b"\r\nX-Slow: " + b"x" * 4000
        if port.status == 0:
            self._rest = GREETING
        if kind == "half-open":
            begun = b"\x16\x03\x01\x02" if port.url.startswith("https") else self._rest[:20]
            sock.sendall(begun)
        elif kind in ("frozen", "killed"):
            port.answer(sock, port.hello())
        if kind == "killed":
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            sock.close()
        self._since = time.monotonic()

    def look(self) -> None:
        """Drip, and note whether the connection was cut."""
        if self.kind == "killed" or self.cut_after is not None:
            return
        if self.kind == "slow":
            with contextlib.suppress(OSError):
                self.sock.setblocking(True)
                self.sock.sendall(self._rest[:1])
                self._rest = self._rest[1:]
        if self.kind == "frozen":  # it reads nothing: the kernel tells that the peer has gone
            poll = select.poll()
            poll.register(self.sock, select.POLLRDHUP | select.POLLERR | select.POLLHUP)
            is_cut = bool(poll.poll(0))
        else:
            is_cut = _is_closed(self.sock)
        if is_cut:
            self.cut_after = time.monotonic() - self._since
            self.sock.close()


def _is_closed(sock: socket.socket) -> bool:
    try:
        return is_closed(sock)
    except ssl.SSLWantReadError:
        return False


def addresses(programs) -> dict[str, Port]:
    """All ports of a console and of a live run."""
    console = programs.start(
        *("console", "fire-drill", "--no-open", "--port", "0", "--phones", "--phones-port", "0"),
        *("--phones-host", "127.0.0.1", "--rosbridge", "0", "--foxglove", "0", "--links", "real"),
    )
    live = programs.start("live", "fire-drill", "--for", "300", "--camera-port", "0")
    console.wait_to_say("Console: ", "Phone: ", "rosbridge: ", "Foxglove: ", "DVA: ")
    live.wait_to_say("shows pictures of the robots at ")

    def said(name: str) -> str:
        line = next(line for line in console.output.splitlines() if line.startswith(f"{name}: "))
        return line.removeprefix(f"{name}: ").split()[0]

    cameras = live.output.partition("shows pictures of the robots at ")[2].split()[0]
    host, _, dva = said("DVA").rpartition(":")
    return {
        "console": Port(said("Console"), "", "/ws/state"),
        "phones": Port(said("Phone"), "", "/ws/state"),
        "rosbridge": Port(said("rosbridge"), ""),
        "foxglove": Port(said("Foxglove"), "foxglove.sdk.v1"),
        "cameras": Port(cameras, None, "/camera/robot-1.mjpg", 200),
        "devices": Port(f"tcp://{host}:{dva}", None, "", 0),
        "publications": Port(f"tcp://{host}:{int(dva) + 1}", None, "", 0),
    }


@pytest.fixture(scope="module")
def ports(tmp_path_factory):
    """All ports after all visitors, with the results of each question."""
    for programs in all_gone_after(tmp_path_factory.mktemp("programs")):
        ports = addresses(programs)
        visitors = []
        for name, port in ports.items():
            port.results["before"] = port.asked()
            for kind in VISITS:
                if (name, kind) not in LEFT_OUT:
                    count = 3 if kind in ("frozen", "killed") else VISITORS
                    visitors += [(port, Visitor(port, kind)) for _ in range(count)]
            port.results["among them"] = port.asked()
        origin, host = {"Origin": EVIL}, {"Host": "evil.example"}
        for name, port in ports.items():
            for question, more in (
                ("wrong origin", origin),
                ("wrong host", host),
                ("no token", {"token": False}),
            ):
                if (name, question) not in LEFT_OUT:
                    port.results[question] = port.asked(**more)
        end = time.monotonic() + ENDS_WITHIN
        left = visitors
        while left and time.monotonic() < end:
            for _, visitor in left:
                visitor.look()
            left = [v for v in left if v[1].cut_after is None and v[1].kind != "killed"]
            time.sleep(DRIP)
        for port, visitor in visitors:
            port.results.setdefault(visitor.kind, []).append(visitor.cut_after)
            visitor.sock.close()
        for port in ports.values():
            port.results["after"] = port.asked()
        yield ports


NAMES = "console", "phones", "rosbridge", "foxglove", "cameras", "devices", "publications"
CUT_WITHIN = 20.0  # [s]; 5 s where nothing else is said, and some for a busy machine
SLOWER = {
    "devices": 25.0,  # ZeroMQ gives a handshake 10 s
    "publications": 25.0,
    ("console", "frozen"): 40.0,  # a page is pinged every 10 s, and has 10 s to answer
    ("phones", "frozen"): 40.0,
}


@pytest.mark.system
@pytest.mark.parametrize("name", NAMES)
def test_a_client_with_the_token_is_let_in_before_among_and_after_all_visitors(ports, name):
    port = ports[name]
    answers = [port.results[when] for when in ("before", "among them", "after")]
    assert answers == [port.status] * 3


@pytest.mark.system
@pytest.mark.parametrize("kind", [kind for kind in VISITS if kind != "killed"])
@pytest.mark.parametrize("name", NAMES)
def test_visitors_that_say_nothing_of_use_are_cut_in_time(ports, name, kind):
    if (name, kind) in LEFT_OUT:
        assert kind not in ports[name].results
        return
    limit = SLOWER.get((name, kind), SLOWER.get(name, CUT_WITHIN))
    times = ports[name].results[kind]
    assert None not in times
    assert max(times) < limit


@pytest.mark.system
@pytest.mark.parametrize("question", REFUSALS)
@pytest.mark.parametrize("name", NAMES)
def test_foreign_pages_foreign_names_and_clients_without_a_token_are_refused(ports, name, question):
    if (name, question) in LEFT_OUT:
        assert question not in ports[name].results
        return
    assert ports[name].results[question] == REFUSALS[question]


def listening_calls(source: str) -> set[str]:
    """Functions called, and modules imported, that make a listener."""
    names: set[str] = set()
    if not any(name in source for name in IMPORTS | CALLS | OWN_CALLS):
        return names  # none is named, so there is nothing to parse
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom | ast.Import):
            modules = [getattr(node, "module", None), *(alias.name for alias in node.names)]
            names |= IMPORTS.intersection(modules)
        if isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            is_own = isinstance(node.func, ast.Name) and name in OWN_CALLS
            if name in CALLS or is_own:
                names.add(name)
    return names


def test_every_file_that_listens_is_in_the_table():
    package = ROOT / "dva_sim"
    files = {
        str(path.relative_to(package))
        for path in package.rglob("*.py")
        if listening_calls(path.read_text(encoding="utf-8"))
    }
    assert files - LISTENERS.keys() == set()
    assert LISTENERS.keys() - files == set()


def test_every_port_in_the_table_is_asked():
    ports = set().union(*(ports for ports in LISTENERS.values() if isinstance(ports, set)))
    assert ports == set(NAMES)
    assert {name for name, _ in LEFT_OUT} <= ports


@pytest.mark.parametrize(
    "source",
    [
        "sock.bind(('', 80))",
        "await asyncio.start_server(take, host, port)",
        "socket.create_server(('', 0))",
        "open_port(host, 0, '--x')",
        "listen(host, 0)",
        "import http.server",
        "from websockets.asyncio.server import serve",
    ],
)
def test_a_new_listener_would_be_found(source):
    assert listening_calls(source)


@pytest.mark.system
@pytest.mark.parametrize(
    ("words", "takes_two"),
    [
        (("console", "--links", "real", "--dva-port"), True),
        (("live", "--port"), True),
        (("console", "--rosbridge"), False),
        (("console", "--foxglove"), False),
        (("live", "--rosbridge"), False),
        (("live", "--foxglove"), False),
    ],
    ids=str,
)
def test_no_address_is_printed_unless_all_ports_are_open(tmp_path, words, takes_two):
    command, *options = words
    others = ("--no-open", "--port", "0") if command == "console" else ("--for", "5")
    others += () if "--rosbridge" in words else ("--rosbridge", "0")
    first = two_free_ports("127.0.0.1")
    with socket.create_server(("127.0.0.1", first + 1)):
        port = first if takes_two else first + 1
        for programs in all_gone_after(tmp_path):
            program = programs.start(command, "fire-drill", *others, *options, str(port))
            assert program.ends() == 2
            assert program.output == ""
            (line,) = program.complained
    assert unnamed(line, port, first + 1) == []
