"""Visitors of a run: pages, clients of ROS, viewers and cameras that come and go by a seed."""

from __future__ import annotations

import contextlib
import random
import re
import threading
import urllib.request
from collections.abc import Callable
from typing import Protocol

from helpers.processes.patience import PATIENCE_S, becomes
from helpers.ros.served_world import ScriptedRosClient
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

MAX_OF_A_KIND = 6


class Visitor(Protocol):
    """One visitor."""

    def leave(self) -> object:
        """Go, without a word."""


class PageVisitor:
    """A page's state socket, read as fast as lines come.

    Args:
        address: Address of the console with its token.
    """

    def __init__(self, address: str) -> None:
        host, token = re.findall(r"http://(\S+?)/\?token=(\S+)", address)[0]
        cookie = f"dva_sim_{host.rpartition(':')[2]}={token}"
        self._socket = connect(
            f"ws://{host}/ws/state",
            origin=f"http://{host}",  # type: ignore[arg-type]
            additional_headers={"Cookie": cookie},
            open_timeout=PATIENCE_S,
            max_size=None,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        with contextlib.suppress(WebSocketException):
            for _ in self._socket:
                pass

    def leave(self) -> None:
        self._socket.close()


class RosVisitor(ScriptedRosClient):
    """A client of ROS that hears a robot's odometry.

    Raises:
        OSError: it is not let in.
    """

    def __init__(self, address: str) -> None:
        super().__init__(address)
        if not becomes(lambda: self.is_open or self.refused) or self.refused:
            raise OSError(f"refused with {self.refused}")
        self.subscribe("/robot_1/odom")

    def leave(self) -> None:
        with contextlib.suppress(OSError):  # it was shown out before
            super().leave()


class CameraVisitor:
    """A visitor who fetches a camera's picture and leaves.

    Args:
        address: Address of the pictures, with `LABEL` for a robot.
    """

    def __init__(self, address: str) -> None:
        still = address.replace("LABEL", "robot-1").replace(".mjpg", ".jpg")
        with urllib.request.urlopen(still, timeout=PATIENCE_S) as answer:
            answer.read()

    def leave(self) -> None:
        pass


class Visitors:
    """Visitors of all kinds who are present.

    Args:
        doors: Functions that let one more of a kind in, by the kind.

    Attributes:
        came: Number of visitors so far, by kind.
        refused: Reasons of refusals, in one line each.
    """

    def __init__(self, doors: dict[str, Callable[[], Visitor]]) -> None:
        self._doors = doors
        self._here: dict[str, list[Visitor]] = {kind: [] for kind in doors}
        self.came = dict.fromkeys(doors, 0)
        self.refused: list[str] = []

    def step(self, rng: random.Random) -> None:
        """Let a visitor come or go; one goes if its kind is full."""
        kind = rng.choice(sorted(self._doors))
        here = self._here[kind]
        if here and (len(here) >= MAX_OF_A_KIND or rng.random() < 0.5):
            here.pop(rng.randrange(len(here))).leave()
            return
        try:
            here.append(self._doors[kind]())
        except (OSError, WebSocketException) as error:
            self.refused.append(f"{kind}: {type(error).__name__}: {error}")
            return
        self.came[kind] += 1

    def leave(self) -> None:
        """Let all visitors go."""
        for here in self._here.values():
            while here:
                here.pop().leave()
