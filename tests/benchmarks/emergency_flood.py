"""Latency of an emergency stop while 2,000 connections keep a console port busy.

A quarter of them says nothing, a quarter stops in the middle of the TLS handshake or of a request,
a quarter sends its request byte by byte, and a quarter has asked once without a token; another is
opened for each that is cut. The world answers at once. Prints the time from the button to the
confirmation: over the socket for driving, by a request on a connection of its own, and by the
faster of both, which is what a page takes. Measures while the flood begins and 10 s later.
"""

from __future__ import annotations

import http.client
import json
import secrets
import ssl
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from benchmarks.goals import goal
from helpers.console.served_console import Served, serving_phones
from helpers.paths import TESTS
from helpers.processes.patience import PATIENCE_S
from websockets.sync.client import connect

CONNECTIONS, STOPS, SETTLED_S = 2000, 200, 10.0
FLOODING = TESTS / "helpers/console/connection_flood.py"
MOST_MS = 150.0  # the 99th percentile of a stop by button should be less


class Supervisor:
    """A page that presses the button, over both of its paths.

    Args:
        served: The web process.
        port: Port of the console, or of the phones.
        tls: True if the port speaks TLS.
    """

    def __init__(self, served: Served, port: int, tls: bool, stack: ExitStack) -> None:
        self.port, self.context = port, ssl._create_unverified_context() if tls else None
        self.headers = {"Authorization": f"Bearer {served.drive}"}
        more: dict[str, Any] = {"ssl": self.context} if tls else {}
        base = f"{'wss' if tls else 'ws'}://127.0.0.1:{port}/ws"

        def open_socket(path: str) -> Any:
            return stack.enter_context(
                connect(f"{base}{path}", additional_headers=self.headers, max_size=None, **more)
            )

        self.state = open_socket("/state")
        you = json.loads(self.state.recv(PATIENCE_S))
        self.drive = open_socket(f"/drive?key={you['key']}")
        Thread(target=lambda: list(self.state), daemon=True).start()

    def over_socket(self, key: str) -> object:
        """True if the stop was confirmed."""
        self.drive.send(json.dumps({"id": key, "do": "emergency", "robots": "all"}))
        while (line := json.loads(self.drive.recv(PATIENCE_S))).get("id") != key:
            pass
        return line["ok"]

    def by_request(self, key: str) -> object:
        """The status of the answer."""
        if self.context is None:
            asking = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        else:
            asking = http.client.HTTPSConnection(
                "127.0.0.1", self.port, timeout=PATIENCE_S, context=self.context
            )
        try:
            kind = {"Content-Type": "application/json"}
            asking.request("POST", "/api/emergency", json.dumps({"id": key}), self.headers | kind)
            return asking.getresponse().status
        except OSError as error:
            return type(error).__name__
        finally:
            asking.close()


@contextmanager
def flooded(port: int, tls: bool) -> Iterator[None]:
    """Connections that ask for nothing, from the moment on at which the first is opened."""
    command = [sys.executable, str(FLOODING), "127.0.0.1", str(port), str(CONNECTIONS)]
    pipe, words = subprocess.PIPE, ["--tls"] if tls else []
    null = subprocess.DEVNULL
    with subprocess.Popen([*command, *words], stdin=pipe, stdout=pipe, stderr=null) as process:
        try:
            time.sleep(0.5)  # until it has begun
            yield
        finally:
            assert process.stdin is not None
            process.stdin.close()


def measure(what: str, press: Callable[[str], object]) -> list[float]:
    """Times of stops [ms]; tells their quantiles and outcomes."""
    took, outcomes = [], Counter[object]()
    for number in range(STOPS):
        begun = time.perf_counter()
        outcomes[press(f"{number}-{secrets.token_hex(8)}")] += 1
        took.append(1000 * (time.perf_counter() - begun))
        time.sleep(0.01)
    p50, p99 = np.percentile(took, [50, 99])
    print(f"\n  {what:32s} p50 {p50:7.1f}  p99 {p99:7.1f}  max {max(took):7.1f} ms", end="")
    print(f"  {dict(outcomes)}", end="")
    return took


def stop_at_the_console(folder: Path) -> None:
    """On the console's port."""
    stop_under_a_flood(folder, tls=False)


def stop_at_a_phone(folder: Path) -> None:
    """On the phones' port, which speaks TLS."""
    stop_under_a_flood(folder, tls=True)


def stop_under_a_flood(folder: Path, tls: bool) -> None:
    """Stops of a button while connections come and stay."""
    with serving_phones(folder) as served, ExitStack() as stack:
        port = served.phones_port if tls else served.port
        page = Supervisor(served, port, tls, stack)
        Thread(target=_simulate, args=(served,), daemon=True).start()
        for path, press in (("socket", page.over_socket), ("request", page.by_request)):
            measure(f"quiet, by {path}", press)
        faster: list[list[float]] = []
        with flooded(port, tls):
            for when in ("as it begins", "10 s later"):
                took = [
                    measure(f"{when}, by {path}", press)
                    for path, press in (("socket", page.over_socket), ("request", page.by_request))
                ]
                faster.append(list(np.minimum(*took)))
                time.sleep(SETTLED_S)
        p50, p99 = np.percentile(np.concatenate(faster), [50, 99])
        print(f"\n  {'by button (the faster path)':32s} p50 {p50:7.1f}  p99 {p99:7.1f} ms", end="")
        goal("emergency stop by button, p99 [ms]", float(p99), most=MOST_MS)


def _simulate(served: Served) -> None:
    """Answer each stop at once, as a world would whose robots stand."""
    while True:
        try:
            asked = served.next_asked("emergency")
            served.say({"k": "done", "id": asked["id"], "ok": True, "text": "stopped"})
        except (OSError, TimeoutError, ValueError):
            return
