"""Updates for the pages of an attached console: each on change, and no more often.

While the DVA does not answer, what it last said stays shown, with a word that says so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from dva_sim.cameras.lines import Show
from dva_sim.console.attached import lines
from dva_sim.console.attached.audit import AttachedAudit
from dva_sim.console.attached.driven import DrivenAttached
from dva_sim.console.attached.people import AttachedPeople
from dva_sim.console.attached.requests import LOG, RequestReader
from dva_sim.console.attached.sensing import WatchedSensors
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.bench import UNATTENDED
from dva_sim.console.driving.seat_lines import SeatLines
from dva_sim.console.dva.device_rows import listed_device_row
from dva_sim.console.events.console_alarms import ConsoleAlarms
from dva_sim.console.events.decisions import dispatch_shown
from dva_sim.console.run.lag import LagRule
from dva_sim.console.views.event_rows import event_rows
from dva_sim.console.views.feed import story_of
from dva_sim.console.views.news import News, clock_shown
from dva_sim.console.views.published_rows import positions, robot_row
from dva_sim.console.wire.arguments import LogsLooked
from dva_sim.console.wire.events import SiteEventShown
from dva_sim.console.wire.lines import Tell
from dva_sim.console.wire.rows import DoingShown, Hearing, RobotRow, ServerShown
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ROBOT

# From one line to the next, real time [s].
POSITIONS = 0.2
ROWS = 0.5
DEVICES = 1.0
SOON = 0.1
SEATS = 0.05
NEVER_LATE: Final = LagRule()  # nothing runs here that could be
HEARD: Final[Mapping[Hearing, str]] = {
    "answers": "answers",
    "silent": "is silent: what is shown is old",
    "never": "has not answered since the start",
}
FIRST_SCENE: Final = 1.5  # so long a position is waited for, where no site is known [s]


class AttachedPages:
    """State of a remote system for pages; see `ConsoleSubject`.

    Args:
        system: System to which the console is attached.
        audit: Keeps the audit log.

    Attributes:
        looked: True while somebody looks at the table of devices.
        people: People at the pages.
        alarms: Alarms that need action.
        sensors: Sensors that somebody looks at.
        requests: Reader of the DVA's log of requests.
        audited: Keeps who did what.
    """

    def __init__(self, system: AttachedSystem, audit: AuditKeeper) -> None:
        self.system = system
        self.clock = system.clock
        self.tell: Tell = lambda *_: None
        self.show: Show = lambda *_: None
        self.dropped: Callable[[], int] = lambda: 0
        self.looked = False
        self.people = AttachedPeople(system)
        self.sensors = WatchedSensors(system.device, system.state, system.id_of)
        self.requests = RequestReader(system.agent, lambda line: self.tell(line))
        self.alarms = ConsoleAlarms(system.agent, system.named)
        self.audited = AttachedAudit(audit, system, self.people.author)
        system.on_record = self.audited.heard
        self._hearing: Hearing = "never"
        self.driven = DrivenAttached(system, self.people.author)
        self.driven.free_seat = self._free_seat
        self._seat_lines = SeatLines(self.driven, {})
        self._news = News(lambda: self.tell)
        self._is_shown = False
        system.on_devices = self._tell_scene

    # --- see `ConsoleSubject` --------------------------------------------------------------

    def serve_cameras(self, base: str) -> None:
        """Robots that run elsewhere say themselves where their pictures are."""

    def show_scene(self) -> None:
        """There is nothing to be drawn here: of the world only messages are known."""

    def note(self, text: str) -> None:
        """Something has gone wrong that people should know of."""
        self.system.note(text)

    def begin(self) -> None:
        """Take part, tell what there is, and from then on what changes."""
        self.system.start()
        clock = self.clock
        clock.call_after(FIRST_SCENE, self._tell_scene)
        clock.pulse(POSITIONS, self._tell_positions)
        clock.pulse(ROWS, self._tell_rows)
        clock.pulse(ROWS, self._tell_alarms)
        clock.pulse(SOON, self._tell_news)
        clock.pulse(SEATS, self._tell_seats)
        clock.pulse(DEVICES, self._tell_devices)
        clock.pulse(DEVICES, self.sensors.go_on)
        clock.pulse(SOON, self.requests.go_on)

    def look(self, line: LogsLooked) -> None:
        """Tell what pages look at now, and nothing else."""
        self.looked = "devices" in line["tables"]
        self.requests.is_looked = LOG in line["logs"]

    def let_go(self) -> None:
        """Let the DVA rely on nobody here if no person has stayed."""
        bench = self.system.bench
        if bench is not None and not self.people.by_client:
            bench.appoint(self.system.device.id_tag, UNATTENDED)

    # --- what is told ----------------------------------------------------------------------

    def _tell_scene(self) -> None:
        """Tell the scene: a new device gets a number; an unknown site lies around the first one."""
        system = self.system
        system.find_place()
        if self.clock.now < FIRST_SCENE and not system.is_placed:
            return
        things = lines.things_of(system.state.devices.values(), system.numbers)
        self._is_shown = True
        scene = lines.attached_scene(
            things,
            address=system.dva,
            own_pattern=self.driven.own_pattern,
            site=system.site,
            frame=system.frame,
        )
        self.tell(scene if system.bench is None else {**scene, "begins_at": "main"})

    def _tell_positions(self) -> None:
        system = self.system
        if system.find_place():
            self._tell_scene()
        if self._is_shown:
            rows = positions(system.state.devices, system.numbers, system.frame)
            self._news.tell({"k": "pos", "t": system.now_ms, "p": rows})

    def _tell_rows(self) -> None:
        system = self.system
        self.tell(
            {
                "k": "rows",
                "t": system.now_ms,
                "clock": clock_shown(self.clock, NEVER_LATE),
                "link": lines.LINK,
                "dropped": self.dropped(),
                "server": self._server(),
                "robots": self._robots(),
                "people": self._people(),
                "order": self._seat_lines.waiting_order(),
            }
        )

    def _tell_seats(self) -> None:
        for client, line in self._seat_lines.lines():
            self._news.tell(line, client)

    def _free_seat(self, client: str) -> None:
        self.tell(self._seat_lines.free(client), client)
        self._news.forget("seat", client)

    def _tell_alarms(self) -> None:
        """Tell alarms; while the state of events is unknown, alarms stay as they are."""
        system = self.system
        now_ms = self.system.now_ms
        is_known = system.has_all_events and system.answers
        known = self.alarms.look(self._events(), self._robots(), now_ms) if is_known else None
        self._news.tell(known or self.alarms.hold(now_ms))

    def _robots(self) -> list[RobotRow]:
        now = self.clock.now
        numbers = self.system.numbers
        labels = self.system.labels
        return [
            {
                **robot_row(entry, numbers[id_tag], now, self._stopper_named(id_tag, labels)),
                "pattern": self.driven.pattern_of(id_tag),
            }
            for id_tag, entry in self.system.state.devices.items()
            if entry.device.device_type == ROBOT and id_tag in numbers
        ]

    def _stopper_named(self, robot: str, labels: Mapping[str, str]) -> Mapping[str, str]:
        """Return labels in which a device that stopped a robot from a page is its person."""
        stopper = self.driven.stoppers.get(robot)
        return labels if stopper is None else {**labels, stopper[0]: stopper[1]}

    def _people(self) -> list[DoingShown]:
        numbers = self.system.numbers
        return [
            {"i": numbers[id_tag], "doing": entry.status.activity}
            for id_tag, entry in self.system.state.devices.items()
            if isinstance(entry.status, m.PersonStatus) and id_tag in numbers
        ]

    def _server(self) -> ServerShown:
        system = self.system
        elsewhere: ServerShown = {
            "listens": system.answers,
            "address": system.dva,
            "port": None,
            "modelled": False,
            "own": False,
        }
        server = elsewhere if system.bench is None else system.bench.server()
        return {
            **server,
            "role": system.role,
            "console": system.device.id_tag,
            "hearing": system.hearing,
            "log": self.requests.shown,
        }

    def _tell_news(self) -> None:
        """Tell hearing of the DVA, events, the mode of dispatch and the story as they change."""
        system = self.system
        if (hearing := system.hearing) != self._hearing:
            self._hearing = hearing
            system.recorder.tell(self.clock.now, "dva", HEARD[hearing], "link")
            self._tell_rows()
        now_ms = self.system.now_ms
        if system.has_all_events:
            self._news.tell({"k": "events", "t": now_ms, "events": self._events()})
        dispatch = dispatch_shown(system.agent.dispatch, 0.0)
        rooms = self.people.lines(system.role)
        self._news.tell({"k": "control", "t": now_ms, "dispatch": dispatch, "rooms": rooms})
        self._news.tell(self.audited.keeper.line(now_ms))
        for line in story_of(system.recorder):
            self.tell(line)

    def _events(self) -> list[SiteEventShown]:
        system = self.system
        return event_rows(system.agent, system.labels, system.site, system.frame)

    def _tell_devices(self) -> None:
        if self.looked:
            now = self.clock.now
            may = self.system.role == "supervise"
            rows = [
                listed_device_row(
                    entry,
                    now,
                    self.system.labels,
                    is_fake=self.system.is_fake(id_tag),
                    may_revoke=may,
                )
                for id_tag, entry in self.system.state.devices.items()
            ]
            self.tell({"k": "devices", "t": self.system.now_ms, "devices": rows})
