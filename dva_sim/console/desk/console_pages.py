"""Lines about a system for pages: each on change, and no more often.

While the DVA does not answer, what it last said stays shown, with a word that says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final, Protocol

from dva_sim.cameras.lines import Show
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.audit.audited import name_of_page
from dva_sim.console.audit.decisions_audited import DecisionAudit
from dva_sim.console.driving.decision_actions import DecidingRooms
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.driving.seat_lines import SeatLines
from dva_sim.console.driving.seat_sensors import SeatSensors
from dva_sim.console.dva.device_rows import listed_device_row
from dva_sim.console.dva.fake_devices import FakeDevices
from dva_sim.console.events.alarms import AlarmCondition
from dva_sim.console.events.console_alarms import ConsoleAlarms
from dva_sim.console.events.decisions import dispatch_shown
from dva_sim.console.phones.phone_seat import PhoneSeat
from dva_sim.console.run.lag import LagRule
from dva_sim.console.system.known_system import KnownSystem
from dva_sim.console.system.sensing import WatchedSensors
from dva_sim.console.views.event_rows import event_rows
from dva_sim.console.views.feed import story_of
from dva_sim.console.views.news import News, clock_shown
from dva_sim.console.views.published_rows import emergency_of, mode_of, positions, robot_row
from dva_sim.console.wire.arguments import LogsLooked
from dva_sim.console.wire.events import RoomEntry, SiteEventShown
from dva_sim.console.wire.lines import Tell
from dva_sim.console.wire.rows import DeviceRow, DoingShown, Hearing, RobotRow, ServerShown
from dva_sim.console.wire.scenes import LinkShown, SceneLine
from dva_sim.kernel.recorder import Breach
from dva_sim.protocol import messages as m
from dva_sim.simulation.scenario import Scenario

# From one line to the next, real time [s].
POSITIONS: Final = 0.1
ROWS: Final = 0.5
DEVICES: Final = 1.0
NEWS: Final = 0.05
LAG_ALARM: Final = 3.0  # a machine that cannot keep up for longer is an alarm [s]
HEARD: Final[Mapping[Hearing, str]] = {
    "answers": "answers",
    "silent": "is silent: what is shown is old",
    "never": "has not answered since the start",
}


class NamedRooms(DecidingRooms, Protocol):
    """Control rooms of a console, and who is at them.

    Attributes:
        users: Names of those who have logged in, by client.
    """

    users: dict[str, str]

    def entries(self) -> list[RoomEntry]:
        """Return who decides, and what each may."""

    def room_of(self, client: str) -> str | None:
        """Return the id of the control room by which a page's person decides."""

    def leave(self, client: str) -> object:
        """Note that a page is gone for good."""

    def attend(self, pages: Mapping[str, str]) -> None:
        """Note which pages are open, and the role of each."""


