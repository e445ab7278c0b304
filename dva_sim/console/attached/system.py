"""A system that runs elsewhere, as a control room knows it: what is asked of its DVA, and heard.

Nothing here waits for the DVA: it is asked again and again, and what it last said stays known.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import AgentDevice, do_nothing
from dva_sim.console.asking.refusal import Refused
from dva_sim.console.attached.links import AttachedLinks
from dva_sim.console.attached.options import scenario_shown
from dva_sim.console.bench import Bench
from dva_sim.console.dva.fake_devices import NOWHERE, FakeDevices
from dva_sim.console.run.real_links import start_of_day
from dva_sim.console.views.system_state import SystemState
from dva_sim.console.wire.rows import Hearing
from dva_sim.options.runs import ConsoleOptions
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import CONTROL_ROOM, ROBOT, ControlRoomRole
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.simulation.scenario import Scenario, site_of
from dva_sim.worlds.geo import GeoFrame

TIMEOUT, ATTEMPTS = 1.0, 2  # of what the DVA is asked [s]
POLL: Final = 2.0  # from one question who is there to the next [s]
QUIET: Final = 1.0  # without a word, as half-way between two heartbeats, it is asked at once [s]
UNHEARD: Final = 1.6  # without a word the DVA counts as silent; on slow links later [s]
LOOK: Final = 0.1  # from one look whether it is time to ask to the next [s]
ASK_SENSORS: Final = 10.0  # between questions about sensors and cameras [s]
SOMEWHERE: Final = GeoFrame(0.0, 0.0)


class AttachedSystem:
    """System at another DVA.

    Args:
        options: Address of the DVA, and other options.
        links: Connections to the DVA.
        bench: Bench on which the DVA runs; None: it runs elsewhere.

    Attributes:
        dva: Address of the DVA.
        clock: Real time.
        recorder: Keeps the story.
        note: Function that notifies people of a failure.
        agent: The console's own control room.
        state: State reported by the devices.
        fakes: Devices that were added by hand.
        numbers: Stable numbers by which pages know devices.
        site: Site of the scenario, if one is named.
        scenario: Scenario that is named, or one of defaults: equipment of who drives.
        labels: Labels of all devices that were ever listed, by id.
        has_all_events: True once the DVA has sent all its events since its last restart.
        on_devices: Callback when a device appears or disappears.
        on_record: Callback for each decision that the DVA publishes.

    Raises:
        ConfigError: the site cannot be read.
    """

    def __init__(
        self, options: ConsoleOptions, links: AttachedLinks, bench: Bench | None = None
    ) -> None:
        self.options = options
        self.bench = bench
        self.dva = str(options.dva)
        self._links = links
        self.clock = links.clock
        self.recorder = links.recorder
        self.note = links.note
        named = scenario_shown(options)
        self.site = None if named is None else site_of(named, 1)
        self.scenario = named or Scenario()
        self.labels = dict[str, str]()
        self.numbers = dict[str, int]()
        self.frame = self.site.frame if self.site is not None else SOMEWHERE
        self.device = self._make(links.own, "control room", CONTROL_ROOM, links.address)
        self.agent = ControlRoomAgent(self.device)
        self.on_devices: Callable[[], object] = do_nothing
        self.on_record: Callable[[m.AuditRecord], object] = do_nothing
        self.state = SystemState(self.device, self.labels, lambda: self.on_devices())
        self.fakes = FakeDevices(
            self._make_fake,
            is_known=self._is_known,
            id_of=_identity,
            dismiss=do_nothing,  # the DVA there finds out by itself that it is silent
            removed="speaks no more: the DVA takes it from its list within some seconds",
        )
        self.has_all_events = False
        self._asked = -POLL
        self._is_asking = self._was_silent = False
        self._round_trip = 0.0  # of the latest question who is there [s]

    def start(self) -> None:
        """Take part, and ask again and again."""
        self.agent.on_list = self._note_all_events
        self.agent.on_record = self._note_record
        self.agent.on_forgotten = self._ask_again
        self.agent.start()
        clock = self.clock
        clock.every(LOOK, self._look, start=clock.now + 0.05)
        clock.every(ASK_SENSORS, self._ask_sensors, start=clock.now + POLL)

    def close(self) -> None:
        """Take part no more."""
        self.device.leave()
        self._links.close()

    # --- what is asked ---------------------------------------------------------------------

    @property
    def hearing(self) -> Hearing:
        """Return `answers`, `silent`, or `never` for a DVA unheard since the start."""
        if (heard := self.device.dva_watch.heard) is None:
            return "never"
        is_there = self.clock.now - heard < UNHEARD + self._round_trip
        return "answers" if is_there else "silent"

    @property
    def answers(self) -> bool:
        """True if the DVA has been heard recently."""
        return self.hearing == "answers"

    @property
    def role(self) -> str:
        """Role that the DVA grants this console: `look`, `drive`, `dispatch` or `supervise`.

        On a bench it is `supervise`: the DVA learns of it as soon as somebody decides.
        """
        if self.bench is not None:
            return "supervise"
        dispatch = self.agent.dispatch
        return (dispatch.role if dispatch is not None else None) or "look"

    def decide(
        self,
        body: m.Body,
        then: Callable[[m.Reply], object] = do_nothing,
        failed: Callable[[], object] = do_nothing,
    ) -> None:
        """Ask the DVA for what a person here has decided."""
        self.let_decide(lambda: self.agent.ask(body, then, failed))

    def let_decide(self, then: Callable[[], object]) -> None:
        """Call `then` once the DVA takes this console for one where people decide."""
        if self.bench is None:
            then()
        else:
            self.bench.appoint(self.device.id_tag, ControlRoomRole.SUPERVISE, then)

    def move(self, address: str) -> None:
        """The DVA listens elsewhere."""
        self.dva = address
        self.device.introduce(DVA, address)
        self.on_devices()

    def _look(self) -> None:
        """Ask who is there every 2 s, and as soon as the DVA has been quiet for a while."""
        self._was_silent |= not self.answers
        now = self.clock.now
        heard = self.device.dva_watch.heard or 0.0
        is_due = now - self._asked >= POLL or now - max(heard, self._asked) >= QUIET
        if is_due and not self._is_asking:
            self._ask_who()

    def _ask_who(self) -> None:
        asked = self._asked = self.clock.now
        self._is_asking = True

        def answered(reply: m.Reply) -> None:
            self._is_asking = False
            self._round_trip = min(self.clock.now - asked, TIMEOUT)
            if self._was_silent and self.has_all_events:
                self._ask_again()  # it may know nothing of an earlier life
            self._was_silent = False
            if isinstance(reply.content, m.DeviceList):
                self.state.list(reply.content.devices)

        def failed() -> None:
            self._is_asking = False

        self.agent.ask(m.GetDeviceList(), answered, failed)

    def _ask_again(self) -> None:
        """Nothing of what was told of events counts until the DVA has told all there are."""
        self.has_all_events = False
        self.agent.events.clear()
        self.agent.received_at.clear()
        self.clock.call_after(0.0, self.agent.refresh)  # after the device has registered again

    def _note_all_events(self) -> None:
        self.has_all_events = True

    def _ask_sensors(self) -> None:
        def answered(reply: m.Reply) -> None:
            if isinstance(reply.content, m.SensorList):
                self.state.sensors(reply.content)

        self.agent.ask(m.GetSensorInfo(), answered)

    def _note_record(self, record: m.AuditRecord) -> None:
        """Note somebody's decision, in words."""
        about = f" about event {record.event_id}" if record.event_id is not None else ""
        refused = f", refused: {record.text}" if record.code != m.OK else ""
        text = f"{record.action.replace('_', ' ')}{about}{refused}"
        self.recorder.tell(self.clock.now, record.label, text, "order")
        self.on_record(record)

    # --- what is known ---------------------------------------------------------------------

    @property
    def now_ms(self) -> int:
        """Time since the start [ms]."""
        return round(1000 * self.clock.now)

    @property
    def is_placed(self) -> bool:
        """True if the geographic position of the map is known."""
        return self.frame is not SOMEWHERE

    def find_place(self) -> bool:
        """An unknown place lies where somebody first is; whether it is found by that."""
        status = next((t.status for t in self.state.devices.values() if t.status is not None), None)
        if self.is_placed or status is None:
            return False
        self.frame = GeoFrame(status.position.latitude, status.position.longitude)
        return True

    def robots(self) -> list[str]:
        """Ids of the robots that the DVA lists."""
        devices = self.state.devices.items()
        return [id_tag for id_tag, entry in devices if entry.device.device_type == ROBOT]

    def is_fake(self, id_tag: str) -> bool:
        """Return True if a device was added by hand, here."""
        return id_tag in self.fakes.devices

    def id_of(self, number: int) -> str | None:
        """The id of a device that pages know by a number; None: there is none."""
        return next((i for i, known in self.numbers.items() if known == number), None)

    def label_of(self, id_tag: str) -> str:
        """Return the label of a device."""
        state = self.state.devices.get(id_tag)
        return self.labels.get(id_tag, id_tag) if state is None else state.device.label

    def named(self, given: str) -> str:
        """The name of a device by its id, or of things by their numbers, as in `0, 1`."""
        by_number = {str(number): id_tag for id_tag, number in self.numbers.items()}
        return ", ".join(self.label_of(by_number.get(one, one)) for one in given.split(", "))

    def age_of(self, event: int | None) -> float | None:
        """Return how long ago an event was first reported [s]."""
        if event is None or (status := self.agent.events.get(event)) is None:
            return None
        return status.age + self.clock.now - self.agent.received_at[event]

    # --- devices ---------------------------------------------------------------------------

    def new_seat(self, number: int, kind: str) -> AgentDevice:
        """Let the device of the n-th seat take part, from 1.

        Raises:
            Refused: there is no key for it.
            NetworkError: no port can be had.
        """
        id_tag = self._links.seat_id(number)
        return self._make(id_tag, f"console-{number}", kind, self._links.join(id_tag))

    def _make(self, id_tag: str, label: str, kind: str, address: str) -> AgentDevice:
        return AgentDevice(
            id_tag=id_tag,
            label=label,
            device_type=kind,
            address=address,
            dva=DVA,
            network=self._links.network,
            recorder=self.recorder,
            frame=self.frame,
            labels=self.labels,
            timeout=TIMEOUT,
            attempts=ATTEMPTS,
            time_of_day=start_of_day(self.clock),
        )

    def _make_fake(self, id_tag: str, label: str, kind: str, address: str) -> AgentDevice:
        if self.options.keys is not None:
            raise Refused("with --keys, a fake device would need a key of its own")
        return self._make(id_tag, label, kind, address)

    def _is_known(self, id_tag: str) -> bool:
        return id_tag in (DVA, self.device.id_tag) or id_tag in self.state.devices


def _identity(number: int) -> tuple[str, str]:
    return id_of("fake", number), NOWHERE.format(number % 250 + 1)
