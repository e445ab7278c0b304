"""A system whose DVA runs elsewhere, for pages: all that is known comes by messages."""

from __future__ import annotations

from typing import Final

from typing_extensions import override

from dva_sim.agents.device import AgentDevice, do_nothing
from dva_sim.agents.operator.handheld import Console
from dva_sim.console.asking.refusal import Refused
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.audit.decisions_audited import DecisionAudit
from dva_sim.console.bench import Bench
from dva_sim.console.desk.console_pages import ConsolePages
from dva_sim.console.driving.driven_system import REACH, DrivenSystem
from dva_sim.console.driving.seating import Seating
from dva_sim.console.dva.fake_devices import DOCUMENTATION_ADDRESS, FakeDevices
from dva_sim.console.remote.links import RemoteLinks
from dva_sim.console.remote.named_people import NamedPeople
from dva_sim.console.remote.options import scenario_shown
from dva_sim.console.remote.remote_scene import LINK, remote_scene
from dva_sim.console.system.known_system import SOMEWHERE, KnownSystem
from dva_sim.console.system.request_reader import LOG, RequestReader
from dva_sim.console.system.served_regions import regions_of
from dva_sim.console.system.site_control_room import SiteControlRoom
from dva_sim.console.wire.arguments import LogsLooked
from dva_sim.console.wire.rows import ServerShown
from dva_sim.console.wire.scenes import LinkShown, SceneLine
from dva_sim.network.patterns import Pattern, load_pattern
from dva_sim.options.runs import ConsoleOptions
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import CONTROL_ROOM, OPERATOR
from dva_sim.simulation.full.control_room import setup_by
from dva_sim.simulation.full.stage import DVA, dvas_of, id_of
from dva_sim.simulation.scenario import Scenario, phone_profile, plan_of, site_of

FIRST_SCENE: Final = 1.5  # so long a position is waited for, where no site is known [s]
SPEAKS_NO_MORE: Final = "speaks no more: the DVA takes it from its list within some seconds"
READ_REQUESTS: Final = 0.1  # from one look at the DVA's log of requests to the next [s]


