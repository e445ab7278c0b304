"""Feed of a running world for pages: positions, and states of robots and events."""

from __future__ import annotations

import math
from collections.abc import Iterator

from dva_sim.agents.people.bystander import SAFE
from dva_sim.agents.people.person_guard import PersonGuard
from dva_sim.agents.robot.controller import Mode
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.console.robots.shown_mode import latch_shown, shown_mode
from dva_sim.console.robots.stop_reasons import stop_reason
from dva_sim.console.run.played_run import PlayedRun
from dva_sim.console.system.things import Things, camera_shown
from dva_sim.console.wire.events import StoryLine
from dva_sim.console.wire.rows import DoingShown, RobotRow
from dva_sim.console.wire.scenes import Happened, ThingBody
from dva_sim.kernel.rates import Rate
from dva_sim.kernel.recorder import Moment, Recorder


class Feed:
    """Lines about a run.

    Attributes:
        things: Everybody.
        numbers: By which lines call them, by id or name.
        stoppers: Device and name of the person who stopped a robot from a page, by its id.
    """

    def __init__(self, run: PlayedRun) -> None:
        self._run = run
        self.things = Things()
        self.numbers = self.things.numbers
        self.stoppers: dict[str, tuple[str, str]] = {}
        self._rates: dict[str, Rate] = {}
        self._commands_hz: dict[str, float] = {}
        self._rated = -math.inf
        self._number_all()

    @property
    def now_ms(self) -> int:
        """Virtual time [ms]."""
        return round(self._run.clock.now * 1000)

    def _number_all(self) -> None:
        camera = camera_shown(self._run.scenario.camera)
        for robot in self._run.field.robots.values():
            spec = robot.body.spec
            body: ThingBody = {
                "radius_m": spec.radius,
                "max_speed_mps": spec.max_speed,
                "max_turn_rate_radps": spec.max_turn_rate,
                "camera": camera,
            }
            self.things.add(robot.device.id_tag, robot.device.label, "robot", body)
        for name, who in self._run.field.people():
            device = getattr(who, "device", None)
            kind = "bystander" if device is None else "guard"
            id_tag = name if device is None else device.id_tag
            walks: ThingBody = {"radius_m": who.walking.body.radius}
            if isinstance(who, PersonGuard):
                walks["person"] = True
            self.things.add(id_tag, name, kind, walks)

    # --- where everybody is ----------------------------------------------------------------

    def positions(self) -> list[list[int]]:
        """Return the positions of everybody on the site; see `PlacesLine`."""
        field = self._run.field
        field.world.advance_to(self._run.clock.now)
        rows = []
        for id_tag, robot in field.robots.items():
            body = robot.body
            pose = body.pose()
            speed = round(1000 * body.speed)
            rows.append(self._at(id_tag, pose.x, pose.y, pose.heading, speed))
        for name, who in field.people():
            if who.activity != SAFE:
                x, y = who.walking.place
                speed = round(1000 * who.walking.speed) if who.walking.walks else 0
                rows.append(self._at(name, x, y, who.heading, speed))
        return rows

    def _at(self, name: str, x: float, y: float, heading: float, speed: int) -> list[int]:
        turn = math.remainder(heading, 2.0 * math.pi)
        return [self.numbers[name], round(100 * x), round(100 * y), round(1000 * turn), speed]

    # --- how they are ----------------------------------------------------------------------

    def robots(self, held_by_lag: bool) -> list[RobotRow]:
        """Return a row for each robot."""
        now = self._run.clock.now
        if now - self._rated >= 1.0:
            self._rated = now
            for id_tag, robot in self._run.field.robots.items():
                rate = self._rates.setdefault(id_tag, Rate())
                self._commands_hz[id_tag] = round(rate.of(robot.applied, now), 1)
        return [self._robot(robot, held_by_lag) for robot in self._run.field.robots.values()]

    def _robot(self, robot: RobotAgent, held_by_lag: bool) -> RobotRow:
        run = self._run
        id_tag = robot.device.id_tag
        now = run.clock.now
        (holder, held_for) = robot.holder
        point = robot.set_point
        driven = robot.controller.mode is Mode.TELEOPERATION
        drive = run.recorder.newest_drive.get(id_tag)
        return {
            "i": self.numbers[id_tag],
            "mode": shown_mode(robot.controller),
            "emergency": latch_shown(
                robot.controller.latch, run.stage.labels, self.stoppers.get(id_tag)
            ),
            "by_hand": robot.controller.by_hand is not None,
            "pattern": self.pattern_of(id_tag),
            "battery": round(robot.charge, 3),
            "holder": holder,
            "holder_label": None if holder is None else run.stage.labels.get(holder, holder),
            "session_age_s": round(held_for, 1) if holder else None,
            "watchdog_left_s": round(max(0.0, point.until - now), 2) if driven else None,
            "stop_reason": stop_reason(robot, now, held_by_lag),
            "set_speed_mps": round(point.speed, 3) if now < point.until else 0.0,
            "set_turn_rate_radps": round(point.turn_rate, 3) if now < point.until else 0.0,
            "queue": len(robot.inbox),
            "lost": sum(link.lost + link.dropped for link in run.links.get(id_tag, ())),
            "commands_hz": self._commands_hz.get(id_tag, 0.0),
            "refused": robot.refused,
            "timeouts": 0 if drive is None else drive.timeouts,
        }

    def pattern_of(self, robot: str) -> str:
        """Return the name of the pattern by which a robot is driven next, or now."""
        return self._run.stage.pattern_name(robot)

    def people(self) -> list[DoingShown]:
        """Return the activities of people on foot."""
        return [
            {"i": self.numbers[name], "doing": who.activity}
            for name, who in self._run.field.people()
        ]

    # --- what happens ----------------------------------------------------------------------

    def story(self) -> Iterator[StoryLine]:
        """Yield the story since the last call; it is forgotten then."""
        return story_of(self._run.recorder)


def story_of(recorder: Recorder) -> Iterator[StoryLine]:
    """Yield what a recorder was told since the last call; it is forgotten then."""
    moments = recorder.timeline
    recorder.timeline = list[Moment]()
    for moment in moments:
        yield {"k": "story", **moment_shown(moment)}


def moment_shown(moment: Moment) -> Happened:
    """Return a moment of a story."""
    time, who, what, kind = moment
    return {"t": round(1000 * time), "who": who, "what": what, "kind": kind}
