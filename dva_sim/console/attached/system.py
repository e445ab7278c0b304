"""A system that runs elsewhere, as a console shows it: all that is told to a control room.

Nothing here waits for the DVA: it is asked again and again, and what it last said stays shown,
with a word that it does not answer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import AgentDevice
from dva_sim.console.attached import lines
from dva_sim.console.attached.options import AttachOptions
from dva_sim.console.attached.told import ToldSystem
from dva_sim.console.fake_devices import NOWHERE, FakeDevices
from dva_sim.console.real_links import start_of_day
from dva_sim.console.rooms import about_event
from dva_sim.core.registry import CONTROL_ROOM, ROBOT
from dva_sim.kernel.recorder import Moment, Recorder
from dva_sim.network.realtime import PacedClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.worlds.geo import GeoFrame

Line = dict[str, Any]
Tell = Callable[..., object]

TIMEOUT, ATTEMPTS = 1.0, 2  # of what the DVA is asked [s]
POLL: Final = 2.0  # from one question who is there to the next [s]
ASK_SENSORS: Final = 10.0  # the same about sensors and cameras [s]
UNHEARD: Final = 2 * POLL + TIMEOUT * ATTEMPTS  # without a word the DVA counts as gone [s]
POSITIONS, ROWS, DEVICES, SOON = 0.2, 0.5, 1.0, 0.1  # from one line to the next, real time [s]
FIRST_SCENE: Final = 1.5  # so long a position is waited for, where no site is known [s]
SOMEWHERE: Final = GeoFrame(0.0, 0.0)


class AttachedSystem:
    """What runs at another DVA; see `ConsoleSubject`.

    Args:
        options: Where the DVA is.

    Attributes:
        clock: Real time.
        agent: The console's own control room.
        told: What the devices tell.
        fakes: Devices that were added by hand.
        looked: Whether somebody looks at the table of devices.

    Raises:
        ConfigError: keys or site cannot be read.
        NetworkError: no port can be had.
    """

    def __init__(self, options: AttachOptions) -> None:
        self.options = options
        self.tell: Tell = lambda *_: None
        self.show: Tell = lambda *_: None
        self.dropped: Callable[[], int] = lambda: 0
        self.looked = False
        self._site, ring = options.site(), options.ring()
        own = options.own_id(ring)
        self._frame = self._site.frame if self._site is not None else SOMEWHERE
        self.clock, self.recorder, self._numbers = PacedClock(), Recorder(), dict[str, int]()
        self.network = SocketNetwork(self.clock, ring, self.note)
        self.network.introduce(DVA, options.dva)
        address = self.network.join(own, options.listen)
        self.device = self._make(own, "control room", CONTROL_ROOM, address)
        self.agent = ControlRoomAgent(self.device)
        self.told = ToldSystem(self.device, self._tell_scene)
        self.fakes = FakeDevices(self._make, self._is_known, _identity, self._drop)
        self._heard, self._answers, self._newest = -UNHEARD, False, dict[str, Any]()
        self._is_shown = False

    # --- see `ConsoleSubject` --------------------------------------------------------------

    def serve_cameras(self, base: str) -> None:
        """Robots that run elsewhere say themselves where their pictures are."""

    def show_scene(self) -> None:
        """There is nothing to be drawn here: of the world only messages are known."""

    def note(self, text: str) -> None:
        """Something has gone wrong that people should know of."""
        self.recorder.tell(self.clock.now, "console", text, "link")

    def begin(self) -> None:
        """Take part, tell what there is, and from then on what changes."""
        self.agent.on_record = self._note_record
        self.agent.start()
        clock = self.clock
        clock.every(POLL, self._ask_who, start=clock.now + 0.05)
        clock.every(ASK_SENSORS, self._ask_sensors, start=clock.now + POLL)
        clock.call_after(FIRST_SCENE, self._tell_scene)
        clock.pulse(POSITIONS, self._tell_positions)
        clock.pulse(ROWS, self._tell_rows)
        clock.pulse(SOON, self._tell_news)
        clock.pulse(DEVICES, self._tell_devices)

    def close(self) -> None:
        """Take part no more."""
        self.device.leave()
        self.network.close()

    # --- what is asked ---------------------------------------------------------------------

    @property
    def answers(self) -> bool:
        """Whether the DVA has said something a moment ago."""
        return self.clock.now - self._heard < UNHEARD

    @property
    def role(self) -> str:
        """What the DVA lets this console do: `look`, `drive`, `dispatch` or `supervise`."""
        dispatch = self.agent.dispatch
        return (dispatch.role if dispatch is not None else None) or "look"

    def _ask_who(self) -> None:
        def answered(reply: m.Reply) -> None:
            self._heard = self.clock.now
            if reply.code == m.NOT_REGISTERED:  # a DVA that knows nothing of an earlier life
                self.agent.events.clear()
                self.agent.told_at.clear()
            if isinstance(reply.content, m.DeviceList):
                self.told.list(reply.content.devices)

        self.agent.ask(m.GetDeviceList(), answered)

    def _ask_sensors(self) -> None:
        def answered(reply: m.Reply) -> None:
            if isinstance(reply.content, m.SensorList):
                self.told.sensors(reply.content)

        self.agent.ask(m.GetSensorInfo(), answered)

    def robots(self) -> list[str]:
        """Ids of the robots that the DVA lists."""
        known = self.told.devices.items()
        return [i for i, told in known if told.device.device_type == ROBOT and i not in self._fake]

    def label_of(self, id_tag: str) -> str:
        """What a device calls itself."""
        told = self.told.devices.get(id_tag)
        return id_tag if told is None else told.device.label

    def number_of(self, id_tag: str) -> int | None:
        """By which pages know a device."""
        return self._numbers.get(id_tag)

    # --- what is told ----------------------------------------------------------------------

    @property
    def now_ms(self) -> int:
        """Time since the start [ms]."""
        return round(1000 * self.clock.now)

    @property
    def _fake(self) -> dict[str, AgentDevice]:
        return self.fakes.devices

    def _tell_scene(self) -> None:
        """Whoever is new gets a number; an unknown place lies where somebody first is."""
        status = next((t.status for t in self.told.devices.values() if t.status is not None), None)
        if self._site is None and self._frame is SOMEWHERE and status is not None:
            self._frame = GeoFrame(status.position.latitude, status.position.longitude)
        if self.clock.now < FIRST_SCENE and self._frame is SOMEWHERE:
            return
        things = lines.things_of(self.told.devices.values(), self._numbers)
        self._is_shown = True
        self.tell(lines.scene_of_told(things, self.options.dva, self._site, self._frame))

    def _tell_positions(self) -> None:
        if self._frame is SOMEWHERE and any(t.status for t in self.told.devices.values()):
            self._tell_scene()
        if self._is_shown:
            rows = lines.positions(self.told.devices, self._numbers, self._frame)
            self._tell_new({"k": "pos", "t": self.now_ms, "p": rows})

    def _tell_rows(self) -> None:
        if self.answers is not self._answers:
            self._answers = self.answers
            word = "answers" if self._answers else "does not answer: what is shown is old"
            self.recorder.tell(self.clock.now, "dva", word, "link")
        now, devices = self.clock.now, self.told.devices
        clock = {"factor": 1, "paused": False, "lag_s": 0, "given_up_s": 0, "held_by_lag": False}
        robots = {i: told for i, told in devices.items() if told.device.device_type == ROBOT}
        people = {i: t.status for i, t in devices.items() if isinstance(t.status, m.PersonStatus)}
        number = self._numbers.get
        self.tell(
            {
                "k": "rows",
                "t": self.now_ms,
                "clock": clock,
                "link": lines.link(),
                "dropped": self.dropped(),
                "server": self._server(),
                "robots": [
                    lines.robot_row(told, self._numbers[i], now)
                    for i, told in robots.items()
                    if number(i) is not None
                ],
                "people": [
                    {"i": number(i), "doing": s.activity}
                    for i, s in people.items()
                    if number(i) is not None
                ],
                "order": None,
            }
        )

    def _server(self) -> Line:
        told: Line = {"listens": self.answers, "address": self.options.dva, "port": None}
        return told | {"modelled": False, "own": False, "role": self.role}

    def _tell_news(self) -> None:
        agent, labels = self.agent, {i: t.device.label for i, t in self.told.devices.items()}
        rows = [
            lines.event_row(status, agent.told_at[number], labels, self._site, self._frame)
            | about_event(agent, number)
            for number, status in sorted(agent.events.items())
        ]
        self._tell_new({"k": "events", "t": self.now_ms, "events": rows})
        self._tell_new({"k": "control", "t": self.now_ms, "dispatch": self._mode(), "rooms": []})
        moments, self.recorder.timeline = self.recorder.timeline, list[Moment]()
        for time, who, what, kind in moments:
            line = {"k": "story", "t": round(1000 * time), "who": who, "what": what}
            self.tell(line | {"kind": kind})

    def _mode(self) -> Line | None:
        """Who decides, as the DVA says."""
        status = self.agent.dispatch
        if status is None:
            return None
        mode, within = status.dispatch_mode, status.decide_within
        return {"mode": mode, "decide_within_s": within, "switched": None}

    def _tell_devices(self) -> None:
        if self.looked:
            now, may = self.clock.now, self.role == "supervise"
            rows = [
                lines.device_row(told, now, i in self._fake, may)
                for i, told in self.told.devices.items()
            ]
            self.tell({"k": "devices", "t": self.now_ms, "devices": rows})

    def _tell_new(self, line: Line) -> None:
        """Tell a line unless nothing in it has changed, its time apart."""
        said = {name: value for name, value in line.items() if name != "t"}
        if self._newest.get(line["k"]) != said:
            self._newest[line["k"]] = said
            self.tell(line)

    def _note_record(self, record: m.AuditRecord) -> None:
        """What somebody has decided, in words."""
        about = f" about event {record.event_id}" if record.event_id is not None else ""
        refused = f", refused: {record.text}" if record.code != m.OK else ""
        said = f"{record.action.replace('_', ' ')}{about}{refused}"
        self.recorder.tell(self.clock.now, record.label, said, "order")

    # --- fake devices ----------------------------------------------------------------------

    def _make(self, id_tag: str, label: str, kind: str, address: str) -> AgentDevice:
        return AgentDevice(
            id_tag=id_tag,
            label=label,
            device_type=kind,
            address=address,
            dva=DVA,
            network=self.network,
            recorder=self.recorder,
            frame=self._frame,
            timeout=TIMEOUT,
            attempts=ATTEMPTS,
            time_of_day=start_of_day(self.clock),
        )

    def _is_known(self, id_tag: str) -> bool:
        return id_tag in (DVA, self.device.id_tag) or id_tag in self.told.devices

    def _drop(self, id_tag: str) -> None:
        """The DVA there finds out by itself that it is silent."""


def _identity(number: int) -> tuple[str, str]:
    return id_of("fake", number), NOWHERE.format(number % 250 + 1)
