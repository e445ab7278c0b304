"""What pages that sleep cost whoever drives: nothing, for they have no way to a robot.

A person turns a robot of the real console; every 20 ms an input is sent, and noted when the robot
first obeyed it. In turns nobody else looks, or 20 clients do who read nothing: half of them at the
state, half at the camera.
"""

from __future__ import annotations

import json
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from threading import Thread
from typing import Any

import numpy as np
import pytest
from benchmarks.console_visits import console, load
from benchmarks.goals import goal
from helpers.processes.patience import PATIENCE_S
from scipy import stats
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

SLOW = 20  # clients
PAIRS, SAMPLES, SETTLE_S = 12, 100, 1.0
PERIOD_S = 0.02  # of inputs
MOST = 5.0  # the difference of the 99th percentiles should be less [ms]


class Hand:
    """A person's page, and what its inputs came to.

    Args:
        place: Host and port.
        token: Of who drives.
    """

    def __init__(self, place: str, token: str) -> None:
        self._sent: dict[int, float] = {}
        self.delays: list[float] = []
        self._n, self._known, self._phase = 0, 0, ""
        options: dict[str, Any] = {"max_size": None, "compression": None}
        options["additional_headers"] = {"Authorization": f"Bearer {token}"}
        self.state = connect(f"ws://{place}/ws/state", **options).__enter__()
        you = json.loads(self.state.recv(PATIENCE_S))
        address = f"ws://{place}/ws/drive?key={you['key']}"
        self.drive = connect(address, **options).__enter__()
        self._reader = Thread(target=self._look, daemon=True)
        self._reader.start()

    def _look(self) -> None:
        """Read what the page is told: one that does not is dropped."""
        with suppress(ConnectionClosed):
            while True:
                self.state.recv()

    def ask(self, what: str, within: float = PATIENCE_S, **about: Any) -> str:
        """Ask for something until it is done; why not, the first time."""
        ends, why = time.monotonic() + within, ""
        while time.monotonic() < ends:
            self._n += 1
            key = f"{what}-{self._n}"
            self.drive.send(json.dumps({"id": key, "do": what, **about}))
            while (line := self._next(PATIENCE_S)).get("id") != key:
                pass
            if line["ok"]:
                return why
            why = why or line["text"]
            time.sleep(0.5)
        raise TimeoutError(f"{what}: {why}")

    def _next(self, wait: float) -> dict[str, Any]:
        line: dict[str, Any] = json.loads(self.drive.recv(wait))
        if line["k"] == "seat":
            self._phase = line["phase"]
            for drive in line["drives"][:1]:
                self._note(drive.get("input"))
        return line

    def _note(self, obeyed: dict[str, Any] | None) -> None:
        """A newer input is in the set point: how long that took [ms]."""
        if obeyed and obeyed["n"] > self._known:
            self._known = obeyed["n"]
            if sent := self._sent.pop(obeyed["n"], None):
                self.delays.append(obeyed["at_ms"] - sent)

    def _begin(self) -> None:
        """Drive, if that is not so."""
        while self._phase != "driving":
            with suppress(TimeoutError):
                self.ask("start", within=1.0)
            ends = time.monotonic() + 1.0
            while self._phase != "driving" and time.monotonic() < ends:
                with suppress(TimeoutError):
                    self._next(0.2)

    def turn(self, seconds: float) -> None:
        """Turn on the spot."""
        self._begin()
        ends = due = time.monotonic()
        ends += seconds
        while time.monotonic() < ends:
            self._n += 1
            self._sent[self._n] = 1000 * time.time()
            about = {"n": self._n, "speed": 0.0, "turn": 0.5 if self._n % 200 < 100 else -0.5}
            self.drive.send(json.dumps({"do": "input", "held": True, **about}))
            due += PERIOD_S
            while (left := due - time.monotonic()) > 0:
                with suppress(TimeoutError):
                    self._next(left)

    def close(self) -> None:
        self.drive.close()
        self.state.close()
        self._reader.join(PATIENCE_S)


@contextmanager
def sleepers(place: str, token: str) -> Iterator[None]:
    """Clients who ask and then read nothing."""
    host, _, port = place.partition(":")
    with_socket = (
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
    )
    asleep = []
    for number in range(SLOW):
        raw = socket.socket()
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        raw.connect((host, int(port)))
        path, more = ("/ws/state", with_socket) if number % 2 else ("/camera/robot-1.mjpg", "")
        head = (
            f"GET {path} HTTP/1.1\r\nHost: {place}\r\n{more}Authorization: Bearer {token}\r\n\r\n"
        )
        raw.sendall(head.encode())
        asleep.append(raw)
    try:
        yield
    finally:
        for raw in asleep:
            raw.close()


def block(hand: Hand, place: str, token: str, slow: bool) -> float:
    """The 99th percentile of a block [ms]."""
    with sleepers(place, token) if slow else nullcontext():
        hand.turn(SETTLE_S)
        hand.delays.clear()
        while len(hand.delays) < SAMPLES:  # a machine that lags holds all robots for a while
            hand.turn(1.0)
        return float(np.percentile(hand.delays, 99))


def test_slow_clients_cost_a_driver_nothing(tmp_path):
    with console(tmp_path) as running:
        place, token = running.place
        hand = Hand(place, token)
        hand.ask("take", robots=[0])
        hand.turn(2.0)
        found = []
        for pair in range(PAIRS):
            order = (False, True) if pair % 2 else (True, False)
            alone, watched = sorted((slow, block(hand, place, token, slow)) for slow in order)
            found.append((alone[1], watched[1]))
        hand.ask("release")
        hand.close()
    p99 = np.array(found)
    gaps = p99[:, 1] - p99[:, 0]
    half = stats.t.ppf(0.975, PAIRS - 1) * gaps.std(ddof=1) / np.sqrt(PAIRS)
    print(
        f"\ninput to set point, p99 of {SAMPLES} samples: {p99[:, 0].mean():.1f} ms alone, "
        f"{p99[:, 1].mean():.1f} ms beside {SLOW} slow clients; paired difference "
        f"{gaps.mean():+.1f} ms, 95 % interval "
        f"{gaps.mean() - half:+.1f} to {gaps.mean() + half:+.1f} ms; {load()}"
    )
    goal("the difference [ms]", gaps.mean(), most=MOST)


if __name__ == "__main__":
    sys.exit(pytest.main([__file__, "-s", "-p", "no:cacheprovider"]))
