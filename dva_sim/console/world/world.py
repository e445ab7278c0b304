"""World of a console: a run on a paced clock, people's seats in it, and published state.

One thread does everything, and waits for nobody: lines to other processes go into outboxes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from dva_sim.agents.observation import Cameras
from dva_sim.agents.operator.handheld import Console
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.cameras.lines import FrameLine, Show, contained_line, scene_line
from dva_sim.cameras.screens import Screens, camera_url, topic_of
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.audit.audited import Audited, name_of_page
from dva_sim.console.driving.seat_lines import SeatLines
from dva_sim.console.dva.dva_pages import DvaPages
from dva_sim.console.dva.run_bench import RunBench
from dva_sim.console.events.console_alarms import ConsoleAlarms
from dva_sim.console.events.rooms import ConsoleRooms
from dva_sim.console.guards.played_guards import PlayedGuards
from dva_sim.console.phones.phones import Phones
from dva_sim.console.robots.robot_windows import RobotWindows
from dva_sim.console.robots.stop_reasons import stop_reason
from dva_sim.console.run.lag import LagRule
from dva_sim.console.run.real_links import MakeSockets
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
from dva_sim.console.world.driven_run import PEOPLE, DrivenRun
from dva_sim.kernel.errors import DvaSimError
from dva_sim.network.realtime import PacedClock
from dva_sim.protocol import messages as m
from dva_sim.recordings.audit_log import AuditRow, plain_row
from dva_sim.simulation.full.control_room import console_of
from dva_sim.simulation.full.run import Run, Watched
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.simulation.scenario import Scenario

SCREEN = 0xFFFF  # number of the console's own screen among consoles

# From one line to the next, real time [s].
POSITIONS = 0.1
WINDOWS = 0.1
ROWS = 0.5
HAZARDS = 1.0
DEVICES = 1.0
TIDY = 1.0
ASK = 2.0
SOON = 0.05  # from one look at what has changed to the next, real time [s]


class ConsoleWorld:
    """Running world with its published state.

    Args:
        name: Name of the scenario.
        seed: Random seed.
        clock: Its time; default: real time.
        sockets: Function that makes the transport of the messages; default: the link that the
            scenario models.
        measured: True to keep everything for measuring in the end.

    Attributes:
        clock: Virtual time, at its pace.
        sockets: Sockets of the messages, if the links are real.
        run: The run.
        logs: Requests to devices, and their replies.
        windows: Those of the robots.
        dva: The DVA as people see and serve it.
        tell: Callback for lines to pages, with a key where only the newest counts.
        show: Callback for lines to the renderer, with a key likewise.

    Raises:
        ConfigError: the site cannot hold the team, or the events.
    """

    def __init__(
        self,
        scenario: Scenario,
        name: str,
        seed: int,
        clock: PacedClock | None = None,
        sockets: MakeSockets | None = None,
        measured: bool = False,
    ) -> None:
        self._news = News(lambda: self.tell)
        self._modes: list[object] = []
        self._events: list[SiteEventShown] = []
        self._contained: dict[int, float] = {}
        self._is_asking = False
        if scenario.transport == "zeromq" and scenario.network_depth == "auto":
            # A later link may lose or delay anything: only the segments are right for all.
            scenario = scenario.model_copy(update={"network_depth": "segment"})
        self.scenario = scenario
        self.name = name
        self.seed = seed
        self.clock = clock or PacedClock()
        self.recorder = ConsoleRecorder()
        cameras = Cameras(lambda label, _: camera_url("http:///", label), topic_of)
        self.sockets = sockets(scenario, self.clock, self.recorder) if sockets else None
        watched = Watched(
            self.clock, self.recorder, cameras, PEOPLE, measured, self.sockets, attended=True
        )
        try:
            self.run = Run(scenario, seed, watched=watched)
        except DvaSimError:
            if self.sockets is not None:
                self.sockets.close()
            raise
        self.feed = Feed(self.run)
        self.lag = LagRule()
        self.tell: Tell = lambda *_: None
        self.show: Show = lambda *_: None
        self.windows = self._windows()
        emulated = self.sockets is not None and self.sockets.crossing is not None
        self.sliders = LinkSliders(self.run, self.windows.set_usual, emulated)
        self.dropped: Callable[[], int] = lambda: 0
        real = self.sockets.dva if self.sockets is not None else None
        self.phones = Phones(self.run, self.clock, lambda: self.seating.console, real)
        if self.sockets is not None:
            self.sockets.join("console", SCREEN)
        self.screens = Screens(
            self.run, id_of("console", SCREEN), self.feed.numbers, self._show_frame
        )
        bench = RunBench(self.run, self.phones.address, self.sockets, self._dva_moved)
        self.dva = DvaPages(self.run, bench)
        self.rooms = ConsoleRooms(self.run, self.dva.bench.appoint)
        self.foreign = ForeignDevices(self.run, self.feed, self.rooms.listener.device)
        self.driven = DrivenRun(
            self.run,
            clock=self.clock,
            feed=self.feed,
            lag=self.lag,
            foreign=self.foreign,
            screens=self.screens,
            author=self.author,
            is_fake=lambda robot: robot in self.dva.fakes.devices,
        )
        self.driven.free_seat = self.free_seat
        self.seating = self.driven.seating
        self.feed.things.add(DVA, "dva", "dva")
        self.seat_lines = SeatLines(self.driven, self.phones.by_client)
        self.guards = PlayedGuards(self.run, self.feed)
        self.alarms = ConsoleAlarms(self.rooms.listener, self._named, self.recorder.broken.values)
        self.audited: Audited | None = None
        self.recorder.on_applied = self.seat_lines.applied
        field = self.run.field
        self.hazards = HazardFeed(
            self.run.stage.site, field.incidents, field.surroundings, field.contained
        )
        self.logs = Logs(self.run.network, self._node_of)
        self.logs.keep("dva")
        for id_tag, robot in field.robots.items():
            hears = partial(self.windows.heard, id_tag)
            self.logs.listen(robot.device.label, hears, publications=True)
        self.clock.on_late = self._late
        self.hold: Callable[[str], object] = lambda _: None

    def _windows(self) -> RobotWindows:
        """The robots' windows; a reply that is dropped is audited and kept, like any that goes."""
        run = self.run
        recorder = self.recorder
        recorder.robots = run.field.robots.keys()

        def lost(robot: str, reply: bytes) -> None:
            run.sent(run.clock.now, robot, "", reply)
            if recorder.kept is not None:
                recorder.kept.message(robot, reply, sent=True)

        about = self.feed.numbers, run.stage.labels
        windows = RobotWindows(recorder, run.field.robots, *about, recorder.sent_at, lost)
        for id_tag in run.field.robots:
            self.feed.things.learn(id_tag, windows.about(id_tag))
        return windows

    def deafen(self, robot: str, on: bool) -> None:
        """Note in the audit log that a robot stopped hearing, or hears again."""
        self.run.deafened(robot, on)

    @property
    def console(self) -> Console:
        """Pattern, rate and limits of future drivers."""
        return self.seating.console

    def is_ours(self, device: str) -> bool:
        """Return True for a device of this console, whose messages are seen as they are sent."""
        return self.sockets is None or self.sockets.network.is_here(device)

    def serve_cameras(self, base: str) -> None:
        """The robots' pictures are to be had below this URL from now on."""
        for robot in self.run.field.robots.values():
            robot.controller.camera_url = camera_url(base, robot.device.label)

    def _dva_moved(self, address: str) -> None:
        self.phones.address = address
        self.tell_scene()

    def show_scene(self) -> None:
        """Send the whole scene to the renderer."""
        scenario = self.scenario.model_dump(mode="json")
        self.show(scene_line(scenario, self.seed))
        for number, when in self.run.field.contained.items():
            self.show(contained_line(number, when))

    def note(self, text: str) -> None:
        """Something of the console itself has gone wrong that people should know of."""
        self.recorder.tell(self.clock.now, "console", text, "link")

    # --- who did what ------------------------------------------------------------------------

    def keep_audit(self, keeper: AuditKeeper) -> None:
        """Keep what people do, and what the DVA decides, from now on."""
        self.audited = Audited(keeper, self.author, self._named)
        self.dva.bench.note_decisions(self.audited.decided)
        keeper.on_rows = self._audit_written

    def _audit_written(self, rows: Sequence[AuditRow]) -> None:
        if self.recorder.kept is not None:
            for row in rows:
                self.recorder.kept.put("audited", plain_row(row))

    def author(self, client: str) -> str:
        """Return the name of a page's person."""
        if room := self.rooms.label(client):
            return room
        if (guard := self.guards.by_client.get(client)) is not None:
            return guard.device.label
        person = self.seating.of_client(client)
        if person is not None:
            return person.device.label
        return name_of_page(client)

    def _named(self, device: str) -> str:
        """The name of a device by its id, or of things by their numbers."""
        names = {str(thing["i"]): thing["label"] for thing in self.feed.things.all}
        found = [names.get(one, one) for one in device.split(", ")] if device else []
        return self.run.stage.labels.get(device, ", ".join(found))

    # --- in somebody's hands --------------------------------------------------------------

    def _node_of(self, label: str) -> str | None:
        """The id of a device of the run by its label."""
        devices = self.run.stage.devices
        return next((device.id_tag for device in devices if device.label == label), None)

    def _show_frame(self, line: FrameLine, robot: int) -> None:
        self.show(line, robot)

    # --- lag -------------------------------------------------------------------------------

    def _late(self, behind: float) -> None:
        """An event comes too late: above the limit nobody drives on."""
        if self.lag.measured(time.monotonic(), behind):
            why = f"stopped: the world is {behind:.2f} s behind real time, too far for driving"
            self.hold(why)
            self.note(why)

    # --- the link --------------------------------------------------------------------------

    def change_link(self, given: Mapping[str, Any]) -> str:
        """Change the link of all robots; what is changed, in words.

        Raises:
            ConfigError: what cannot be.
        """
        text, scenario = self.sliders.change(given)
        self.seating.equip(console_of(self.run.stage, scenario))
        return text

    # --- what pages are told -----------------------------------------------------------------

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