class ConsolePages:
    """State of a system for pages; see `ConsoleSubject`.

    Args:
        system: System that is shown.
        rooms: Control rooms of the console.
        driven: Its robots, as people drive them.
        fakes: Devices that were added by hand.
        phones: Phones at the console, by client.
        breaches: Function that returns the broken safety rules, as far as they are judged here.

    Attributes:
        scenario: Scenario of the system, or one of defaults.
        looked: True while somebody looks at the table of devices.
        users: Names of those who have logged in, by client.
        alarms: Alarms that need action.
        sensors: Sensors of robots from outside that somebody looks at.
        seat_sensors: Sensors that drivers read of the robots in their hands.
        audited: Keeps who did what; None: nobody does.
        lag: Rule that holds drives while what runs here lags; nothing runs at a remote DVA's.
    """

    scenario: Scenario
    lag = LagRule()

    def __init__(
        self,
        system: KnownSystem,
        *,
        rooms: NamedRooms,
        driven: DrivenSystem,
        fakes: FakeDevices,
        phones: Mapping[str, PhoneSeat],
        breaches: Callable[[], Iterable[Breach]] = tuple,
    ) -> None:
        self.system = system
        self.clock = system.clock
        self.rooms = rooms
        self.driven = driven
        self.fakes = fakes
        driven.free_seat = self.free_seat
        driven.is_fake = lambda device: device in fakes.devices
        self.seating = driven.seating
        self.tell: Tell = lambda *_: None
        self.show: Show = lambda *_: None
        self.dropped: Callable[[], int] = lambda: 0
        self.looked = False
        self.users = rooms.users
        self.sensors = WatchedSensors(system.device, system.state, system.id_of)
        self.alarms = ConsoleAlarms(system.agent, system.named, breaches)
        self.audited: DecisionAudit | None = None
        self.seat_sensors = SeatSensors(driven.alarm_at)
        self.seat_lines = SeatLines(driven, phones, self.seat_sensors)
        self._news = News(lambda: self.tell)
        self._events: list[SiteEventShown] = []
        self._hearing: Hearing = "never"
        self._modes: list[object] = []
        self._is_shown = False
        system.on_devices = self.tell_scene
        system.agent.on_record = self.hear_record

    # --- see `ConsoleSubject` --------------------------------------------------------------

    def serve_cameras(self, base: str) -> None:
        """Leave it to robots elsewhere to say where their pictures are."""

    def show_scene(self) -> None:
        """Draw nothing of a world that is known by messages alone."""

    def note(self, text: str) -> None:
        """Tell people of a failure of the console itself."""
        self.system.recorder.tell(self.clock.now, "console", text, "link")

    def begin(self) -> None:
        """Take part, tell the scene, and from then on what changes."""
        self.system.start()
        clock = self.clock
        clock.pulse(POSITIONS, self._tell_positions)
        clock.pulse(ROWS, self.tell_rows)
        clock.pulse(NEWS, self._tell_news)
        clock.pulse(DEVICES, self._tell_devices)
        clock.pulse(DEVICES, self.sensors.go_on)
        clock.pulse(DEVICES, self.seat_sensors.tidy)

    # --- pages and their people ------------------------------------------------------------

    def look(self, line: LogsLooked) -> None:
        """Tell what pages look at now, and nothing else."""
        self.looked = "devices" in line["tables"]

    def watch(self, robots: list[int]) -> None:
        """Watch these robots, and no others."""
        self.sensors.watch(robots)

    def author(self, client: str) -> str:
        """Return the name of a page's person."""
        if name := self.users.get(client) or self.rooms.names().get(client):
            return name
        person = self.seating.of_client(client)
        return name_of_page(client) if person is None else person.device.label

    def free_seat(self, client: str) -> None:
        """Free a client's seat and notify the client."""
        self.tell(self.seat_lines.free(client), client)
        self._news.forget("seat", client)

    def keep_audit(self, keeper: AuditKeeper) -> None:
        """Keep what people do, and what the DVA decides, from now on."""
        rooms = self.rooms
        self.audited = DecisionAudit(
            keeper,
            self.system,
            self.author,
            rooms.room_of,
            others=[room.device.id_tag for room in self.system.agent.rooms[1:]],
        )

    def hear_record(self, record: m.AuditRecord) -> None:
        """Keep a decision, and note who takes a robot from its driver, whom the DVA names not."""
        if self.audited is not None:
            self.audited.heard(record)
        if record.action == "revoke" and record.code == m.OK and record.device is not None:
            reason = f": {record.reason}" if record.reason else ""
            robot = self.system.label_of(record.device)
            self.driven.revokers[robot] = f"by {record.label}{reason}"

    # --- lines for pages --------------------------------------------------------------------

    def scene(self) -> SceneLine:
        """Return what does not change, but for who is there and where the DVA listens."""
        raise NotImplementedError

    def link(self) -> LinkShown:
        """Return the link of the robots."""
        raise NotImplementedError

    def server(self) -> ServerShown:
        """Return what is known of the DVA's server."""
        raise NotImplementedError

    def tell_scene(self) -> None:
        """Tell who is there: a new device has a number."""
        self._is_shown = True
        self.tell(self.scene())

    def tell_now(self) -> None:
        """Publish at once instead of in the next period."""
        self.tell_rows()
        self.tell_seats()
        self._tell_audit()

    def _tell_positions(self) -> None:
        if self._is_shown:
            self._news.tell({"k": "pos", "t": self.system.now_ms, "p": self.positions()})

    def positions(self) -> list[list[int]]:
        """Return the positions of all who can be seen, or have reported one."""
        system = self.system
        reported = positions(system.state.devices, system.numbers, system.frame)
        rows = {row[0]: row for row in (*reported, *system.view.places())}
        return [*rows.values()]

    def tell_rows(self) -> None:
        """Tell the state of the clock, the link, the server, and of everybody."""
        robots = self.robots()
        self.tell(
            {
                "k": "rows",
                "t": self.system.now_ms,
                "clock": clock_shown(self.clock, self.lag),
                "link": self.link(),
                "dropped": self.dropped(),
                "server": self.server(),
                "robots": robots,
                "people": self.people(),
                "order": self.seat_lines.waiting_order(),
                "regions": self.system.regions.rows(self.clock.now),
            }
        )
        self._tell_alarms(robots)

    def robots(self) -> list[RobotRow]:
        """Return a row for each robot."""
        robots = self.system.robots()
        return [self.robot(id_tag) for id_tag in robots if id_tag in self.system.numbers]

    def robot(self, id_tag: str) -> RobotRow:
        """Return the row of a robot, as it says itself, with what is seen of it besides."""
        system = self.system
        entry = system.state.devices[id_tag]
        number = system.numbers[id_tag]
        stopper = self.driven.stoppers.get(id_tag)
        row = robot_row(entry, number, self.clock.now, system.labels, stopper)
        row["pattern"] = self.driven.pattern_of(id_tag)
        row["silent"] = system.is_lost(id_tag)
        system.view.complete(id_tag, row)
        return row

    def people(self) -> list[DoingShown]:
        """Return the activities of all who can be seen, or as they say themselves."""
        numbers = self.system.numbers
        reported: dict[int, DoingShown] = {
            numbers[id_tag]: {"i": numbers[id_tag], "doing": entry.status.activity}
            for id_tag, entry in self.system.state.devices.items()
            if isinstance(entry.status, m.PersonStatus) and id_tag in numbers
        }
        seen = {row["i"]: row for row in self.system.view.people()}
        return [*(reported | seen).values()]

    def _tell_alarms(self, robots: list[RobotRow]) -> None:
        """Tell alarms; while the state of events is unknown, alarms stay as they are."""
        now_ms = self.system.now_ms
        is_known = self.system.has_all_events and self.system.answers
        system = list(self._conditions())
        if is_known:
            self._news.tell(self.alarms.look(self._events, robots, now_ms, system))
        else:
            self._news.tell(self.alarms.hold(now_ms, system))

    def _conditions(self) -> Iterator[AlarmCondition]:
        """Yield the conditions of the system itself that need somebody to act."""
        for row in self.system.regions.rows(self.clock.now):
            if row["state"] != "served":
                yield AlarmCondition(
                    f"region {row['name']}",
                    kind="region not served",
                    priority="critical" if row["state"] == "dead" else "high",
                    place="",
                    text=f"Region {row['name']}: {row['text']}",
                )
        if self.system.is_silent and not self.system.regions.own:
            text = f"The DVA at {self.system.dva} is silent"
            yield AlarmCondition("dva silent", "DVA silent", "critical", place="", text=text)
        if self.lag.held_for > LAG_ALARM:
            text = "This machine cannot keep up with real time: nobody may drive"
            yield AlarmCondition("lag", "behind real time", "high", place="", text=text)

    def _tell_news(self) -> None:
        """Tell events, story and seats as they change, and rows when a mode or holder does."""
        self._tell_hearing()
        self._tell_events()
        for line in story_of(self.system.recorder):
            self.tell(line)
        if (modes := self.modes()) != self._modes:
            self._modes = modes
            self.tell_rows()
        self.tell_seats()
        self._tell_audit()

    def modes(self) -> list[object]:
        """Return what rows tell of robots at once when it changes: mode, holder, emergency."""
        now = self.clock.now
        devices = self.system.state.devices
        robots = [devices[id_tag] for id_tag in self.system.robots()]
        return [
            (one.holder and one.holder[0].holder, mode_of(one), emergency_of(one, now, {}) is None)
            for one in robots
        ]

    def _tell_hearing(self) -> None:
        hearing = self.system.hearing
        if hearing != self._hearing:
            self._hearing = hearing
            self.system.recorder.tell(self.clock.now, "dva", HEARD[hearing], "link")
            self.tell_rows()

    def _tell_events(self) -> None:
        """Tell events with what was decided on them, and who decides."""
        system = self.system
        now_ms = system.now_ms
        if system.has_all_events:
            self._events = event_rows(system.agent, system.labels, system.site, system.frame)
            self._news.tell({"k": "events", "t": now_ms, "events": self._events})
        dispatch = dispatch_shown(system.agent.dispatch, system.switched)
        handing_over = self.rooms.handing_over
        self._news.tell(
            {
                "k": "control",
                "t": now_ms,
                "dispatch": dispatch,
                "rooms": self.rooms.entries(),
                "offers": handing_over.shown(self.rooms.names()),
                "owners": handing_over.owners_shown(),
            }
        )

    def tell_seats(self) -> None:
        """Tell everybody in a seat about their own drives."""
        for client, line in self.seat_lines.lines():
            self._news.tell(line, client)

    def _tell_audit(self) -> None:
        if self.audited is not None:
            self._news.tell(self.audited.keeper.line(self.system.now_ms))

    def _tell_devices(self) -> None:
        if self.looked:
            rows = self.devices()
            self.tell({"k": "devices", "t": self.system.now_ms, "devices": rows})

    def devices(self) -> list[DeviceRow]:
        """Return a row for each device that a DVA lists."""
        system = self.system
        return [
            listed_device_row(
                entry,
                self.clock.now,
                system.labels,
                is_lost=system.is_lost(id_tag),
                is_fake=id_tag in self.fakes.devices,
                may_revoke=system.role == "supervise",
            )
            for id_tag, entry in system.state.devices.items()
        ]
