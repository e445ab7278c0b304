"""A system as a control room of the console knows it: what is asked of its DVA, and heard.

Nothing here waits for the DVA: it is asked again and again, and what it last said stays known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container
from functools import partial
from typing import Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import PEER_STATUS, RENEW_PERIOD, do_nothing
from dva_sim.console.bench import Bench, BenchView
from dva_sim.console.system.served_regions import ALARM_AFTER, ServedRegions
from dva_sim.console.system.site_control_room import SiteControlRoom
from dva_sim.console.system.system_state import SystemState
from dva_sim.console.system.things import UNKNOWN_PERSON, UNKNOWN_ROBOT, Things
from dva_sim.console.wire.rows import Hearing
from dva_sim.console.wire.scenes import ThingBody, ThingShown
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.realtime import PacedClock
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import GUARD, ROBOT, ControlRoomRole
from dva_sim.simulation.full.stage import DVA
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import Site

ANSWER_WITHIN: Final = 1.0  # the DVA's answer, after which it counts as silent [s]
POLL: Final = 2.0  # from one question who is there to the next [s]
QUIET: Final = 1.0  # without a word, as half-way between two heartbeats, it is asked at once [s]
UNHEARD: Final = 1.6  # without a word the DVA counts as silent; on slow links later [s]
LOOK: Final = 0.1  # from one look whether it is time to ask to the next [s]
ASK_SENSORS: Final = 10.0  # between questions about sensors and cameras [s]
SOMEWHERE: Final = GeoFrame(0.0, 0.0)
MAX_THINGS: Final = 250  # robots and guards that have joined from outside and are shown
SHOWN: Final[dict[str, tuple[str, ThingBody]]] = {
    ROBOT: ("robot", UNKNOWN_ROBOT),
    GUARD: ("guard", UNKNOWN_PERSON),
}


class KnownSystem:
    """System of a DVA.

    Args:
        agent: The console's own control room.
        clock: Clock of the console.
        recorder: Keeps the story.
        dva: Address of the DVA.
        labels: Labels of all devices ever known, by id.
        regions: Regions of the site, of which its DVAs tell.
        site: Site, if one is known.
        bench: Bench on which the DVA runs; None: it runs elsewhere.
        view: View of the devices on the bench.
        things: Robots and people that are known already, with their numbers.
        own: Function that returns the ids of the devices of the console's own run.

    Attributes:
        device: Device of the console's own control room.
        state: State reported by the devices.
        frame: Origin of the map.
        has_all_events: True once the DVA has sent all its events since its last restart.
        switched: Time of the latest change of the mode of dispatch [s].
        on_devices: Callback when somebody from outside appears or disappears, or the DVA moves.
    """

    def __init__(
        self,
        agent: SiteControlRoom,
        *,
        clock: PacedClock,
        recorder: Recorder,
        dva: str,
        labels: dict[str, str],
        regions: ServedRegions,
        site: Site | None,
        bench: Bench | None,
        view: BenchView | None = None,
        things: Things | None = None,
        own: Callable[[], Container[str]] = tuple,
    ) -> None:
        self.agent = agent
        self.device = agent.device
        self.clock = clock
        self.recorder = recorder
        self.dva = dva
        self.labels = labels
        self.regions = regions
        self.site = site
        self.frame = SOMEWHERE if site is None else site.frame
        self.bench = bench
        self.things = things or Things()
        self.numbers = self.things.numbers
        self.on_devices: Callable[[], object] = do_nothing
        self.view = view or BenchView()
        self.state = SystemState(self.device, labels, own, self.view, self._number_all)
        self.has_all_events = False
        self.switched = 0.0
        self._started = 0.0
        self._foreign: set[str] = set()
        self._here: dict[str, str] = {}  # labels of those from outside who are shown, by id
        self._listed: dict[str, float] = {}  # time of each DVA's newest list of devices [s]
        self._forgotten = -math.inf  # time at which the DVA last knew nothing of this console [s]
        self._asked = -POLL
        self._asking: set[ControlRoomAgent] = set()
        self._was_silent = False
        self._round_trip = 0.0  # of the latest question who is there [s]

    def start(self) -> None:
        """Take part, and ask again and again."""
        self.agent.on_list = self._note_all_events
        self.agent.on_dispatch = self._note_switch
        for room in self.agent.rooms:
            room.on_forgotten = self._ask_again
        self.agent.start()
        for device, dva in self.view.team():
            self.state.meet(device, dva, math.inf)  # as if on the newest list until it is on one
        for dva in self.regions.own.values():
            own = self.device.id_tag
            self.device.network.subscribe(own, dva, PEER_STATUS, partial(self._hear_dva, dva))
        clock = self.clock
        self._started = clock.now
        clock.every(LOOK, self._look, start=clock.now + 0.05)
        clock.every(ASK_SENSORS, self._ask_sensors, start=clock.now + POLL)

    # --- what is asked ---------------------------------------------------------------------

    @property
    def hearing(self) -> Hearing:
        """Return `answers`, `silent`, or `never` for a DVA unheard since the start."""
        if (heard := self._heard) is None:
            return "never"
        is_there = self.clock.now - heard < UNHEARD + self._round_trip
        return "answers" if is_there else "silent"

    @property
    def answers(self) -> bool:
        """True if the DVA has been heard recently."""
        return self.hearing == "answers"

    @property
    def is_silent(self) -> bool:
        """True if the DVA has said nothing for so long that somebody has to look after it."""
        return self.clock.now - (self._heard or self._started) > ALARM_AFTER

    @property
    def _heard(self) -> float | None:
        """Time of the newest word of a DVA; None: none has said any [s]."""
        heard = (room.device.dva_watch.heard for room in self.agent.rooms)
        return max((time for time in heard if time is not None), default=None)

    def _hear_dva(self, dva: str, data: bytes) -> None:
        message = self.device.read(data, dva)
        if message is not None and isinstance(message.body, m.PeerStatus):
            self.regions.heard[dva] = self.clock.now, message.body

    @property
    def role(self) -> str:
        """Role that the DVA grants this console: `look`, `drive`, `dispatch` or `supervise`.

        On a bench it is `supervise`: the DVA learns of it as soon as somebody decides.
        """
        if self.bench is not None:
            return "supervise"
        dispatch = self.agent.dispatch
        return (dispatch.role if dispatch is not None else None) or "look"

    def let_decide(self, then: Callable[[], object]) -> None:
        """Call `then` once the DVA takes this console for one where people decide."""
        if self.bench is None:
            then()
        else:
            self.bench.appoint(self.device.id_tag, ControlRoomRole.SUPERVISE, then)

    def move(self, address: str) -> None:
        """Follow the DVA to another address."""
        self.dva = address
        self.device.introduce(DVA, address)
        self.on_devices()

    def _look(self) -> None:
        """Ask who is there every 2 s, and as soon as the DVA has been quiet for a while."""
        self._was_silent |= not self.answers
        now = self.clock.now
        heard = self.device.dva_watch.heard or 0.0
        is_due = now - self._asked >= POLL or now - max(heard, self._asked) >= QUIET
        if is_due:
            self._asked = now
            for room in self.agent.rooms:
                if room not in self._asking:
                    self._ask_who(room)

    def _ask_who(self, room: ControlRoomAgent) -> None:
        asked_at = self.clock.now
        dva = room.device.dva
        self._asking.add(room)

        def answered(reply: m.Reply) -> None:
            self._asking.discard(room)
            if room is self.agent:
                self._round_trip = min(self.clock.now - asked_at, ANSWER_WITHIN)
                if self._was_silent and self.has_all_events:
                    self._ask_again()  # it may know nothing of an earlier life
                self._was_silent = False
            if isinstance(reply.content, m.DeviceList):
                own = {each.device.id_tag for each in self.agent.rooms}
                self._listed[dva] = self.clock.now
                self.state.list([d for d in reply.content.devices if d.id_tag not in own], dva)

        room.ask(m.GetDeviceList(), answered, lambda: self._asking.discard(room))

    def _ask_again(self) -> None:
        """Discard the news of events, and ask each DVA for its events again, the first one last."""
        self.has_all_events = False
        self._forgotten = self.clock.now
        for room in reversed(self.agent.rooms):
            room.events.clear()
            room.received_at.clear()
            self.clock.call_after(0.0, room.refresh)  # after the device has registered again

    def _note_all_events(self) -> None:
        self.has_all_events = True

    def _note_switch(self, status: m.DispatchStatus) -> None:
        by = status.switched
        self.switched = self.clock.now - (0.0 if by is None else by.ago)

    def _ask_sensors(self) -> None:
        def answered(reply: m.Reply) -> None:
            if isinstance(reply.content, m.SensorList):
                self.state.sensors(reply.content)

        if not all(map(self.state.is_own, self.state.devices)):
            for room in self.agent.rooms:
                room.ask(m.GetSensorInfo(), answered)

    # --- robots and people -----------------------------------------------------------------

    def _number_all(self) -> None:
        """Give robots and guards from outside a number, which stays theirs."""
        foreign = [id_tag for id_tag in self._foreign if id_tag in self.state.devices]
        room = MAX_THINGS - len(foreign)
        for id_tag, entry in self.state.devices.items():
            kind, body = SHOWN.get(entry.device.device_type, ("", {}))
            label = entry.device.label
            if id_tag in self._foreign:
                self.things.rename(id_tag, label)
            elif kind and room > 0 and id_tag not in self.numbers:
                self.things.add_foreign(id_tag, label, kind, body)
                self._foreign.add(id_tag)
                room -= 1
        here = {i: self.labels[i] for i in self._foreign if i in self.state.devices}
        if here != self._here:
            self._here = here
            self.on_devices()

    def things_here(self) -> list[ThingShown]:
        """Return everybody but those from outside who have gone."""
        gone = self._foreign - self.state.devices.keys()
        return [thing for thing in self.things.all if thing["id"] not in gone]

    def robots(self) -> list[str]:
        """Return ids of the robots that a DVA lists, and of those that can be seen."""
        return [i for i, one in self.state.devices.items() if one.device.device_type == ROBOT]

    def is_lost(self, id_tag: str) -> bool:
        """Return True if the DVA had listed a device, and no longer does: it has fallen silent.

        After a restart of the DVA all devices have the time to register again.
        """
        if self.clock.now - self._forgotten < RENEW_PERIOD + POLL:
            return False
        entry = self.state.devices[id_tag]
        return entry.listed < self._listed.get(entry.dva, -math.inf)

    def dva_of(self, id_tag: str) -> str | None:
        """Return the id of the DVA that lists a device; None if none does."""
        entry = self.state.devices.get(id_tag)
        return None if entry is None else entry.dva

    def id_of(self, number: int) -> str | None:
        """Return the id of a thing that pages know by a number; None: there is none."""
        return next((str(each["id"]) for each in self.things.all if each["i"] == number), None)

    def label_of(self, id_tag: str) -> str:
        """Return the label of a device."""
        return self.labels.get(id_tag, id_tag)

    def named(self, text: str) -> str:
        """Return the name of a device by its id, or of things by their numbers, as in `0, 1`."""
        by_number = {str(each["i"]): each["label"] for each in self.things.all}
        words = text.split(", ")
        return ", ".join(by_number.get(one, self.label_of(one)) for one in words)

    # --- the rest that is known ------------------------------------------------------------

    @property
    def now_ms(self) -> int:
        """Time since the start [ms]."""
        return round(1000 * self.clock.now)

    @property
    def is_placed(self) -> bool:
        """True if the geographic position of the map is known."""
        return self.frame is not SOMEWHERE

    def find_place(self) -> bool:
        """Place an unknown site where somebody first is; return whether that was possible."""
        status = next((t.status for t in self.state.devices.values() if t.status is not None), None)
        if self.is_placed or status is None:
            return False
        self.frame = GeoFrame(status.position.latitude, status.position.longitude)
        return True

    def age_of(self, event: int | None) -> float | None:
        """Return how long ago an event was first reported [s]."""
        if event is None or (status := self.agent.events.get(event)) is None:
            return None
        return status.age + self.clock.now - self.agent.received_at[event]
