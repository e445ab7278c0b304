"""A world that is not one, for work on the pages: `python tests/console/fake_world.py --no-token`.

It runs the web process as its child, moves invented robots over a real site, grows invented
hazards, paints numbers instead of camera pictures, and roughly obeys anyone who takes control.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw

sys.path[:0] = [str(Path(__file__).parents[2]), str(Path(__file__).parent)]
sys.path.append(str(Path(__file__).parents[1]))

from fake_control_room import FakeControlRoom  # noqa: E402
from fake_dva import FakeDva  # noqa: E402
from fake_phones import FakePhone, FakePhones  # noqa: E402
from fake_scene import LINK, MODELLED, Scene, Walker  # noqa: E402
from helpers.console.declared_lines import checked  # noqa: E402

from dva_sim.cameras.frames import ALIVE, Picture, pack  # noqa: E402

STEP = 0.02  # [s]
SILENT_S = 5.0  # without input; longer than in the real world: pages may be late [s]


class Seat:
    """Somebody's control over some robots."""

    def __init__(self, name: str) -> None:
        self.name, self.robots, self.phase = name, list[Walker](), "free"
        self.wanted, self.heard, self.n, self.sent = (0.0, 0.0), 0.0, 0, 0
        self.alert = ""
        self.phone: FakePhone | None = None
        self.late: deque[tuple[float, int, float, float]] = deque()
        self.command = (0.0, 0.0)
        self.applied = {"n": 0, "at_ms": 0.0}

    def line(self, world: FakeWorld) -> dict[str, Any]:
        """The line `seat`."""
        age = 1000 * world.link["delay_s"] + 60 + 20 * math.sin(world.t)
        return {
            "k": "seat",
            "seat": self.name,
            "label": "",
            "phase": self.phase,
            "order": None,
            "alert": self.alert,
            "phone": self.phone.line(self.command) if self.phone else None,
            "drives": [
                {
                    "i": robot.index,
                    "pattern": robot.pattern,
                    "phase": self.phase,
                    "mode": robot.mode,
                    "session": 1,
                    "wanted": self.wanted,
                    "command": self.command,
                    "sent": self.sent,
                    "answered": self.sent,
                    "timeouts": 0,
                    "refused": 0,
                    "superseded": 0,
                    "command_age_ms": round(age, 1),
                    "round_trip_ms": round(2 * age, 1),
                    "outcome": None,
                    "picture_arrived_ms": None,
                    "picture_ms": world.ms - round(1000 * world.link["delay_s"]),
                    "loop_ms": round(age + 30, 1),
                    "input": self.applied,
                }
                for robot in self.robots
            ],
        }


