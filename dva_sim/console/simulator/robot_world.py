"""One simulated robot on real sockets, for anybody's DVA, with the windows that a console has.

Nothing of the system is here but the robot itself, its place and its pages: who it is registered
at, who is let drive it, and who does, is decided elsewhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from dva_sim.agents.observation import Cameras
from dva_sim.cameras.lines import Show, scene_line
from dva_sim.cameras.screens import OwnScreens, camera_url, topic_of
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.audit.audited import Audited, name_of_page
from dva_sim.console.robots.robot_station import LISTENING, OwnStation
from dva_sim.console.robots.robot_windows import RobotWindows
from dva_sim.console.run.lag import LagRule
from dva_sim.console.run.real_links import ConsoleSockets
from dva_sim.console.run.recorder import ConsoleRecorder
from dva_sim.console.system.system_state import DeviceState
from dva_sim.console.views.feed import Feed, device_of, story_of
from dva_sim.console.views.logs import Logs
from dva_sim.console.views.news import News, clock_shown
from dva_sim.console.views.published_rows import positions, robot_row
from dva_sim.console.views.scene import scene_of
from dva_sim.console.wire.limits import LOG_PERIOD
from dva_sim.console.wire.lines import Tell
from dva_sim.console.wire.rows import RobotRow
from dva_sim.console.wire.scenes import LinkShown
from dva_sim.kernel.errors import DvaSimError
from dva_sim.network.keys import KeyRing
from dva_sim.network.link.link import Link
from dva_sim.network.real_network import RealNetwork
from dva_sim.network.realtime import PacedClock
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.observations import motion_of, terms_of
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.run import WATCH_PERIOD
from dva_sim.simulation.full.safety_checks import SafetyAudit
from dva_sim.simulation.full.stage import Stage, id_of
from dva_sim.simulation.full.team import TeamBuilder
from dva_sim.simulation.scenario import Scenario

POSITIONS, WINDOWS, ROWS, TIDY = 0.1, 0.1, 0.5, 1.0  # from one line to the next, real time [s]
LOOK_PERIOD_S = 0.05  # period of looks at what has changed, in real time [s]
PAGES = ["robots", "map", "audit"]
LINK: Final[LinkShown] = {"kind": "real", "processing_s": 0.0}


class RobotWorld:
    """World of a single robot, and the state it publishes.

    Args:
        scenario: Says which robot, and where it stands.
        number: Number of the robot in the scenario, from 1.
        seed: Random seed.
        clock: Its time; real time.
        ring: Keys of the devices; None to run without.
        host: Address to listen on.
        port: Port for requests; 0: any two free ones.

    Attributes:
        clock: Real time.
        robot: The robot.
        station: Progress of the robot from off to listening.
        audited: Keeps who did what, once that is wanted.
        windows: Its windows.
        tell: Callback for lines to pages, with a key where only the newest counts.
        show: Callback for lines to the renderer, with a key likewise.

    Raises:
        ConfigError: the site has no place for it.
        NetworkError: the host is not this machine.
    """

    def __init__(
        self,
        scenario: Scenario,
        number: int = 1,
        seed: int = 1,
        *,
        clock: PacedClock | None = None,
        ring: KeyRing | None = None,
        host: str = "127.0.0.1",
        port: int = 0,
    ) -> None:
        self.scenario = scenario
        self.seed = seed
        self.clock = clock or PacedClock()
        self.recorder = ConsoleRecorder()
        self.sockets = ConsoleSockets(scenario, self.clock, self.recorder, host, ring=ring)
        try:
            self._place(number, host, port)
        except DvaSimError:
            self.sockets.close()
            raise
        self.tell: Tell = lambda *_: None
        self.show: Show = lambda *_: None
        self.dropped: Callable[[], int] = lambda: 0
        self._news = News(lambda: self.tell)
        self.hold: Callable[[str], object] = lambda _: None
        self.clock.on_late = self._late
        self.audited: Audited | None = None
        self._watch()

    @property
    def network(self) -> RealNetwork:
        """Transport of its messages."""
        return self.sockets.network

    @property
    def links(self) -> Mapping[str, tuple[Link, Link]]:
        """No link is modelled here."""
        return {}

    def _place(self, number: int, host: str, port: int) -> None:
        """Put the robot where it begins; it is off."""
        cameras = Cameras(lambda label, _: camera_url("http:///", label), topic_of)
        self.stage = Stage(
            self.scenario,
            seed=self.seed,
            network=self.network,
            recorder=self.recorder,
            address=lambda kind, number: host,
            time_of_day=self.sockets.time_of_day(),
            cameras=cameras,
            attended=True,
        )
        self.field = Field(self.stage)
        team = TeamBuilder(self.stage, self.field.world, self.field)
        self.robot = robot = team.add_robot(number, registers=False)
        self.field.robots[robot.device.id_tag] = robot
        self.station = OwnStation(robot, self.network, host, port)
        self.station.deaf = partial(self.deafen, robot.device.id_tag)

    def _watch(self) -> None:
        """Feed, windows, log, camera and audit look at the robot from now on."""
        robot = self.robot
        id_tag = self.robot.device.id_tag
        self.lag = LagRule()
        self.feed = Feed(self, self.lag)
        self.recorder.robots = {id_tag}
        self.audit = SafetyAudit(
            self.recorder,
            terms=terms_of(self.scenario, attended=True),
            motion_of=lambda _: motion_of(robot),
            place_of=self.field.place_of,
        )
        self.recorder.on_accepted = self.audit.accepted
        self.recorder.on_hand = self.audit.by_hand
        self.sockets.watch(self.audit)
        self.windows = RobotWindows(
            self.recorder, self.field.robots, self.recorder.sent_at, self._lost
        )
        self.windows.by_id[id_tag].station = self.station
        self.feed.things.learn(id_tag, self.windows.about(id_tag))
        self.logs = Logs(
            self.network, lambda label: id_tag if label == robot.device.label else None
        )
        self.logs.listen(robot.device.label, partial(self.windows.heard, id_tag), publications=True)
        self.screens = OwnScreens(
            self, id_of("console", 1), self.feed.numbers, lambda line, key: self.show(line, key)
        )
        self.clock.every(1.0 / self.scenario.camera.rate_hz, self.screens.look)
        self.clock.every(WATCH_PERIOD, self._check_rules)

    def _check_rules(self) -> None:
        now = self.clock.now
        self.field.world.advance_to(now)
        self.audit.moves(now, {self.robot.device.id_tag: motion_of(self.robot)})

    def _lost(self, robot: str, reply: bytes) -> None:
        self.audit.sent(self.clock.now, robot, "", reply)

    def keep_audit(self, keeper: AuditKeeper) -> None:
        """Keep what people do from now on."""
        label = self.robot.device.label
        self.audited = Audited(keeper, name_of_page, lambda named: named and label)

    def deafen(self, robot: str, on: bool) -> None:
        """Note in the audit log that the robot stopped hearing, or hears again."""
        self.audit.deafened(self.clock.now, robot, on)

    def slowed(self, processing: float) -> None:
        """Note how long a message takes the robot's computer from now on [s]."""
        self.audit.slowed(self.clock.now, processing)

    # --- what a console shows: see `ConsoleSubject` ------------------------------------------

    def serve_cameras(self, base: str) -> None:
        """Implement `ConsoleSubject`."""
        self.robot.controller.camera_url = camera_url(base, self.robot.device.label)

    def begin(self) -> None:
        """Implement `ConsoleSubject`."""
        scene = scene_of(
            self.scenario,
            site=self.stage.site,
            incidents=(),
            things=self.feed.things.all,
            link=LINK,
            name=f"robot {self.scenario.robot.profile}",
            seed=self.seed,
        )
        scene["pages"] = PAGES
        self.tell(scene)
        self.show_scene()
        self.clock.pulse(POSITIONS, self._tell_positions)
        self.clock.pulse(WINDOWS, self._tell_windows)
        self.clock.pulse(ROWS, self.tell_now)
        self.clock.pulse(LOOK_PERIOD_S, self._tell_news)
        self.clock.pulse(LOG_PERIOD, self._tell_logs)
        self.clock.pulse(TIDY, self.recorder.tidy)

    def show_scene(self) -> None:
        """Implement `ConsoleSubject`."""
        scenario = self.scenario.model_dump(mode="json")
        self.show(scene_line(scenario, self.seed))

    def note(self, text: str) -> None:
        """Implement `ConsoleSubject`."""
        self.recorder.tell(self.clock.now, "console", text, "link")

    # --- what is told ----------------------------------------------------------------------

    def tell_now(self) -> None:
        """Tell the state of the robot."""
        self.lag.measured(time.monotonic(), self.clock.worst_lag())
        self.tell(
            {
                "k": "rows",
                "t": self.feed.now_ms,
                "clock": clock_shown(self.clock, self.lag),
                "link": LINK,
                "dropped": self.dropped(),
                "robots": [self._row(self.robot.device.id_tag)],
                "people": [],
                "order": None,
            }
        )

    def _row(self, robot: str) -> RobotRow:
        """Return the row of the robot, by what it would report now: nobody else is here."""
        row = robot_row(self._state(), self.feed.numbers[robot], self.clock.now, self.stage.labels)
        row["pattern"] = self.stage.pattern_name(robot)
        self.feed.complete(robot, row)
        if self.station.state != LISTENING:
            row["stop_reason"] = f"it is {self.station.state}"
        return row

    def _state(self) -> DeviceState:
        now = self.clock.now
        robot = self.robot
        latch = robot.controller.latch
        holder, held_for = robot.holder
        return DeviceState(
            device_of(robot.device),
            listed=now,
            dva=robot.device.dva,
            published=self.feed.status(robot.device.id_tag),
            holder=(m.RobotHolder(holder, None, held_for), now),
            emergency=(latch.message(now), now) if latch.holds else None,
        )

    def _tell_positions(self) -> None:
        id_tag = self.robot.device.id_tag
        places = positions({id_tag: self._state()}, self.feed.numbers, self.stage.site.frame)
        self._news.tell({"k": "pos", "t": self.feed.now_ms, "p": places})

    def _tell_windows(self) -> None:
        for line in self.windows.lines(self.screens.watched, self._row):
            self._news.tell(line)

    def _tell_news(self) -> None:
        for line in story_of(self.recorder):
            self.tell(line)
        if self.audited is not None:
            self._news.tell(self.audited.keeper.line(self.feed.now_ms))

    def _tell_logs(self) -> None:
        for line in self.logs.batches():
            self.tell(line)

    def _late(self, behind: float) -> None:
        if self.lag.measured(time.monotonic(), behind):
            self.hold(f"stopped: this machine is {behind:.2f} s behind real time")

    # --- the end ----------------------------------------------------------------------------

    def close(self) -> None:
        """Close all sockets; what was sent last has a moment to leave."""
        self.sockets.close()