class RemotePages(ConsolePages):
    """State of a remote system for pages.

    Args:
        options: Address of the DVA, and other options.
        links: The console's place among the devices of the DVA.
        keeper: Keeper of the audit log.
        bench: Bench on which the DVA runs; None: it runs elsewhere.

    Attributes:
        requests: Reader of the DVA's log of requests.

    Raises:
        ConfigError: the site cannot be read.
    """

    audited: DecisionAudit

    def __init__(
        self,
        options: ConsoleOptions,
        links: RemoteLinks,
        keeper: AuditKeeper,
        bench: Bench | None = None,
    ) -> None:
        named = scenario_shown(options)
        scenario = self.scenario = named or Scenario()
        self._has_keys = options.keys is not None
        self._links = links
        site = None if named is None else site_of(named, 1)
        self._plan = None if site is None else plan_of(scenario.dva.regions, site)
        frame = site.frame if site is not None else SOMEWHERE
        own = links.device(
            links.own, "control room", CONTROL_ROOM, address=links.address, frame=frame
        )
        dvas = dvas_of(scenario)
        links.labels.update(dvas)
        others = [
            links.device(
                id_tag,
                f"control room at {dvas[dva]}",
                CONTROL_ROOM,
                address=links.join(id_tag),
                frame=frame,
                dvas=(dva,),
            )
            for id_tag, dva in zip(links.others, links.dvas[1:], strict=True)
        ]
        system = KnownSystem(
            SiteControlRoom(own, *others),
            clock=links.clock,
            recorder=links.recorder,
            dva=str(options.dva),
            labels=links.labels,
            regions=regions_of(scenario),
            site=site,
            bench=bench,
        )
        patterns: dict[str, str] = {}
        driven = DrivenSystem(system, scenario, patterns, lambda client: self.author(client))

        def pattern_for(robot: str) -> Pattern:
            return load_pattern(driven.pattern_of(robot))()

        setup = setup_by(scenario, pattern=pattern_for, topic=lambda _: None)
        console = Console(setup=setup, phone=phone_profile(scenario), reach=lambda _: REACH)
        driven.seating = Seating(self._new_seat, console, do_nothing)
        super().__init__(
            system, rooms=NamedPeople(system), driven=driven, fakes=self._fakes(system), phones={}
        )
        self.requests = RequestReader(system.agent, lambda line: self.tell(line))
        self.keep_audit(keeper)

    def close(self) -> None:
        """Take part no more."""
        for room in self.system.agent.rooms:
            room.device.leave()
        self._links.close()

    # --- see `ConsolePages` ----------------------------------------------------------------

    @override
    def begin(self) -> None:
        super().begin()
        self.clock.call_after(FIRST_SCENE, self.tell_scene)
        self.clock.pulse(READ_REQUESTS, self.requests.go_on)

    @override
    def tell_scene(self) -> None:
        # The first position that is heard becomes the origin of an unknown site.
        self.system.find_place()
        if self.clock.now >= FIRST_SCENE or self.system.is_placed:
            super().tell_scene()

    @override
    def scene(self) -> SceneLine:
        system = self.system
        scene = remote_scene(
            system.things_here(),
            address=system.dva,
            own_pattern=self.driven.own_pattern,
            site=system.site,
            frame=system.frame,
            regions=self._plan,
        )
        if system.bench is not None:
            scene["begins_at"] = "main"
        return scene

    @override
    def link(self) -> LinkShown:
        return LINK

    @override
    def server(self) -> ServerShown:
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

    @override
    def look(self, line: LogsLooked) -> None:
        super().look(line)
        self.requests.is_looked = LOG in line["logs"]

    # --- devices of the console ------------------------------------------------------------

    def _new_seat(self, number: int) -> AgentDevice:
        """Let the device of the n-th seat take part, from 1.

        Raises:
            Refused: there is no key for it.
            NetworkError: no port can be had.
        """
        id_tag = self._links.seat_id(number)
        address = self._links.join(id_tag)
        frame = self.system.frame
        device = self._links.device(
            id_tag, f"console-{number}", OPERATOR, address=address, frame=frame
        )
        robots = [robot for robot in self.driven.robots() if self.driven.hears(robot)]
        self.driven.introduce(device, robots)
        for robot in robots:
            device.connect(robot)  # an emergency does not wait for a connection
        return device

    def _fakes(self, system: KnownSystem) -> FakeDevices:
        def make(id_tag: str, label: str, kind: str, address: str) -> AgentDevice:
            if self._has_keys:
                raise Refused("with --keys, a fake device would need a key of its own")
            return self._links.device(id_tag, label, kind, address=address, frame=system.frame)

        return FakeDevices(
            make,
            is_known=lambda device: (
                device in (DVA, system.device.id_tag) or device in system.state.devices
            ),
            id_of=lambda number: (
                id_of("fake", number),
                DOCUMENTATION_ADDRESS.format(number % 250 + 1),
            ),
            dismiss=self._dismiss,
            removed="is removed" if system.bench is not None else SPEAKS_NO_MORE,
        )

    def _dismiss(self, device: str) -> None:
        """Have the DVA forget a device; one elsewhere finds out by itself that it is silent."""
        if (bench := self.system.bench) is not None:
            bench.forget(device, lambda: self.system.state.forget(device))

    @override
    def hear_record(self, record: m.AuditRecord) -> None:
        super().hear_record(record)
        about = f" about event {record.event_id}" if record.event_id is not None else ""
        refused = f", refused: {record.text}" if record.code != m.OK else ""
        text = f"{record.action.replace('_', ' ')}{about}{refused}"
        self.system.recorder.tell(self.clock.now, record.label, text, "order")
