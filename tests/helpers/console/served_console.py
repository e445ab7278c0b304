"""A web process with the test in the place of the simulation, and clients that may be rude."""

from __future__ import annotations

import base64
import http.client
import json
import os
import select
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

from helpers.console.declared_lines import checked
from helpers.processes.patience import PATIENCE_S
from websockets.sync.client import ClientConnection, connect

from dva_sim.cameras.frames import ALIVE, Picture, pack
from dva_sim.console.wire.lines import ToPage

HOSTILE = "<script>alert(1)</script>"
LABELS = ("robot-1", "robot-2", HOSTILE, "robot-4", "robot-5")
Line = dict[str, Any]
OF_THE_WEB = ("you", "pong", "pictures", "bye", "d")  # lines that it makes itself


class Answer(NamedTuple):
    """Response to a request."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


def scene(labels: tuple[str, ...] = LABELS, **more: Any) -> Line:
    """The first line of a small run."""
    things = [
        {"i": i, "id": f"02:00:00:00:00:{i:02X}", "label": label, "kind": "robot"}
        for i, label in enumerate(labels)
    ]
    things.append({"i": len(labels), "id": "guard-1", "label": "guard-1", "kind": "guard"})
    origin = {"latitude_deg": 38.66, "longitude_deg": -9.2}
    site = {"name": "nowhere", "extent_m": [0, 0, 10, 10], "origin": origin}
    return {"k": "scene", "t": 0, "scenario": "test", "site": site, "things": things, **more}


def seat(client: str, **more: Any) -> Line:
    """A line `seat` of a page that holds nothing."""
    line = {"k": "seat", "t": 5, "seat": client, "label": "", "phase": "free", "order": None}
    return line | {"alert": "", "drives": [], "phone": None} | more


def places(t: int, *rows: list[int]) -> Line:
    """A line `pos`."""
    return {"k": "pos", "t": t, "p": list(rows)}


class Served:
    """A web process; the test plays the simulation.

    Args:
        words: More options.
        begins: True to send the scene at once.
    """

    def __init__(self, *words: str, begins: bool = True) -> None:
        self.end, theirs = socket.socketpair()
        self.pictures, their_pictures = socket.socketpair()
        numbers = theirs.fileno(), their_pictures.fileno()
        command = [sys.executable, "-m", "dva_sim.console.web", "--fd", str(numbers[0])]
        command += ["--pictures-fd", str(numbers[1]), *words]
        self.process = subprocess.Popen(command, pass_fds=numbers, stderr=subprocess.PIPE)
        theirs.close()
        their_pictures.close()
        self._rest = b""
        self._asked: list[Line] = []
        self.serving = self.next_asked("serving")
        self.port: int = self.serving["port"]
        self.drive, self.look = (_token(self.serving[role]) for role in ("drive", "look"))
        self.phone = _token(self.serving["phone"] or "")
        self.phones_port = urlsplit(self.serving["phone"] or "").port or 0
        if begins:
            self.say(scene())

    # --- the simulation's side -----------------------------------------------------------

    def say(self, *lines: Line) -> None:
        """Send lines as the simulation."""
        for line in lines:
            self.end.sendall(json.dumps(line).encode() + b"\n")

    def hear(self, wait: float) -> bool:
        """Receive requests for at most `wait` [s]; return False if the process has ended."""
        ready, _, _ = select.select([self.end], [], [], wait)
        if not ready:
            return True
        data = self.end.recv(1 << 16)
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._asked += [json.loads(line) for line in lines]
        return bool(data)

    def next_asked(self, *kinds: str, asker: Future[Any] | None = None) -> Line:
        """Return the next request of these kinds; drop others."""
        ends = time.monotonic() + PATIENCE_S
        while time.monotonic() < ends:
            if asker is not None and asker.done() and asker.exception():
                asker.result()
            while self._asked:
                line = self._asked.pop(0)
                if line["do"] in kinds:
                    return line
            if not self.hear(0.5):
                break
        raise TimeoutError(f"nobody asked for {' or '.join(kinds)}")

    def asked_so_far(self) -> list[Line]:
        """Return all unread requests."""
        while self.hear(0.0) and select.select([self.end], [], [], 0.05)[0]:
            pass
        found, self._asked = self._asked, []
        return found

    def acted(self) -> list[Line]:
        """Lines so far, except those that select views or say who is there."""
        return [line for line in self.asked_so_far() if line["do"] not in ("watch", "here")]

    def answering(self, kind: str, ask: Callable[..., Answer], *words: Any, **done: Any) -> Any:
        """Make a request, and answer it as the simulation; return the answer and that request."""
        with ThreadPoolExecutor(1) as other:
            reported = other.submit(ask, *words)
            asked = self.next_asked(kind, asker=reported)
            self.say({"k": "done", "id": asked["id"], "ok": True, "text": "done"} | done)
            return reported.result(PATIENCE_S), asked

    def show(self, robot: int, number: int, jpeg: bytes, captured: int = 0) -> None:
        """Draw a picture, as the process would that draws."""
        self.pictures.sendall(pack(Picture(robot, number, captured, captured + 50, jpeg)))

    def live(self) -> None:
        """Report that a painter draws."""
        self.pictures.sendall(pack(Picture(ALIVE, 0, 0, 0, b"")))

    # --- clients -------------------------------------------------------------------------

    def ask(
        self,
        path: str,
        method: str = "GET",
        body: Any = None,
        token: str | None = None,
        host: str | None = None,
        tls: ssl.SSLContext | None = None,
        **headers: str,
    ) -> Answer:
        """Send any request by https to the port for phones; header names have `_` for `-`."""
        port, kind = self.port, partial(http.client.HTTPConnection, timeout=PATIENCE_S)
        if tls is not None:
            port = self.phones_port
            kind = partial(http.client.HTTPSConnection, timeout=PATIENCE_S, context=tls)
        connection = kind("127.0.0.1", port)
        data = body if isinstance(body, bytes | None) else json.dumps(body).encode()
        sent = {name.replace("_", "-"): value for name, value in headers.items()}
        sent["Host"] = host or f"127.0.0.1:{port}"
        if token:
            sent["Cookie"] = f"dva_sim_{port}={token}"
        if data is not None:
            sent.setdefault("Content-Type", "application/json")
        try:
            connection.request(method, path, data, sent)
            found = connection.getresponse()
            return Answer(found.status, {k.lower(): v for k, v in found.getheaders()}, found.read())
        finally:
            connection.close()

    def socket(
        self,
        path: str,
        token: str | None = None,
        origin: str = "own",
        tls: ssl.SSLContext | None = None,
    ) -> ClientConnection:
        """A WebSocket of a page, or of a phone."""
        port, s = (self.phones_port, "s") if tls else (self.port, "")
        connection = connect(
            f"ws{s}://127.0.0.1:{port}{path}",
            ssl=tls,
            origin=f"http{s}://127.0.0.1:{port}" if origin == "own" else origin,  # type: ignore[arg-type]
            additional_headers={"Cookie": f"dva_sim_{port}={token}"} if token else {},
            open_timeout=PATIENCE_S,
            compression=None,
            max_size=None,
        )
        return connection.__enter__()  # the caller closes it

    def page(self, token: str = "", **more: Any) -> Page:
        """A page that is open and has its first snapshot."""
        return Page(self, token or self.drive, **more)

    def deaf(self, path: str, token: str) -> socket.socket:
        """A WebSocket that reads nothing but the answer to its handshake."""
        raw = socket.create_connection(("127.0.0.1", self.port), PATIENCE_S)
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 32768)
        key = base64.b64encode(os.urandom(16)).decode()
        raw.sendall(
            f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\nUpgrade: websocket\r\n"
            f"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
            f"Cookie: dva_sim_{self.port}={token}\r\n\r\n".encode()
        )
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += raw.recv(1)
        assert b" 101 " in head.splitlines()[0], head
        return raw

    def stop(self) -> str:
        """End the process; return its standard error."""
        with suppress(OSError):
            self.say({"k": "bye", "why": "the test is over"})
        try:
            _, errors = self.process.communicate(timeout=PATIENCE_S)
        finally:
            self.process.kill()
            self.end.close()
            self.pictures.close()
        return errors.decode()


class Page:
    """The state socket of a page."""

    def __init__(self, served: Served, token: str, path: str = "/ws/state") -> None:
        self.served, self.token = served, token
        self.ws = served.socket(path, token)
        self.you = self.next("you")
        self.client: str = self.you["client"]
        self.key: str = self.you["key"]

    def next(self, *kinds: str) -> Line:
        """The next message of some kinds."""
        while True:
            line: Line = json.loads(self.ws.recv(PATIENCE_S))
            if line["k"] in OF_THE_WEB:
                checked({key: value for key, value in line.items() if key != "s"}, ToPage)
            if line["k"] in kinds:
                return line

    def driving(self) -> ClientConnection:
        """Its driving socket."""
        return self.served.socket(f"/ws/drive?key={self.key}", self.token)

    def close(self) -> None:
        self.ws.close()


@contextmanager
def serving(*words: str, begins: bool = True) -> Iterator[Served]:
    """A web process for a while; it complains about nothing."""
    served = Served(*words, begins=begins)
    try:
        yield served
    finally:
        complaints = served.stop()
    assert complaints == ""


@contextmanager
def serving_phones(folder: Path) -> Iterator[Served]:
    """A web process with a port for phones, whose certificates are kept in a folder."""
    words = ("--phones-host", "127.0.0.1", "--phones-port", "0", "--certificates", str(folder))
    with serving(*words) as served:
        yield served


def _token(address: str) -> str:
    return str(address).partition("?token=")[2]
