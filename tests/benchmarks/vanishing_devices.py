"""A DVA whose devices come and vanish in waves: open files, memory, and what the others feel.

Each device of a wave listens at an address of its own, registers, is heard once and is gone;
one in twenty is an operator who takes a robot of that wave along. Meanwhile honest devices ask
for the device list once a second, and one operator drives a robot. Then the DVA is killed and
started again with what it kept. Run by hand it shows more, and another version too:

    python tests/benchmarks/vanishing_devices.py --waves 10 --size 1000 --python OTHER/bin/python
"""

from __future__ import annotations

import argparse
import json
import os
import re
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np
import zmq

DVA, ROBOT = "02:00:00:00:00:01", "02:00:00:01:00:01"
DRIVER, DETECTOR = "02:00:00:03:00:99", "02:00:00:04:00:99"
TYPES = ("Robot", "Guard", "TeleOp", "Sensor")
HOLDS = 20  # one in so many is an operator who takes a robot along
HEARTBEAT = b"heartbeat|"
WINDOW = 32  # registrations under way at once
STAYS = 1.0  # a device, after the last of its wave is registered [s]
SCENARIO = (
    *("drive-to-event", "--set", "robot.processing_s=0", "--set", "horizon_s=36000"),
    *("--set", "events=[{kind: fire, at_s: 35000, reported: true, room: Robot bay}]"),
)


# --- the wire, without this project -----------------------------------------------------------


class Voice:
    """Messages of a device, each newer than the last."""

    def __init__(self, id_tag: str) -> None:
        self.id_tag, self._number = id_tag, 0

    def says(self, content: str, to: str = DVA, session: int = 0, kind: str = "SimpleMsg") -> bytes:
        self._number += 1
        day = time.time() % 86400
        stamp = f"{int(day // 3600):02}:{int(day // 60 % 60):02}:{day % 60:09.6f}"
        held = "" if kind == "HBMsg" else f"<SessionID>{session}</SessionID>"
        return (
            f"<msg><{kind}><DestinationID>{to}</DestinationID><MessageID>{self._number}</MessageID>"
            f"<SourceID>{self.id_tag}</SourceID><Timestamp>{stamp}</Timestamp>{held}{content}</{kind}></msg>"
        ).encode()

    def registers(self, what: str, address: str) -> bytes:
        content = (
            f"<DeviceLabel>{what}</DeviceLabel><DeviceType>{what}</DeviceType>"
            f"<IpAddr>{address}</IpAddr>"
        )
        return self.says(content, kind="RegMsg")

    def beats(self) -> bytes:
        return self.says("", kind="HBMsg")


def wishes(robot: str) -> str:
    return (
        f"<Access><PermissionRequest><DeviceID>{robot}</DeviceID>"
        "<Level>teleoperation</Level></PermissionRequest></Access>"
    )


def field(name: str, reply: bytes) -> str:
    found = re.search(f"<{name}>(.*?)</{name}>", reply.decode())
    return found[1] if found else ""


# --- those who vanish ---------------------------------------------------------------------------


def wave(net: int, number: int, size: int, dva: str) -> None:
    """A process: devices that register, are heard, and are gone without a word."""
    context = zmq.Context()
    context.set(zmq.MAX_SOCKETS, 60_000)
    publishers, codes = [], dict[str, int]()
    asker = context.socket(zmq.DEALER)
    asker.linger = 0
    asker.connect(f"tcp://{dva}")
    waiting = 0

    def hear(until: int) -> None:
        nonlocal waiting
        while waiting > until and asker.poll(3000):
            waiting -= 1
            code = field("Code", asker.recv_multipart()[-1])
            codes[code] = codes.get(code, 0) + 1

    for index in range(size):
        id_tag = f"0A:{number:02X}:00:00:{index >> 8:02X}:{index & 255:02X}"
        host = f"127.{net + number}.{index >> 8}.{index & 255}"
        publisher = context.socket(zmq.XPUB)
        publisher.linger = 0
        publisher.bind(f"tcp://{host}:5601")
        voice, kind = Voice(id_tag), TYPES[index % len(TYPES)]
        publishers.append((voice, publisher))
        asker.send_multipart([b"", voice.registers(kind, host)])
        waiting += 1
        if index % HOLDS == 2:  # an operator, two behind a robot
            hear(0)
            asker.send_multipart([b"", voice.says(wishes(publishers[-3][0].id_tag))])
            waiting += 1
        hear(WINDOW)
    hear(0)
    for voice, publisher in publishers:
        publisher.send_multipart([HEARTBEAT, voice.beats()])
    time.sleep(STAYS)
    print(json.dumps(codes), flush=True)
    os._exit(0)  # gone without a word


