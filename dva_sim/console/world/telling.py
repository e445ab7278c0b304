"""Updates of a console's world for pages: each on change, and no more often."""

from __future__ import annotations

import time
from collections.abc import Callable

from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.cameras.lines import Show, contained_line
from dva_sim.cameras.screens import Screens
from dva_sim.console.audit.audited import Audited
from dva_sim.console.driving.seat_lines import SeatLines
from dva_sim.console.dva.dva_pages import DvaPages
from dva_sim.console.events.console_alarms import ConsoleAlarms
from dva_sim.console.events.rooms import ConsoleRooms
from dva_sim.console.guards.played_guards import PlayedGuards
from dva_sim.console.phones.phones import Phones
from dva_sim.console.robots.robot_windows import RobotWindows
from dva_sim.console.robots.stop_reasons import stop_reason
from dva_sim.console.run.lag import LagRule
from dva_sim.console.run.recorder import ConsoleRecorder
from dva_sim.console.run.sliders import LinkSliders
from dva_sim.console.views.event_rows import event_rows
from dva_sim.console.views.feed import Feed
from dva_sim.console.views.fields import HazardFeed
from dva_sim.console.views.foreign_devices import ForeignDevices
from dva_sim.console.views.logs import Logs
from dva_sim.console.views.news import News, clock_shown
from dva_sim.console.views.scene import scene_of
from dva_sim.console.wire.events import SiteEventShown
from dva_sim.console.wire.limits import LOG_PERIOD
from dva_sim.console.wire.lines import Tell
from dva_sim.console.wire.rows import RobotRow, RowsLine
from dva_sim.network.realtime import PacedClock
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.scenario import Scenario

# From one line to the next, real time [s].
POSITIONS = 0.1
WINDOWS = 0.1
ROWS = 0.5
HAZARDS = 1.0
DEVICES = 1.0
TIDY = 1.0
ASK = 2.0
SOON = 0.05  # from one look at what has changed to the next, real time [s]


