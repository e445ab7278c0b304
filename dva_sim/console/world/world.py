"""A console's own run for pages: on a paced clock, with all that only its bench knows.

One thread does everything, and waits for nobody: lines to other processes go into outboxes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from typing_extensions import override

from dva_sim.agents.observation import Cameras
from dva_sim.cameras.lines import FrameLine, contained_line, scene_line
from dva_sim.cameras.screens import Screens, camera_url, topic_of
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.desk.console_pages import ConsolePages
from dva_sim.console.dva.run_bench import RunBench
from dva_sim.console.dva.run_fakes import fakes_of
from dva_sim.console.events.rooms import ConsoleRooms
from dva_sim.console.guards.played_guards import PlayedGuards
from dva_sim.console.phones.phones import Phones
from dva_sim.console.robots.robot_windows import RobotWindows
from dva_sim.console.run.lag import LagRule
from dva_sim.console.run.real_links import MakeSockets
from dva_sim.console.run.recorder import ConsoleRecorder
from dva_sim.console.run.sliders import LinkSliders
from dva_sim.console.system.known_system import KnownSystem
from dva_sim.console.system.served_regions import regions_of
from dva_sim.console.views.feed import Feed
from dva_sim.console.views.fields import HazardFeed
from dva_sim.console.views.logs import Logs
from dva_sim.console.views.scene import scene_of
from dva_sim.console.wire.arguments import LogsLooked
from dva_sim.console.wire.limits import LOG_PERIOD
from dva_sim.console.wire.rows import DeviceRow, ServerShown
from dva_sim.console.wire.scenes import LinkShown, SceneLine
from dva_sim.console.world.driven_run import PEOPLE, DrivenRun
from dva_sim.kernel.errors import DvaSimError
from dva_sim.network.realtime import PacedClock
from dva_sim.recordings.audit_log import AuditRow, plain_row
from dva_sim.simulation.full.control_room import console_of
from dva_sim.simulation.full.run import Run, Watched
from dva_sim.simulation.full.stage import DVA, dvas_of, id_of, kind_of
from dva_sim.simulation.scenario import Scenario

FROM_OUTSIDE: Final = ("robot", "guard", "fake")  # kinds of devices, but for the run's own team
SCREEN: Final = 0xFFFF  # number of the console's own screen among consoles

# From one line to the next, real time [s].
WINDOWS: Final = 0.1
HAZARDS: Final = 1.0
TIDY: Final = 1.0


class ConsoleWorld(ConsolePages):
    """Run with its published state.

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
        tell: Callback for lines to pages, with a key where only the newest counts.
        show: Callback for lines to the renderer, with a key likewise.

    Raises:
        ConfigError: the site cannot hold the team, or the events.
    """

    driven: DrivenRun
    rooms: ConsoleRooms

    def __init__(
        self,
        scenario: Scenario,
        name: str,
        seed: int,
        clock: PacedClock | None = None,
        sockets: MakeSockets | None = None,
        measured: bool = False,
    ) -> None:
        self._contained: dict[int, float] = {}
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
        self.lag = LagRule()
        self.feed = Feed(self.run, self.lag)
        self.windows = self._windows()
        emulated = self.sockets is not None and self.sockets.crossing is not None
        self.sliders = LinkSliders(self.run, self.windows.set_usual, emulated)
        real = self.sockets.dva if self.sockets is not None else None
        self.phones = Phones(self.run, self.clock, lambda: self.seating.console, real)
        self.run.stage.app_pattern = self.phones.pattern_of
        if self.sockets is not None:
            self.sockets.join("console", SCREEN)
        self.screens = Screens(
            self.run, id_of("console", SCREEN), self.feed.numbers, self._show_frame
        )
        self.bench = RunBench(
            self.run, self.feed, self.phones.address, self.sockets, self._dva_moved
        )
        rooms = ConsoleRooms(self.run, self.bench.appoint)
        system = self._system(rooms)
        super().__init__(
            system,
            rooms=rooms,
            driven=DrivenRun(
                self.run,
                system,
                lag=self.lag,
                screens=self.screens,
                author=lambda client: self.author(client),
            ),
            fakes=fakes_of(self.run, self.bench, system.state.forget),
            phones=self.phones.by_client,
            breaches=self.recorder.broken.values,
        )
        for id_tag, label in dvas_of(scenario).items():
            self.feed.things.add(id_tag, label, "dva")
        self.guards = PlayedGuards(self.run, self.feed)
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

    def _system(self, rooms: ConsoleRooms) -> KnownSystem:
        stage = self.run.stage
        return KnownSystem(
            rooms.listener,
            clock=self.clock,
            recorder=self.recorder,
            dva=self.phones.address,
            labels=stage.labels,
            regions=regions_of(self.scenario),
            site=stage.site,
            bench=self.bench,
            view=self.feed,
            things=self.feed.things,
            own=self._own_devices,
        )

    def _own_devices(self) -> set[str]:
        """Return the ids of the run's own team, and of those who take part at this console."""
        field = self.run.field
        team = {*field.robots, *(guard.device.id_tag for guard in field.guards)}
        here = {device.id_tag for device in self.run.stage.devices}
        return team | {id_tag for id_tag in here if kind_of(id_tag)[0] not in FROM_OUTSIDE}

    def _windows(self) -> RobotWindows:
        """Return the robots' windows; a dropped reply is audited and kept like any other."""
        run = self.run
        recorder = self.recorder
        recorder.robots = run.field.robots.keys()

        def lost(robot: str, reply: bytes) -> None:
            run.sent(run.clock.now, robot, "", reply)
            if recorder.kept is not None:
                recorder.kept.message(robot, reply, sent=True)

        windows = RobotWindows(recorder, run.field.robots, recorder.sent_at, lost)
        for id_tag in run.field.robots:
            self.feed.things.learn(id_tag, windows.about(id_tag))
        return windows

    def is_ours(self, device: str) -> bool:
        """Return True for a device of this console, whose messages are seen as they are sent."""
        return self.sockets is None or self.sockets.network.is_here(device)

    def _dva_moved(self, address: str) -> None:
        self.phones.address = self.system.dva = address
        self.tell_scene()

    # --- who did what ------------------------------------------------------------------------

    @override
    def keep_audit(self, keeper: AuditKeeper) -> None:
        super().keep_audit(keeper)
        keeper.on_rows = self._audit_written

    def _audit_written(self, rows: Sequence[AuditRow]) -> None:
        if self.recorder.kept is not None:
            for row in rows:
                self.recorder.kept.put("audited", plain_row(row))

    @override
    def author(self, client: str) -> str:
        guard = self.guards.by_client.get(client)
        if guard is not None and not self.rooms.names().get(client):
            return guard.device.label
        return super().author(client)

    def _node_of(self, label: str) -> str | None:
        """Return the id of a device of the run by its label; `dva` is that of the first region."""
        ids = (device.id_tag for device in self.run.stage.devices if device.label == label)
        return DVA if label == "dva" else next(ids, None)

    def _show_frame(self, line: FrameLine, robot: int) -> None:
        self.show(line, robot)

    # --- the pace and the link ---------------------------------------------------------------

    def _late(self, behind: float) -> None:
        """Note an event that comes too late: above the limit nobody drives on."""
        if self.lag.measured(time.monotonic(), behind):
            why = f"stopped: the world is {behind:.2f} s behind real time, too far for driving"
            self.hold(why)
            self.note(why)

    def change_link(self, arguments: Mapping[str, Any]) -> str:
        """Change the link of all robots; what is changed, in words.

        Raises:
            ConfigError: what cannot be.
        """
        text, scenario = self.sliders.change(arguments)
        self.seating.equip(console_of(self.run.stage, scenario))
        return text

    # --- see `ConsolePages` ------------------------------------------------------------------

    @override
    def serve_cameras(self, base: str) -> None:
        for robot in self.run.field.robots.values():
            robot.controller.camera_url = camera_url(base, robot.device.label)

    @override
    def show_scene(self) -> None:
        scenario = self.scenario.model_dump(mode="json")
        self.show(scene_line(scenario, self.seed))
        for number, when in self.run.field.contained.items():
            self.show(contained_line(number, when))

    @override
    def begin(self) -> None:
        super().begin()
        self.tell_scene()
        self.show_scene()
        self.clock.pulse(WINDOWS, self._tell_windows)
        self.clock.pulse(HAZARDS, self._tell_hazards)
        self.clock.pulse(LOG_PERIOD, self._tell_logs)
        self.clock.pulse(TIDY, self.recorder.tidy)

    @override
    def look(self, line: LogsLooked) -> None:
        super().look(line)
        self.logs.look(line["logs"])

    @override
    def watch(self, robots: list[int]) -> None:
        super().watch(robots)
        ids = {thing["id"] for thing in self.feed.things.all if thing["i"] in robots}
        self.screens.watch(ids)

    @override
    def scene(self) -> SceneLine:
        run = self.run
        scene = scene_of(
            self.scenario,
            site=run.stage.site,
            incidents=run.field.incidents,
            things=self.system.things_here(),
            link=self.link(),
            regions=run.stage.regions,
            name=self.name,
            seed=self.seed,
        )
        scene["dva_address"] = self.phones.address
        scene["phone"] = self.phones.offer()
        return scene

    @override
    def link(self) -> LinkShown:
        return self.sliders.line()

    @override
    def server(self) -> ServerShown:
        server = self.bench.server()
        server["console"] = self.system.device.id_tag
        if self.system.hearing != "never":  # it is there, and its first word is on its way
            server["hearing"] = self.system.hearing
        return server

    @override
    def tell_rows(self) -> None:
        self.lag.measured(time.monotonic(), self.clock.worst_lag())
        super().tell_rows()

    @override
    def devices(self) -> list[DeviceRow]:
        rows = super().devices()
        self.bench.complete(rows, self.system.dva_of)
        return rows

    def _tell_windows(self) -> None:
        for line in self.windows.lines(self.screens.watched, self.robot):
            self._news.tell(line, line["i"])

    def _tell_logs(self) -> None:
        for line in self.logs.batches():
            self.tell(line)

    def _tell_hazards(self) -> None:
        self._news.tell(self.hazards.line(self.feed.now_ms))
        for number, when in self.run.field.contained.items():
            if self._contained.get(number) != when:
                self._contained[number] = when
                self.show(contained_line(number, when))

    @override
    def tell_seats(self) -> None:
        super().tell_seats()
        for client, played in self.guards.lines():
            self._news.tell(played, client)
