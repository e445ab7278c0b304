"""Latency of a phone's commands and pictures on loopback, and cost of a phone.

A phone here is its page's two sockets: 60 samples a second by a clock of its own, in batches as the
page makes them, tilted to one side and to the other. Each command that takes effect tells which
sample is behind it (a median of five is two samples older than its newest); so the delay is from
that sample to the robot's set point, with all that lies between.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import Any

import numpy as np
from benchmarks.console_visits import Console, console
from benchmarks.goals import goal
from helpers.console.browser_phone import Hand
from helpers.console.chromium import chromium
from helpers.console.simulated_phone import CALIBRATION
from helpers.processes.patience import PATIENCE_S
from playwright.sync_api import Page, Response, expect
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

STEPS, STEP_S, WARM_UP_S = 500, 0.1, 2.0
HZ, BATCH_S = 60.0, 0.012  # as phones and the page have them
DRIVEN, MANY, MANY_S = 2, 20, 15.0
UPRIGHT, LEFT, RIGHT = (0.0, 6.9, 6.9), (1.2, 6.9, 6.8), (-1.2, 6.9, 6.8)  # [m/s^2]
WORDS = ("--phones", "--phones-host", "127.0.0.1", "--phones-port", "0")
STARTS_WITHIN_S, REST_S = 15.0, 0.5
DELAY_MS = 60.0  # hand to set point should take less, for 95 of 100


class Phone:
    """A phone's page without a browser.

    Args:
        label: Label of the device.

    Attributes:
        parts: Parts of each command's delay: hand to set point, and of that filter and wait for the
            next command, and link and robot [ms].
        line: The newest of its seat.
        drives: True while it has a robot.
    """

    def __init__(self, at: Console, label: str) -> None:
        options: dict[str, Any] = {"max_size": None, "compression": None}
        options["additional_headers"] = {"Authorization": f"Bearer {at.phones}"}
        self._state = connect(f"ws://{at.place}/ws/state", **options).__enter__()
        key = json.loads(self._state.recv(PATIENCE_S))["key"]
        self.scene = self._until(self._state, lambda line: line.get("scene"))["scene"]
        address = f"ws://{at.place}/ws/drive?key={key}"
        self._drive = connect(address, **options).__enter__()
        self._reader = Thread(target=self._look, daemon=True)
        self._reader.start()
        self._taken: dict[int, float] = {}
        self.parts: list[tuple[float, float, float]] = []
        self.line: dict[str, Any] = {}
        self.drives = False
        self._n = self._asked = self._known = 0
        self._at, self._sent = time.monotonic(), 0.0
        self._waiting: list[tuple[float, tuple[float, ...]]] = []
        self._rng = np.random.default_rng(len(label))
        server, port = self.scene["dva_address"].rsplit(":", 1)
        about = {"server": server, "port": int(port), "label": label, "type": "Teleoperation"}
        self.ask("phone_register", **about)

    def _look(self) -> None:
        """Read the page's messages; a page that does not read is dropped."""
        with suppress(ConnectionClosed):
            while True:
                self._state.recv()

    @staticmethod
    def _until(socket: Any, wanted: Any) -> dict[str, Any]:
        while True:
            line: dict[str, Any] = json.loads(socket.recv(PATIENCE_S))
            if wanted(line):
                return line

    def ask(self, what: str, **about: Any) -> dict[str, Any]:
        """Ask for something, and wait for the answer."""
        self._asked += 1
        key = f"{what}-{self._asked}"
        self._drive.send(json.dumps({"id": key, "do": what, **about}))
        return self._until(self._drive, lambda line: self._note(line) or line.get("id") == key)

    def take(self, number: int) -> None:
        """A robot of its own, calibrated."""
        robots = [one for one in self.scene["things"] if one["kind"] == "robot"]
        device = robots[number]["id"]
        answer = self.ask("phone_permission", device=device, level="teleoperation")
        assert answer["ok"], answer
        self.drives = True
        assert self.ask("phone_calibrate", **CALIBRATION | {"reference_mps2": UPRIGHT})["ok"]

    def _note(self, line: dict[str, Any]) -> None:
        """A newer sample is in the set point: how long that took."""
        if line["k"] != "seat":
            return
        self.line = line
        for drive in line["drives"]:
            acted = drive.get("input")
            if not acted or acted["n"] <= self._known:
                continue
            self._known = acted["n"]
            taken = self._taken.get(acted["n"])
            if taken is not None and drive["loop_ms"] is not None:
                whole, age = acted["at_ms"] - 1000 * taken, drive["command_age_ms"]
                self.parts.append((whole, drive["loop_ms"] - age, age))

    @property
    def is_driving(self) -> bool:
        return bool(self.line.get("phase") == "driving")

    def hold(self, pose: tuple[float, float, float], seconds: float) -> None:
        """Hold it so for a while, and begin to drive again if a busy machine has stopped it."""
        end = time.monotonic() + seconds
        if time.monotonic() - self._at > REST_S:
            self._at = time.monotonic()  # nobody has held it
        while (now := time.monotonic()) < end:
            self.step(pose)
            wait = max(0.0, min(self._at, end) - now)
            with suppress(TimeoutError):
                self._note(json.loads(self._drive.recv(wait or 0.0005)))

    def start(self) -> None:
        """Drive, if that is not so; a machine that lags holds all robots for a while."""
        end = time.monotonic() + STARTS_WITHIN_S
        while not self.is_driving and time.monotonic() < end:
            self._asked += 1
            self._drive.send(json.dumps({"id": f"start-{self._asked}", "do": "start"}))
            self.hold(UPRIGHT, 1.0)

    def step(self, pose: tuple[float, float, float]) -> None:
        """Take the samples that are due, and send a batch if it is time, as the page does."""
        now = time.monotonic()
        while self._at <= now:
            noise = self._rng.normal(0.0, 0.02, 3)
            self._taken[self._n + len(self._waiting)] = time.time() - (now - self._at)
            self._waiting.append((1000 * self._at, tuple(np.add(pose, noise).tolist())))
            self._at += 1.0 / HZ
        if self._waiting and now - self._sent >= BATCH_S:
            at, xyz = zip(*self._waiting[-64:], strict=True)
            line = {"do": "samples", "n": self._n, "at": at, "xyz": xyz}
            self._drive.send(json.dumps({**line, "hand": True, "orientation": 0}))
            self._n += len(self._waiting)
            self._sent, self._waiting = now, []

    def close(self) -> None:
        self._drive.close()
        self._state.close()
        self._reader.join(PATIENCE_S)