# --- those who stay ---------------------------------------------------------------------------


class Honest(threading.Thread):
    """Devices that ask once a second each, by turns, and one that drives at 10 Hz."""

    def __init__(self, net: int, count: int, dva: str) -> None:
        super().__init__(daemon=True)
        self.dva, self.count, self.net = dva, count, net
        self.trips: dict[str, list[float]] = {"honest": [], "drive": []}
        self.codes: dict[str, int] = {}
        self.lost, self.over = 0, False
        self._context = zmq.Context()

    def run(self) -> None:
        driver = _Driver(self, DRIVER, "TeleOp", f"127.{self.net}.255.1")
        everybody = [
            _Device(self, f"0C:00:00:00:00:{i:02X}", "TeleOp", f"127.{self.net}.254.{i + 1}", i)
            for i in range(self.count)
        ]
        poller, devices = zmq.Poller(), [driver, *everybody]
        while not self.over:
            now = time.monotonic()
            for device in devices:
                device.go_on(now)
                if device.socket is not None and device.socket not in poller:
                    poller.register(device.socket, zmq.POLLIN)
            soonest = min(device.due for device in devices)
            ready = dict(poller.poll(max(0, 1000 * (soonest - time.monotonic()))))
            for device in devices:
                if device.socket in ready:
                    device.hear()
                for old in device.old:
                    poller.unregister(old)
                    old.close(0)
                device.old.clear()
        if driver.thread is not None:
            driver.thread.join()
        self._context.destroy(0)


class _Device:
    """One that stays: it registers now and then, beats, and asks."""

    period, limit = 1.0, 3.0

    def __init__(self, all_: Honest, id_tag: str, kind: str, host: str, place: int = 0) -> None:
        self.all, self.kind, self.host = all_, kind, host
        self.voice = Voice(id_tag)
        self.socket: zmq.Socket[bytes] | None = None
        self.old: list[zmq.Socket[bytes]] = []
        self.publisher = all_._context.socket(zmq.XPUB)
        self.publisher.linger = 0
        self.publisher.bind(f"tcp://{host}:5601")
        start = time.monotonic() + place / 100
        self.due, self.asked, self._beat = start, 0.0, start
        self._registered = -1e9
        self._measured = False

    def go_on(self, now: float) -> None:
        if now >= self._beat:
            self._beat = now + 2.0
            self.publisher.send_multipart([HEARTBEAT, self.voice.beats()])
        if self.asked and now > self.asked + self.limit:
            self.all.lost += 1
            self._drop()
        if self.asked or now < self.due:
            return
        self.due = max(now, self.due + self.period)
        self._measured = now < self._registered + 10.0
        if not self._measured:
            self._registered = now
            self.ask(self.voice.registers(self.kind, self.host), self.all.dva)
        else:
            self.ask_next()

    def ask_next(self) -> None:
        self.ask(self.voice.says("<Access><GetDeviceList/></Access>"), self.all.dva)

    def ask(self, data: bytes, where: str) -> None:
        if self.socket is None:
            self.socket = self.all._context.socket(zmq.REQ)
            self.socket.linger = 0
            self.socket.connect(f"tcp://{where}")
        self.asked = time.monotonic()
        self.socket.send(data)

    def hear(self) -> bytes:
        assert self.socket is not None
        reply = self.socket.recv()
        code = field("Code", reply)
        if self._measured:
            self.all.trips["honest"].append(time.monotonic() - self.asked)
        self.all.codes[code] = self.all.codes.get(code, 0) + 1
        if code == "2":
            self._registered = -1e9
        self.asked = 0.0
        return reply

    def _drop(self) -> None:
        if self.socket is not None:
            self.old.append(self.socket)
        self.socket, self.asked = None, 0.0


