"""Keys that are taken out of the folder, or put into it, while programs run with it."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from helpers.processes.patience import PATIENCE_S
from helpers.wording import counted

from dva_sim.network import sockets
from dva_sim.network.keys import KeyRing, create_keys
from dva_sim.network.messaging import Request, Requester
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import READ_KEYS, SocketNetwork

pytestmark = pytest.mark.system

ROBOT, OPERATOR = "02:00:00:01:00:01", "02:00:00:03:00:01"
STEP, WITHIN = 0.02, 3.0


class Side:
    """One machine, with a folder of keys of its own."""

    def __init__(self, folder: Path, device: str) -> None:
        self.folder, self.device, self.reports = folder, device, list[str]()
        self.network = SocketNetwork(LiveClock(), KeyRing(folder), self.reports.append)
        self.address = self.network.join(device)
        self.heard, self.answers = list[bytes](), list[bytes]()

    @property
    def file(self) -> str:
        return self.device.replace(":", "-") + ".key"

    def loses_key_of(self, other: Side) -> Path:
        away = self.folder / "away"
        shutil.move(self.folder / "public" / other.file, away)
        return away

    def gets_key_of(self, other: Side, away: Path) -> None:
        shutil.move(away, self.folder / "public" / other.file)


class Both:
    """A robot that answers and publishes, and an operator who asks it and listens."""

    def __init__(self, keys: Path, folder: Path) -> None:
        for name in ("robot", "operator"):
            shutil.copytree(keys, folder / name)
        self.robot = Side(folder / "robot", ROBOT)
        self.operator = Side(folder / "operator", OPERATOR)
        self.robot.network.serve(ROBOT, self._serve)
        self.operator.network.introduce(ROBOT, self.robot.address)
        self.requester = Requester(self.operator.network, OPERATOR, ROBOT, 0.4, attempts=1)
        self.senders: list[str | None] = []
        heard = self.operator.heard
        self.operator.network.subscribe(OPERATOR, ROBOT, "frame|", heard.append)

    def _serve(self, request: Request) -> None:
        self.senders.append(request.sender)
        request.answer(request.data)

    def let(self, seconds: float, until: Callable[[], object] = lambda: False) -> None:
        """Time passes; both sides talk all the while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            self.robot.network.publish(ROBOT, "frame|", b"a picture", 9)
            if not self.requester.busy:
                self.requester.request(b"a command", self.operator.answers.append)
            for side in (self.robot, self.operator):
                side.network.clock.run(side.network.clock.now + STEP)

    def talk(self) -> bool:
        """True if commands and pictures come through within a while."""
        self.forget()
        self.let(PATIENCE_S, lambda: self.operator.heard and self.operator.answers)
        return bool(self.operator.heard and self.operator.answers)

    def goes(self, side: Side) -> None:
        """A side notices that a key has gone; what was under way by then is let through."""
        self.let(WITHIN, lambda: any("has gone" in line for line in side.reports))
        assert any("has gone" in line for line in side.reports)
        self.let(0.2)
        self.forget()
        self.let(0.6)

    def forget(self) -> None:
        self.operator.heard.clear()
        self.operator.answers.clear()
        self.senders.clear()


@pytest.fixture
def both(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Both]:
    monkeypatch.setattr(sockets, "RETRY", 0.2)
    create_keys(tmp_path / "keys", [ROBOT, OPERATOR])
    sides = Both(tmp_path / "keys", tmp_path)
    assert sides.talk()
    yield sides
    for side in (sides.operator, sides.robot):
        side.network.close()


def test_a_device_whose_key_is_taken_away_is_heard_no_more_and_hears_nothing(both):
    """Its connections were open; nothing closes the one that it sends by."""
    assert set(both.senders) == {OPERATOR}
    away = both.robot.loses_key_of(both.operator)
    both.goes(both.robot)
    assert (both.operator.heard, both.operator.answers, both.senders) == ([], [], [])
    assert counted(both.robot.network.counters, "refused", "key") > 0
    assert any(OPERATOR in line for line in both.robot.reports)
    both.robot.gets_key_of(both.operator, away)
    assert both.talk()


def test_a_device_hears_nothing_more_of_one_whose_key_it_has_lost(both):
    away = both.operator.loses_key_of(both.robot)
    both.goes(both.operator)
    assert (both.operator.heard, both.operator.answers, both.senders) == ([], [], [])
    both.operator.gets_key_of(both.robot, away)
    assert both.talk()


# --- the folder -------------------------------------------------------------------------------


def key_file(folder: Path, device: str) -> Path:
    return folder / "public" / (device.replace(":", "-") + ".key")


def test_a_ring_tells_which_keys_have_gone_come_or_changed(tmp_path):
    create_keys(tmp_path, [ROBOT, OPERATOR])
    ring = KeyRing(tmp_path)
    key = ring.public(OPERATOR)
    assert ring.refresh() == set()
    other = "02:00:00:03:00:02"
    create_keys(tmp_path, [other])
    assert ring.refresh() == {other}
    assert ring.owner(ring.public(other)) == other
    key_file(tmp_path, OPERATOR).unlink()
    assert ring.refresh() == {OPERATOR}
    assert ring.owner(key) is None
    (tmp_path / "secret" / key_file(tmp_path, OPERATOR).with_suffix(".key_secret").name).unlink()
    create_keys(tmp_path, [OPERATOR])
    assert ring.refresh() == {OPERATOR}
    assert ring.owner(key) is None
    assert ring.owner(ring.public(OPERATOR)) == OPERATOR


def test_a_file_that_is_half_written_and_a_folder_that_is_away_change_nothing(tmp_path):
    create_keys(tmp_path, [ROBOT, OPERATOR])
    ring, file = KeyRing(tmp_path), key_file(tmp_path, OPERATOR)
    whole = file.read_text()
    file.write_text(whole[:40])
    assert ring.refresh() == set()
    assert ring.devices == [ROBOT, OPERATOR]
    file.write_text(whole)
    assert ring.refresh() == set()
    (tmp_path / "public").rename(tmp_path / "elsewhere")
    assert ring.refresh() == set()
    assert ring.devices == [ROBOT, OPERATOR]


def test_a_folder_without_any_key_lets_nobody_in(tmp_path):
    create_keys(tmp_path, [ROBOT, OPERATOR])
    ring = KeyRing(tmp_path)
    for device in (ROBOT, OPERATOR):
        key_file(tmp_path, device).unlink()
    assert ring.refresh() == {ROBOT, OPERATOR}
    assert ring.devices == []


def test_keys_are_read_again_within_seconds():
    assert READ_KEYS <= 2.0