class FakeWorld(FakePhones, FakeControlRoom):
    """The fake itself.

    Args:
        options: Options of the command line.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self.scene = Scene(options.site, options.robots, options.people, options.hostile)
        self.t, self.factor, self.paused = 0.0, 1.0, False
        self.link = dict(LINK)
        self.events: Any = None  # as told last
        self.seats: dict[str, Seat] = {}
        self.watched: set[int] = set()
        self.toured = False  # from then on robots that nobody drives stand
        self.done: dict[str, dict[str, Any]] = {}
        self.phones, self.guards = 0, dict[str, dict[str, Any]]()
        self.dva, self.looked = FakeDva(), frozenset[str]()
        self.more: dict[str, Any] = {}  # of the answer to an action
        self.pictures = not options.no_pictures
        self.socket, theirs = socket.socketpair()
        self.painter, their_painter = socket.socketpair()
        words = [sys.executable, "-m", "dva_sim.console.web", "--fd", str(theirs.fileno())]
        words += ["--pictures-fd", str(their_painter.fileno()), "--port", str(options.port)]
        words += ["--no-token"] if options.no_token else []
        self.folder = tempfile.TemporaryDirectory()
        self.hostile = options.hostile
        words += ["--audit", str(self.open_audit_log(options.audit or self.folder.name))]
        if options.phones:
            words += ["--phones-host", "127.0.0.1", "--phones-port", "0"]
            words += ["--certificates", self.folder.name]
        numbers = theirs.fileno(), their_painter.fileno()
        folder = Path(__file__).parents[2]
        self.child = subprocess.Popen(words, pass_fds=numbers, cwd=folder)
        theirs.close()
        their_painter.close()
        self.rest, self.out, self.frame_number = b"", b"", 0

    @property
    def ms(self) -> int:
        """Virtual time [ms]."""
        return round(self.t * 1000)

    # --- lines -------------------------------------------------------------------------

    def say(self, line: dict[str, Any]) -> None:
        """Write a line, whatever that takes; the real world never waits here."""
        if line["k"] != "log":
            line.setdefault("t", self.ms)
        checked(line)
        self.socket.sendall(json.dumps(line, separators=(",", ":")).encode() + b"\n")

    def listen(self, wait: float) -> bool:
        """Obey what arrives within some seconds: False if nobody is there any more."""
        ready, _, _ = select.select([self.socket, self.painter], [], [], wait)
        if self.painter in ready:
            self.painter.recv(65536)  # who is watched, which the world was told, too
        if self.socket in ready:
            data = self.socket.recv(65536)
            if not data:
                return False
            *lines, self.rest = (self.rest + data).split(b"\n")
            for line in lines:
                self.obey(json.loads(line))
        return True

    def obey(self, asked: dict[str, Any]) -> None:
        """Do as asked, once, and say so."""
        what, key = asked["do"], asked.get("id")
        if key in self.done:
            self.say(self.done[key])
            return
        ok, text, self.more = True, "done", {}
        try:
            text = getattr(self, f"do_{what}")(asked) or text
        except (KeyError, ValueError, AttributeError) as error:
            ok, text, self.more = False, str(error), {"outcome": "refused"}
        if key is not None:
            more = {"tour": self.scene.tour()} if what == "tour" else self.more
            self.done[key] = {"k": "done", "id": key, "ok": ok, "text": text, **more}
            self.say(self.done[key])
            if what.startswith(("event", "alarm", "dispatch", "room")) and "proposal" not in what:
                self.tell_events()

    # --- actions -----------------------------------------------------------------------

    def do_serving(self, asked: dict[str, Any]) -> None:
        print(f"Console: {asked['supervise']}", flush=True)
        print(f"Look only: {asked['look']}", flush=True)
        print(f"Phone: {asked['phone']}", flush=True)
        self.say(self.scene.line())
        self.say(self.dva.log(self.ms, 12))

    def do_look(self, asked: dict[str, Any]) -> None:
        self.looked = frozenset(asked["tables"])
        self._tell_devices()

    def _tell_devices(self) -> None:
        if "devices" in self.looked:
            self.say(self.dva.devices(self.scene.robots))

    def do_server_stop(self, asked: dict[str, Any]) -> str:
        self.dva.listens = False
        self.say(self.rows())
        return "the server is stopped"

    def do_server_start(self, asked: dict[str, Any]) -> None:
        self.dva.listens, self.dva.port = True, asked["port"]
        self.say(self.rows())

    def do_fake_add(self, asked: dict[str, Any]) -> None:
        number = f"02:00:00:0F:00:{len(self.dva.fakes) + 1:02X}"
        self.dva.fakes.append(self.dva.row(asked["label"], number, fake=True, link=None))
        self._tell_devices()

    def do_tour(self, asked: dict[str, Any]) -> str:
        self.toured = True
        for robot in self.scene.robots:
            robot.wanted = (0.0, 0.0)
        return "two goals"

    def do_tour_time(self, asked: dict[str, Any]) -> None:
        print(f"Tour: robot {asked['robot']} took {asked['took_s']:.1f} s", flush=True)

    def do_here(self, asked: dict[str, Any]) -> None:
        """Pages of the fake world may come and go."""

    def do_watch(self, asked: dict[str, Any]) -> None:
        self.watched = set(asked["robots"])

    def do_take(self, asked: dict[str, Any]) -> str:
        seat = self.own_seat(asked["client"])
        robots = [self.scene.all[i] for i in asked["robots"]]
        for other in self.seats.values():
            if other is not seat and set(other.robots) & set(robots):
                raise ValueError(f"BUSY: held by {other.name}")
        seat.robots, seat.phase = robots, "held"
        for robot in robots:
            robot.wanted = (0.0, 0.0)
        self.tell(seat)
        return "control taken"

    def own_seat(self, client: str) -> Seat:
        return self.seats.setdefault(client, Seat(client))

    def seat_of(self, asked: dict[str, Any]) -> Seat:
        return self.seats.get(asked["client"]) or Seat(asked["client"])

    def tell(self, seat: Seat) -> None:
        self.say(seat.line(self))
        self.say(self.rows())

    def do_release(self, asked: dict[str, Any]) -> None:
        seat = self.seat_of(asked)
        self.halt(seat, "free")
        for robot in seat.robots:
            robot.wanted = (0.0, 0.0) if self.toured else None
        seat.robots = []
        if seat.phone:
            seat.phone.device = seat.phone.level = None
        self.tell(seat)

    def halt(self, seat: Seat, phase: str) -> None:
        seat.phase, seat.wanted, seat.command = phase, (0.0, 0.0), (0.0, 0.0)
        seat.late.clear()
        for robot in seat.robots:
            robot.mode, robot.wanted = "Idle", (0.0, 0.0)

    def do_start(self, asked: dict[str, Any]) -> None:
        seat = self.seat_of(asked)
        if not seat.robots:
            raise ValueError("take control of a robot first")
        seat.phase, seat.alert, seat.heard = "driving", "", time.monotonic()
        for robot in seat.robots:
            robot.mode = "Teleoperation"
        self.tell(seat)

    def do_stop(self, asked: dict[str, Any]) -> None:
        seat = self.seat_of(asked)
        self.halt(seat, "held" if seat.robots else "free")
        self.tell(seat)

    def do_gone(self, asked: dict[str, Any]) -> None:
        seat = self.seat_of(asked)
        if seat.phase == "driving":
            seat.alert = "stopped: the page went away"
            self.do_stop(asked)

    def do_emergency(self, asked: dict[str, Any]) -> str:
        own = [robot.index for robot in self.seat_of(asked).robots]
        asked.setdefault("robots", own)
        for seat in self.seats.values():
            if asked["robots"] == "all" or {r.index for r in seat.robots} & set(asked["robots"]):
                seat.alert = "emergency stop"
                self.halt(seat, "held" if seat.robots else "free")
                self.tell(seat)
        for robot in self.scene.robots:
            if asked["robots"] == "all" or robot.index in asked["robots"]:
                robot.mode, robot.wanted = "Idle", (0.0, 0.0)
        self.say(self.rows())
        self.say({"k": "story", "who": "console", "what": "emergency stop", "kind": "emergency"})
        return "robots stop"

    def do_input(self, asked: dict[str, Any]) -> None:
        seat = self.seat_of(asked)
        seat.heard, seat.n = time.monotonic(), asked["n"]
        if seat.phase == "driving":
            wanted = (asked["speed"], asked["turn"]) if asked["held"] else (0.0, 0.0)
            seat.wanted = wanted[0] * 0.5, wanted[1] * 0.5236
            due = time.monotonic() + self.link["delay_s"]
            seat.late.append((due, asked["n"], *seat.wanted))

    def do_link(self, asked: dict[str, Any]) -> None:
        self.link.update({key: value for key, value in asked.items() if key in LINK})
        self.say(self.rows())

    def do_pattern(self, asked: dict[str, Any]) -> None:
        self.scene.all[asked["robot"]].pattern = asked["name"]
        self.say(self.rows())

    def do_pace(self, asked: dict[str, Any]) -> None:
        self.factor = asked.get("factor", self.factor)
        self.paused = asked.get("paused", self.paused)
        self.say(self.rows())

    def do_confirm(self, asked: dict[str, Any]) -> str:
        raise ValueError("no order is in hand")

    do_refute = do_decline = do_confirm

    # --- what is told regularly ----------------------------------------------------------

    def rows(self) -> dict[str, Any]:
        holders = {robot.index: seat for seat in self.seats.values() for robot in seat.robots}
        clock = {"factor": self.factor, "paused": self.paused, "lag_s": 0.004, "given_up_s": 0.0}
        return {
            "k": "rows",
            "t": self.ms,
            "clock": clock | {"held_by_lag": False},
            "link": {**MODELLED, **self.link},
            "dropped": 0,
            "server": self.dva.server(),
            "robots": [self._row(robot, holders.get(robot.index)) for robot in self.scene.robots],
            "people": [{"i": p.index, "doing": "walks"} for p in self.scene.people],
            "order": None,
        }

    def _row(self, robot: Walker, seat: Seat | None) -> dict[str, Any]:
        left = 3.0 - (time.monotonic() - seat.heard) if seat and seat.phase == "driving" else None
        return {
            "i": robot.index,
            "mode": robot.mode,
            "pattern": robot.pattern,
            "battery": round(robot.battery, 3),
            "holder": seat.name if seat else None,
            "holder_label": f"console {seat.name}" if seat else None,
            "session_age_s": 1.0 if seat else None,
            "watchdog_left_s": None if left is None else round(max(0.0, left), 2),
            "stop_reason": "nobody has started it" if seat and robot.mode == "Idle" else "",
            "set_speed_mps": round(robot.speed, 3),
            "set_turn_rate_radps": 0.0,
            "queue": 0,
            "lost": 0,
            "commands_hz": 10.0 if left is not None else 0.0,
            "refused": 0,
            "timeouts": 0,
            "emergency": None,
        }

    # --- time ----------------------------------------------------------------------------

    def step(self) -> None:
        """Go on by a step of real time."""
        now = time.monotonic()
        for seat in self.seats.values():
            self._apply(seat, now)
        if self.paused:
            return
        dt = STEP * self.factor
        self.t += dt
        for walker in self.scene.all:
            walker.step(dt)

    def _apply(self, seat: Seat, now: float) -> None:
        if seat.phase != "driving":
            return
        if now - seat.heard > SILENT_S and (seat.wanted != (0.0, 0.0)):
            seat.alert = "stopped: no input"
            self.halt(seat, "held")
            self.tell(seat)
            return
        while seat.late and seat.late[0][0] <= now:
            _, n, *command = seat.late.popleft()
            seat.command, seat.sent = (command[0], command[1]), seat.sent + 1
            seat.applied = {"n": n, "at_ms": time.time() * 1000}
            for robot in seat.robots:
                robot.wanted = seat.command

    def paint(self) -> None:
        """Numbers instead of pictures."""
        self.frame_number += 1
        for index in sorted(self.watched):
            picture = self._picture(self.scene.all[index])
            captured = self.ms - round(1000 * self.link["delay_s"])
            self._send(Picture(index, self.frame_number, captured, self.ms, picture))
        self._send(Picture(ALIVE, 0, self.ms, self.ms, b""))

    def _picture(self, robot: Walker) -> bytes:
        image = Image.new("RGB", (320, 240), "#4a5561")
        draw = ImageDraw.Draw(image)
        draw.rectangle((0, 120, 320, 240), fill="#8b8478")
        x = 160 - math.degrees(robot.heading) * 3 % 640 + 160
        draw.rectangle((x - 20, 60, x + 20, 180), fill="#d1332e")
        draw.text((8, 8), f"{robot.label}\nframe {self.frame_number}\n{self.t:.2f} s", fill="white")
        data = io.BytesIO()
        image.save(data, "JPEG", quality=80)
        return data.getvalue()

    def _send(self, picture: Picture) -> None:
        self.painter.setblocking(False)
        try:
            while self.out:
                self.out = self.out[self.painter.send(self.out) :]
            self.out = pack(picture)
            self.out = self.out[self.painter.send(self.out) :]
        except BlockingIOError:
            pass

    def run(self) -> None:
        """Until nobody listens any more, or who started it is gone: a test that was killed."""
        ticks, due, parent = 0, time.monotonic(), os.getppid()
        while os.getppid() == parent:
            if not self.listen(max(0.0, due - time.monotonic())):
                return
            if time.monotonic() < due:
                continue
            due, ticks = max(due + STEP, time.monotonic() - 1), ticks + 1
            self.step()
            if ticks % 5 == 0:
                self.say({"k": "pos", "p": [walker.row() for walker in self.scene.all]})
                if self.pictures:
                    self.paint()
            self._regularly(ticks)

    def tell_events(self) -> None:
        """Events and what hangs on them, when they change, as the real world does."""
        lines = [self.with_decisions(self.scene.events(self.t)), *self.dispatch_lines()]
        if lines != self.events:
            self.events = lines
            for line in lines:
                self.say(line)

    def _regularly(self, ticks: int) -> None:
        if ticks % 25 == 1:
            self.say(self.rows())
        if ticks % 50 == 2:
            self.say(self.scene.hazards(self.t) | {"t": self.ms})
        if ticks % 100 == 3:
            self.tell_events()
            who = self.scene.all[ticks % len(self.scene.all)].label
            self.say({"k": "story", "who": who, "what": "looks around", "kind": "event"})
            self.say(self.dva.log(self.ms, 1))
            self._tell_devices()
        for seat in self.seats.values():
            if (seat.robots or seat.phone) and ticks % 3 == 0:
                self.say(seat.line(self))


def main() -> None:
    """Run until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--no-token", action="store_true")
    parser.add_argument("--phones", action="store_true", help="an address for phones, by https")
    parser.add_argument("--no-pictures", action="store_true")
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--people", type=int, default=100)
    parser.add_argument("--site", default="caparica", help="or office-block, campus, ...")
    parser.add_argument("--audit", help="file of its audit log")
    parser.add_argument("--hostile", action="store_true", help="a robot is called <script>")
    world = FakeWorld(parser.parse_args())
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        world.run()
    except (KeyboardInterrupt, ConnectionError):
        pass
    finally:
        with suppress(OSError):
            world.say({"k": "bye", "why": "Ctrl-C"})
        world.child.wait(5)


if __name__ == "__main__":
    main()