def swing(phone: Phone, steps: int) -> None:
    """Tilt it to one side and to the other."""
    for number in range(steps):
        if phone.drives and not phone.is_driving:
            phone.start()
        phone.hold(LEFT if number % 2 else RIGHT, STEP_S)


def from_the_hand_to_the_set_point(folder: Path) -> None:
    """Delay of a command, part by part."""
    with console(folder, *WORDS) as at:
        phone = Phone(at, "my phone")
        phone.take(0)
        phone.start()
        swing(phone, round(WARM_UP_S / STEP_S))
        phone.parts.clear()
        before = phone.line["phone"]
        swing(phone, STEPS)
        after = phone.line["phone"]
        phone.close()
    parts = np.array(phone.parts)
    whole, filtered, carried = parts.T
    way = whole - filtered - carried
    p50, p95 = np.percentile(whole, [50, 95])
    lost = after["samples_lost"] - before["samples_lost"]
    came = after["samples"] - before["samples"]
    print(f"\nhand to set point, {len(parts)} commands: p50 {p50:.1f} ms, p95 {p95:.1f} ms")
    shares = [np.median(part) for part in (way, filtered, carried)]
    names = ("batch, sockets, web process", "filter and wait for a command", "link and robot")
    for name, share in zip(names, shares, strict=True):
        print(f"  {name}: {share:.1f} ms, {100 * share / sum(shares):.0f} %")
    print(f"  samples lost: {lost} of {came} ({lost / (came / HZ):.2f} a second)")
    goal("hand to set point, p95 [ms]", p95, most=DELAY_MS)


