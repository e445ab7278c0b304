"""View of the bodies of a run for pages, and its story."""

from __future__ import annotations

import math
from collections.abc import Iterator

from typing_extensions import override

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.people.bystander import SAFE
from dva_sim.agents.people.person_guard import PersonGuard
from dva_sim.agents.robot.controller import Mode
from dva_sim.console.bench import BenchView, Status
from dva_sim.console.robots.shown_mode import MANUAL
from dva_sim.console.robots.stop_reasons import stop_reason
from dva_sim.console.run.lag import LagRule
from dva_sim.console.run.played_run import PlayedRun
from dva_sim.console.system.things import Things, camera_shown
from dva_sim.console.views.published_rows import place_shown
from dva_sim.console.wire.events import StoryLine
from dva_sim.console.wire.rows import DoingShown, RobotRow
from dva_sim.console.wire.scenes import Happened, ThingBody
from dva_sim.kernel.rates import Rate
from dva_sim.kernel.recorder import Moment, Recorder
from dva_sim.protocol import messages as m


class Feed(BenchView):
    """View of a run's bodies.

    Args:
        run: The run.
        lag: Rule that holds drives while the run lags.

    Attributes:
        things: Everybody.
        numbers: By which lines call them, by id or name.
    """

    def __init__(self, run: PlayedRun, lag: LagRule) -> None:
        self._run = run
        self._lag = lag
        self.things = Things()
        self.numbers = self.things.numbers
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

    # --- see `BenchView` -------------------------------------------------------------------

    @override
    def team(self) -> list[tuple[m.Device, str]]:
        field = self._run.field
        devices = [one.device for one in (*field.robots.values(), *field.guards)]
        return [(device_of(device), device.dva) for device in devices]

    @override
    def status(self, device: str) -> Status | None:
        field = self._run.field
        now = self._run.clock.now
        robot = field.robots.get(device)
        if robot is None:
            return None
        field.world.advance_to(now)
        x, y, heading = robot.body.pose()
        return m.RobotStatus(
            robot.controller.mode.value,
            m.Position(*self._run.stage.site.frame.to_latlon(x, y)),
            heading,
            robot.body.speed,
            robot.body.turn_rate,
            robot.controller.tick(now),
        )

    @override
    def places(self) -> list[list[int]]:
        return [
            place_shown(
                self.numbers[name],
                who.walking.place,
                who.heading,
                who.walking.speed if who.walking.walks else 0.0,
            )
            for name, who in self._run.field.people()
            if who.activity != SAFE
        ]

    @override
    def people(self) -> list[DoingShown]:
        return [
            {"i": self.numbers[name], "doing": who.activity}
            for name, who in self._run.field.people()
        ]

    @override
    def complete(self, robot: str, row: RobotRow) -> None:
        agent = self._run.field.robots.get(robot)
        if agent is None:
            return
        run = self._run
        now = run.clock.now
        point = agent.set_point
        controller = agent.controller
        drive = run.recorder.newest_drive.get(robot)
        is_driven = controller.mode is Mode.TELEOPERATION
        in_force = now < point.until
        if row["emergency"] is not None:
            row["emergency"]["released_by"] = controller.latch.released_by or ""
        elif controller.by_hand is not None:
            row["mode"] = MANUAL
        row.update(
            {
                "by_hand": controller.by_hand is not None,
                "battery": round(agent.charge, 3),
                "watchdog_left_s": round(max(0.0, point.until - now), 2) if is_driven else None,
                "stop_reason": stop_reason(agent, now, self._lag.held),
                "set_speed_mps": round(point.speed, 3) if in_force else 0.0,
                "set_turn_rate_radps": round(point.turn_rate, 3) if in_force else 0.0,
                "queue": len(agent.inbox),
                "lost": sum(link.lost + link.dropped for link in run.links.get(robot, ())),
                "commands_hz": self.commands_hz(robot),
                "refused": agent.refused,
                "timeouts": 0 if drive is None else drive.timeouts,
            }
        )
        del row["camera"]  # its pictures are drawn here

    def commands_hz(self, robot: str) -> float:
        """Return the commands of a robot that take effect in a second."""
        now = self._run.clock.now
        if now - self._rated >= 1.0:
            self._rated = now
            for id_tag, agent in self._run.field.robots.items():
                rate = self._rates.setdefault(id_tag, Rate())
                self._commands_hz[id_tag] = round(rate.of(agent.applied, now), 1)
        return self._commands_hz[robot]


def device_of(device: AgentDevice) -> m.Device:
    """Return a device as it stands in a list of devices."""
    return m.Device(device.id_tag, device.label, device.device_type, device.address)


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