class PublishingWorld:
    """World that publishes its changes to pages.

    It says when and how; what there is to be told belongs to the world that this is the base of.
    """

    clock: PacedClock
    recorder: ConsoleRecorder
    scenario: Scenario
    name: str
    seed: int
    run: Run
    feed: Feed
    lag: LagRule
    sliders: LinkSliders
    phones: Phones
    windows: RobotWindows
    foreign: ForeignDevices
    seat_lines: SeatLines
    screens: Screens
    logs: Logs
    hazards: HazardFeed
    rooms: ConsoleRooms
    alarms: ConsoleAlarms
    guards: PlayedGuards
    dva: DvaPages
    audited: Audited | None
    tell: Tell
    show: Show
    dropped: Callable[[], int]

    def __init__(self) -> None:
        self._news = News(lambda: self.tell)
        self._modes: list[object] = []
        self._events: list[SiteEventShown] = []
        self._contained: dict[int, float] = {}
        self._is_asking = False

    def show_scene(self) -> None:
        """Send the whole scene to the renderer."""
        raise NotImplementedError

    def begin(self) -> None:
        """Tell the scene, and from then on what changes."""
        self.tell_scene()
        self.show_scene()
        self.clock.pulse(POSITIONS, self._tell_positions)
        self.clock.pulse(WINDOWS, self._tell_windows)
        self.clock.pulse(ROWS, self._tell_rows)
        self.clock.pulse(HAZARDS, self._tell_hazards)
        self.clock.pulse(SOON, self._tell_news)
        self.clock.pulse(LOG_PERIOD, self._tell_logs)
        self.clock.pulse(DEVICES, self._tell_devices)
        self.clock.pulse(TIDY, self.recorder.tidy)
        self.clock.pulse(ASK, self._ask_the_dva)

    def tell_scene(self) -> None:
        """Tell what does not change, but for where the DVA listens."""
        run = self.run
        scene = scene_of(
            self.scenario,
            site=run.stage.site,
            incidents=run.field.incidents,
            things=self.feed.things.all,
            link=self.sliders.line(),
            name=self.name,
            seed=self.seed,
        )
        scene["dva_address"], scene["phone"] = self.phones.address, self.phones.offer()
        self.tell(scene)

    def _tell_audit(self) -> None:
        if self.audited is not None:
            self._news.tell(self.audited.keeper.line(self.feed.now_ms))

    def _tell_positions(self) -> None:
        line = self.feed.positions()
        line["p"] += self.foreign.positions()
        self._news.tell(line)

    def _tell_rows(self) -> None:
        self.lag.measured(time.monotonic(), self.clock.worst_lag())
        rows: RowsLine = {
            "k": "rows",
            "t": self.feed.now_ms,
            "clock": clock_shown(self.clock, self.lag),
            "link": self.sliders.line(),
            "dropped": self.dropped(),
            "server": self.dva.bench.server(),
            "robots": [
                *self.feed.robots(self.lag.held),
                *self.foreign.robots(),
            ],
            "people": self.feed.people(),
            "order": self.seat_lines.waiting_order(),
        }
        self.tell(rows)
        self._tell_alarms(rows["robots"])

    def _ask_the_dva(self) -> None:
        """Ask who is there, and for cameras from outside, unless an answer is still to come."""
        if self._is_asking:
            return
        self._is_asking = True

        def ended(reply: m.Reply | None = None) -> None:
            self._is_asking = False
            listed = reply.content if reply is not None else None
            if isinstance(listed, m.DeviceList) and self.foreign.take_list(listed.devices):
                self.tell_scene()

        self.rooms.listener.ask(m.GetDeviceList(), ended, ended)
        if self.foreign.is_anybody:
            self.rooms.listener.ask(m.GetSensorInfo(), self.foreign.note_cameras)

    def _tell_windows(self) -> None:
        def reason_of(robot: RobotAgent) -> str:
            return stop_reason(robot, self.clock.now, self.lag.held)

        for line in self.windows.lines(self.screens.watched, reason_of):
            self._news.tell(line, line["i"])

    def _tell_devices(self) -> None:
        line = self.dva.devices(self.feed.now_ms)
        if line is not None:
            self.tell(line)

    def _tell_logs(self) -> None:
        for line in self.logs.batches():
            self.tell(line)

    def _tell_hazards(self) -> None:
        self._news.tell(self.hazards.line(self.feed.now_ms))
        for number, when in self.run.field.contained.items():
            if self._contained.get(number) != when:
                self._contained[number] = when
                self.show(contained_line(number, when))

    def _tell_news(self) -> None:
        """Events, story and seats, as soon as they change; rows when a mode or holder does."""
        self._tell_events()
        for line in self.feed.story():
            self.tell(line)
        robots = self.run.field.robots.values()
        modes: list[object] = [(robot.controller.mode, robot.holder[0]) for robot in robots]
        if self._modes != modes:
            self._modes = modes
            self._tell_rows()
        self._tell_seats()
        self._tell_audit()

    def _tell_events(self) -> None:
        """Events with what was decided on them, and who decides."""
        stage = self.run.stage
        now_ms = self.feed.now_ms
        self._events = event_rows(self.rooms.listener, stage.labels, stage.site, stage.site.frame)
        self._news.tell({"k": "events", "t": now_ms, "events": self._events})
        self._news.tell(self.rooms.line(now_ms))

    def _tell_alarms(self, robots: list[RobotRow]) -> None:
        self._news.tell(self.alarms.look(self._events, robots, self.feed.now_ms))

    def _tell_seats(self) -> None:
        for client, line in self.seat_lines.lines():
            self._news.tell(line, client)
        for client, played in self.guards.lines():
            self._news.tell(played, client)

    def free_seat(self, client: str) -> None:
        """Free a client's seat and notify the client."""
        self.tell(self.seat_lines.free(client), client)
        self._news.forget("seat", client)

    def tell_now(self) -> None:
        """Publish at once instead of in the next period."""
        self._tell_rows()
        self._tell_seats()
        self._tell_audit()