class _Driver(_Device):
    """One operator who drives the one robot: asks for it, starts, and sends a command at 10 Hz."""

    robot, session, driving = "", 0, False
    _drives: zmq.Socket[bytes] | None = None
    thread: threading.Thread | None = None
    sent = 0.0

    def go_on(self, now: float) -> None:
        super().go_on(now)
        if self._drives is None and self.session:
            self._drives = self.all._context.socket(zmq.REQ)
            self._drives.linger = 0
            self._drives.connect(f"tcp://{self.robot}")
            self.thread = threading.Thread(target=self._drive, daemon=True)
            self.thread.start()

    def ask_next(self) -> None:
        if self.session:
            super().ask_next()
        else:
            self.ask(self.voice.says(wishes(ROBOT)), self.all.dva)

    def hear(self) -> bytes:
        reply = super().hear()
        if field("Session", reply) and not self.session:
            self.robot, self.session = field("IpAddr", reply), int(field("Session", reply))
        return reply

    def _drive(self) -> None:
        drives, voice = self._drives, Voice(self.voice.id_tag)
        assert drives is not None
        content = "<StartTeleOp/>"
        while not self.all.over:
            began = time.monotonic()
            drives.send(voice.says(f"<TeleOp>{content}</TeleOp>", ROBOT, self.session))
            while not drives.poll(500):
                if self.all.over or time.monotonic() - began > 30:
                    self.all.lost += 1
                    return
            code = field("Code", drives.recv())
            if content != "<StartTeleOp/>":
                self.all.trips["drive"].append(time.monotonic() - began)
                self.all.codes["drive " + code] = self.all.codes.get("drive " + code, 0) + 1
            going = code == "0"
            content = (
                "<SetTeleOp><Speed>0.1</Speed><TurnRate>0.4</TurnRate></SetTeleOp>"
                if going
                else "<StartTeleOp/>"
            )
            time.sleep(0.1 if going else 0.5)


# --- the DVA and the world --------------------------------------------------------------------


@dataclass
class Figures:
    """Measurements of one wave."""

    name: str
    files: int
    memory_mb: float
    cpu_s: float
    trips: dict[str, list[float]]
    lost: int
    codes: dict[str, int]
    vanished: dict[str, int]
    kept: tuple[int, int]

    HEAD = (
        "                  open   memory  DVA CPU   honest [ms]      drive [ms]     without"
        "   devices  events\n                 files     [MB]      [s]   p50     p99      p50"
        "     p99   answer    in file  in file"
    )

    def __str__(self) -> str:
        ways = "  ".join(f"{_part(t, 50):6.1f}  {_part(t, 99):6.1f}" for t in self.trips.values())
        return (
            f"{self.name:14}  {self.files:6d}  {self.memory_mb:7.1f}  {self.cpu_s:7.1f}  {ways}"
            f"  {self.lost:6d}  {self.kept[0]:9d}  {self.kept[1]:7d}"
            f"   told {self.vanished} / {self.codes}"
        )


def _part(times: list[float], percent: int) -> float:
    """A percentile [ms]."""
    return 1000 * float(np.percentile(times or [np.nan], percent))