def in_threads(what: Callable[[Phone], object], phones: list[Phone]) -> None:
    """All do something at once, in a thread each."""
    threads = [Thread(target=what, args=(phone,)) for phone in phones]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def two_phones(folder: Path) -> None:
    """Both drive."""
    phone_cost(folder, DRIVEN)


def twenty_phones(folder: Path) -> None:
    """Two of them drive."""
    phone_cost(folder, MANY)


def phone_cost(folder: Path, many: int) -> None:
    """CPU time and lost samples; two drive, what the others tell is shown on their screens."""
    with console(folder, *WORDS) as at:
        phones = [Phone(at, f"phone {n}") for n in range(many)]
        for number, phone in enumerate(phones[:DRIVEN]):
            phone.take(number)
        began, cpu = time.monotonic(), sum(at.cpu_s().values())
        in_threads(lambda phone: swing(phone, round(MANY_S / STEP_S)), phones)
        spent = (sum(at.cpu_s().values()) - cpu) / (time.monotonic() - began)
        reports = [phone.line["phone"] for phone in phones]
        drives = sum(phone.is_driving for phone in phones)
        cpu = sum(at.cpu_s().values())
        time.sleep(MANY_S)  # they are there, and say nothing
        idle = (sum(at.cpu_s().values()) - cpu) / MANY_S
        for phone in phones:
            phone.close()
    lost, came = (sum(one[key] for one in reports) for key in ("samples_lost", "samples"))
    whole = [part[0] for phone in phones for part in phone.parts] or [np.nan]
    print(
        f"\n{many} phones, {drives} of which drive: {1000 * spent:.0f} ms of CPU a "
        f"second, and {1000 * idle:.0f} ms when all are silent: "
        f"{1000 * (spent - idle) / many:.1f} ms for each phone; {lost} of {came} samples "
        f"lost; hand to set point p50 {np.median(whole):.1f} ms, "
        f"p95 {np.percentile(whole, 95):.1f} ms"
    )
    goal("samples lost, of 1,000", 1000 * lost / came, most=1.0)


NOTED = """async () => { window.ages = []; window.waits = [];
const drawn = await import('/static/js/drive/drawn.js');
const draw = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (...all) {
  draw.apply(this, all); queueMicrotask(() => window.ages.push(drawn.pictureAge(0))); };
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (text) { const line = JSON.parse(text);
  if (line.do === 'samples') window.waits.push(...line.at.map((at) => performance.now() - at));
  return send.call(this, text); }; }"""
CAMERA, WATCHED_S = "robot-1", 20.0


@contextmanager
def hand(folder: Path) -> Iterator[tuple[Hand, list[int]]]:
    """A phone's page in the system's Chromium that drives, and what its files weigh [B]."""
    weights: list[int] = []
    with console(folder, *WORDS) as at, chromium() as browser:
        context = browser.new_context(viewport={"width": 360, "height": 740}, has_touch=True)

        def weigh(answer: Response) -> None:
            if "/static/" in answer.url or answer.url.endswith("/phone"):
                weights.append(len(answer.body()))

        def tab() -> Page:
            page = context.new_page()
            page.on("response", weigh)
            return page

        visit = SimpleNamespace(context=context, tab=tab)
        yield Hand(visit, f"http://{at.place}/phone?token={at.phones}"), weights


def from_sensor_and_camera_in_a_browser(folder: Path) -> None:
    """From the sensor to the socket, and from the robot's camera to the screen."""
    with hand(folder) as (phone, weights):
        weight = sum(weights)
        phone.register()
        phone.take(CAMERA)
        expect(phone.page.get_by_text("is in your hands")).to_be_visible()
        phone.calibrate()
        phone.go("Teleoperation")
        phone.page.evaluate(NOTED)
        phone.page.wait_for_timeout(1000 * WATCHED_S)
        ages, waits = phone.page.evaluate("[window.ages, window.waits]")
    print(f"\nthe page weighs {weight / 1000:.0f} kB in {len(weights)} files")
    for name, found in (("camera to screen", ages), ("sensor to socket", waits)):
        p50, p95 = np.percentile(found, [50, 95])
        print(f"  {name}, {len(found)}: p50 {p50:.1f} ms, p95 {p95:.1f} ms")