class Scene:
    """A DVA with a memory, a world with one robot, honest devices, and waves."""

    def __init__(self, python: str, folder: Path, honest: int, seed: int | None = None) -> None:
        self.python, self.folder = python, folder
        self.net = Random(seed).randrange(2, 200)
        self.dva = f"127.{self.net}.253.1:5600"
        self.state = folder / "dva.state"
        self._errors = (folder / "errors").open("ab")
        self.process = self._start("dva", "--state", str(self.state))
        self._wait_for_dva()
        self._world = self._start("world", "--host", f"127.{self.net}.252.1")
        self.honest = Honest(self.net, honest, self.dva)
        self.honest.start()
        self._cpu = 0.0
        self._waves = 0

    def _start(self, part: str, *more: str) -> subprocess.Popen[bytes]:
        words = ["live", *SCENARIO, "--only", part, "--dva", self.dva, "--for", "36000", *more]
        return subprocess.Popen(
            [self.python, "-m", "dva_sim.cli", *words],
            stdout=self._errors,
            stderr=self._errors,
            stdin=subprocess.DEVNULL,
            cwd=self.folder,
        )

    def _wait_for_dva(self) -> None:
        with zmq.Context() as context, context.socket(zmq.REQ) as socket:
            socket.linger = 0
            socket.connect(f"tcp://{self.dva}")
            socket.send(Voice(DETECTOR).registers("Sensor", f"127.{self.net}.251.1"))
            assert socket.poll(30_000)  # it answers

    def kill(self) -> None:
        """kill -9 the DVA, and start it again with what it kept."""
        self.process.kill()
        self.process.wait()
        self.process, self._cpu = self._start("dva", "--state", str(self.state)), 0.0

    def wave(self, size: int, period: float) -> Figures:
        """Let a wave come and go, and the DVA be for the rest of the period [s]."""
        began = time.monotonic()
        self._report(self._waves)
        self._waves += 1
        words = [sys.executable, __file__, "--wave", str(self._waves), "--net", str(self.net)]
        words += ["--size", str(size), "--dva", self.dva]
        output = json.loads(subprocess.run(words, stdout=subprocess.PIPE, check=True).stdout)
        return self.rest(began + period - time.monotonic(), f"wave {self._waves}", output)

    def rest(
        self, seconds: float, name: str, codes_received: dict[str, int] | None = None
    ) -> Figures:
        """Let time pass [s], and look."""
        time.sleep(max(0.0, seconds))
        here, honest = Path(f"/proc/{self.process.pid}"), self.honest
        stat = (here / "stat").read_text().rpartition(")")[2].split()
        cpu = (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")
        pages = int((here / "statm").read_text().split()[1])
        files = len(list((here / "fd").iterdir()))
        trips = {name: times[:] for name, times in honest.trips.items()}
        codes, lost = dict(honest.codes), honest.lost
        for times in honest.trips.values():
            times.clear()
        honest.codes, honest.lost = {}, 0
        used, self._cpu = cpu - self._cpu, cpu
        memory = pages * os.sysconf("SC_PAGE_SIZE") / 1e6
        return Figures(
            name, files, memory, used, trips, lost, codes, codes_received or {}, self._kept()
        )

    def _kept(self) -> tuple[int, int]:
        with closing(sqlite3.connect(f"file:{self.state}?mode=ro", uri=True, timeout=5)) as file:
            tables = ("devices", "events")
            return tuple(file.execute(f"SELECT count(*) FROM {t}").fetchone()[0] for t in tables)  # type: ignore[return-value]

    def _report(self, number: int) -> None:
        """A detector reports one event for each wave: none may be lost."""
        content = (
            f"<Event><EventReport><Kind>fire</Kind><Position>"
            f"<Latitude>{38.6612 + number / 100}</Latitude><Longitude>-9.2058</Longitude>"
            "</Position><Severity>0.5</Severity><Confidence>0.9</Confidence><Finding>detected</Finding></EventReport></Event>"
        )
        voice = Voice(DETECTOR)
        with zmq.Context() as context, context.socket(zmq.REQ) as socket:
            socket.linger = 0
            socket.connect(f"tcp://{self.dva}")
            for data in (voice.registers("Sensor", f"127.{self.net}.251.1"), voice.says(content)):
                socket.send(data)
                if not socket.poll(20_000):
                    print(f"  the report of event {number} was not answered", flush=True)
                    return
                reply = socket.recv()
            if field("Code", reply) != "0":
                print(f"  the report of event {number} was answered {reply!r}", flush=True)

    def close(self) -> None:
        self.honest.over = True
        self.honest.join()
        for process in (self._world, self.process):
            process.kill()
            process.wait()
        self._errors.close()


def measured(args: argparse.Namespace) -> Iterator[Figures]:
    """The figures of each wave, as they come."""
    with (
        tempfile.TemporaryDirectory() as folder,
        closing(Scene(args.python, Path(folder), args.honest)) as scene,
    ):
        yield scene.rest(args.quiet, "nobody else")
        for _ in range(args.waves):
            yield scene.wave(args.size, args.period)
        scene.kill()
        yield scene.rest(args.period, "kill -9")
        for _ in range(args.waves_after):
            yield scene.wave(args.size, args.period)


def main(words: list[str] | None = None) -> list[Figures]:
    parser = argparse.ArgumentParser()
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--honest", type=int, default=100)
    parser.add_argument("--waves", type=int, default=10)
    parser.add_argument("--waves-after", type=int, default=2)
    parser.add_argument("--size", type=int, default=1000)
    parser.add_argument("--period", type=float, default=25.0)
    parser.add_argument("--quiet", type=float, default=15.0)
    parser.add_argument("--wave", type=int)
    parser.add_argument("--net", type=int)
    parser.add_argument("--dva")
    args = parser.parse_args(words)
    if args.wave is not None:
        wave(args.net, args.wave, args.size, args.dva)
    print(Figures.HEAD)
    found = []
    for figures in measured(args):
        print(figures, flush=True)
        found.append(figures)
    return found


def waves_of_devices_that_vanish(_: Path) -> None:
    """Open files, memory and answers of the DVA, before, during and after."""
    from benchmarks.goals import goal  # which is not there for the waves, programs of their own

    words = ["--waves=4", "--waves-after=1", "--size=250", "--period=15", "--quiet=10"]
    found = main(words)
    quiet, first, *later, _, after = found
    goal("files after the last wave over the first", later[-1].files / first.files, most=1.2)
    goal(
        "memory after the last wave over the first", later[-1].memory_mb / first.memory_mb, most=1.2
    )
    goal("files after kill -9 and a wave over the first", after.files / first.files, most=1.2)
    slower = _part(later[-1].trips["honest"], 99) / _part(quiet.trips["honest"], 99)
    goal("p99 of honest requests in the last wave over that without", slower, most=5.0)


if __name__ == "__main__":
    main()
