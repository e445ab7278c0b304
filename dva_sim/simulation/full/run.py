"""Build a run from a scenario, let its virtual time pass, and keep its results.

The transport of a scenario's messages, and its demands on a robot's link, are decided here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Any, Protocol

from dva_sim.agents.observation import OVER_ZMQ, Cameras
from dva_sim.agents.people.bystander import ALARMED, EVACUATING, SAFE, BystanderAgent
from dva_sim.core.events import Event
from dva_sim.core.store import Store
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Accepted, ByHand, Recorder
from dva_sim.network.connections import HEADERS, MSS, Connector, Load
from dva_sim.network.link import (
    ConstantRate,
    Direction,
    Link,
    LinkConfig,
    check_partitions,
    part_links,
)
from dva_sim.network.link.link import Reception, make_link
from dva_sim.network.messaging import Transport
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol.exchange import NOON
from dva_sim.protocol.facts import Fact
from dva_sim.simulation.full.control_room import add_dispatcher, add_dva, add_operator
from dva_sim.simulation.full.disturbance import Disturbance
from dva_sim.simulation.full.dva_server import DvaAgent
from dva_sim.simulation.full.observations import (
    FactLog,
    Listener,
    Observer,
    Page,
    RobotMotion,
    motion_of,
    page_of,
    terms_of,
)
from dva_sim.simulation.full.physical_world import Field, is_dangerous
from dva_sim.simulation.full.recording import (
    PersonLog,
    Recording,
    ending_of,
    event_about,
    log_of,
)
from dva_sim.simulation.full.safety_checks import SafetyAudit
from dva_sim.simulation.full.stage import DVA, Stage, dvas_of, id_of
from dva_sim.simulation.scenario import Scenario, request_timeout_s
from dva_sim.simulation.scenario.parts import DvaDeath

# Rate of messages besides pictures and commands: heartbeats, status, orders; assumed, and ample.
OTHERS_HZ = 20.0
MESSAGE = 1000  # upper bound of the size of a message other than a picture, with headers [B]
COINCIDING_MESSAGES = 10  # messages that may coincide with a picture; assumed


def compute_load(scenario: Scenario) -> Load:
    """Return the greatest load of a robot's link, in the busier direction."""
    frame = scenario.camera.frame_bytes
    picture = frame + -(-frame // MSS) * HEADERS
    messages = MESSAGE * (scenario.command.rate_hz + OTHERS_HZ)
    rate = 8.0 * (scenario.camera.rate_hz * picture + messages)
    return Load(rate, picture + COINCIDING_MESSAGES * MESSAGE)


LAN = LinkConfig(delay_s=0.0005, rate_bps=1e9, queue_bytes=10_000_000)
WATCH_PERIOD = 0.5  # interval at which tracks are sampled and rules are checked [s]
FILM_PERIOD = 0.1  # the same if pictures are wanted [s]


def simulate(scenario: Scenario, seed: int, keep_traffic: bool = False) -> Recording:
    """Run one scenario.

    Args:
        seed: Random seed of everything but the persons.
        keep_traffic: Keep messages, the operators' views and finer tracks, for pictures and
            recordings.

    Raises:
        ConfigError: the site cannot hold the team or the events.
    """
    return Run(scenario, seed, keep_traffic).run()


def rehearse(scenario: Scenario, seed: int) -> None:
    """Build a run without letting any time pass, to find what cannot work before it counts.

    Raises:
        ConfigError: a map or trace that cannot be read, a team or an event without a place.
    """
    Run(scenario, seed)


class RealLinks(Protocol):
    """Sockets that carry the messages of a run, in place of the modelled network."""

    @property
    def network(self) -> Transport:
        """Transport of the messages."""

    def join(self, kind: str, number: int) -> str:
        """Open the sockets of a device by its kind and number; return its address."""

    def time_of_day(self) -> tuple[float, bool]:
        """Return the start of the run [s since midnight], and True for exact timestamps."""

    def watch(self, listener: Listener) -> None:
        """Report each message that is sent or arrives to a listener."""


@dataclass(frozen=True)
class Watched:
    """Options of a run whose clock is driven from outside, and that people may join.

    Attributes:
        clock: Clock of the run.
        recorder: Recorder of the run.
        cameras: Addresses of the robots' pictures.
        seats: Number of operators, the last ones, who are people if the scenario names none.
        keeps: True to keep everything for measures; a run without it may last for ever.
        real: Transport of the messages; None: the network that the scenario models.
        memory: State that survives the DVA.
        time_of_day: Time of day at the start, and exactness of timestamps; see `AgentDevice`.
            Devices that restart need exact ones.
        attended: True if people at a console may release robots after an emergency.
    """

    clock: Clock
    recorder: Recorder
    cameras: Cameras = OVER_ZMQ
    seats: int = 0
    keeps: bool = True
    real: RealLinks | None = None
    memory: Store | None = None
    time_of_day: tuple[float, bool] = (NOON, False)
    attended: bool = False


class Run:
    """Run of a scenario: all devices in place on the network at time zero.

    Args:
        seed: Random seed of everything but the persons.
        keep_traffic: Keep messages and the operators' views, for pictures.
        watched: Options of a run that people watch and join.

    Attributes:
        dvas: The DVAs by id: the one, or one for each region.
        persons: Numbers of the operators who are people.
    """

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        keep_traffic: bool = False,
        watched: Watched | None = None,
    ) -> None:
        watched = watched or Watched(Clock(), Recorder(keep_traffic))
        self.scenario = scenario
        self.clock = watched.clock
        self.recorder = watched.recorder
        self._observers: tuple[Observer, ...] = ()  # the audit first, once all are in place
        self._connector = Connector(
            scenario.transport, scenario.network_depth, scenario.zeromq, compute_load(scenario)
        )
        self.network, self.stage = self._connected(seed, watched)
        check_partitions(scenario.link.partitions, self.stage.labels.values())
        self.is_real = watched.real is not None
        self.links = {} if self.is_real else self._make_links()
        lan = Link(LAN, ConstantRate(LAN.rate_bps), self.stage.streams, "lan")
        self._lan = lan, lan
        self._backbone = {} if self.is_real else self._make_backbone()
        self._keeps_events = watched.keeps
        self._dead: list[DvaAgent] = []  # in whose place others were started
        self.dvas = {
            id_of("dva", number): add_dva(self.stage, None, memory, watched.keeps, number)
            for number, memory in enumerate(self._memories(watched.memory), 1)
        }
        self.field = Field(self.stage)
        self.field.populate()
        count = scenario.operator.count
        last = range(max(0, count - watched.seats) + 1, count + 1)
        self.persons = scenario.operator.persons or tuple(last)
        for number in range(1, count + 1):
            if number not in self.persons:
                add_operator(self.stage, number, self.field.truth)
        self.dispatcher = add_dispatcher(self.stage)
        self.field.schedule_incidents()
        self.audit = SafetyAudit(
            self.recorder,
            terms_of(scenario, attended=watched.attended),
            self._motion_of,
            self.field.place_of,
        )
        self.recorder.on_accepted = self._accepted
        self.recorder.on_hand = self._by_hand
        self._log = self._keep_facts() if keep_traffic else None
        self.observe(self.audit)
        if self._log is not None:
            self.observe(self._log)
        if watched.real is not None:
            watched.real.watch(self)
        Disturbance(self.stage, self._dva_of, self.field)
        for dva in self.dvas.values():
            dva.start()
        for order, death in enumerate(scenario.dva.deaths, 1):
            self._schedule_death(order, death)
        self.clock.every(WATCH_PERIOD, self._watch)
        if watched.keeps:
            self.clock.every(FILM_PERIOD if keep_traffic else WATCH_PERIOD, self._sample)

    def _connected(self, seed: int, watched: Watched) -> tuple[Transport, Stage]:
        """Return the transport of the messages, and the stage on it."""
        scenario = self.scenario
        real = watched.real
        if real is None:
            network: Transport = VirtualNetwork(
                self.clock, self._link_between, self._sent, self._connector, self.delivered
            )
            stage = Stage(
                scenario,
                seed,
                network,
                self.recorder,
                time_of_day=watched.time_of_day,
                cameras=watched.cameras,
                attended=watched.attended,
            )
            return network, stage
        time_of_day = real.time_of_day()
        join = real.join
        stage = Stage(
            scenario,
            seed,
            real.network,
            self.recorder,
            join,
            time_of_day,
            cameras=watched.cameras,
            attended=watched.attended,
        )
        return real.network, stage

    def _memories(self, memory: Store | None) -> list[Store | None]:
        """Return the memory of each DVA; only a single DVA has one here."""
        return [memory] + [None] * (len(dvas_of(self.scenario)) - 1)

    @property
    def dva(self) -> DvaAgent:
        """The DVA, or that of the first region."""
        return self.dvas[DVA]

    @dva.setter
    def dva(self, dva: DvaAgent) -> None:
        self.dvas[DVA] = dva

    def _dva_of(self, robot: str) -> DvaAgent:
        """Return the DVA that a robot obeys."""
        return self.dvas[self.field.robots[robot].device.dva]

    def run(self) -> Recording:
        """Let time pass until all is settled or the horizon is reached."""
        now = 0.0
        horizon = self.scenario.horizon_s
        while now < horizon and not self._settled():
            now = min(now + 1.0, horizon)
            self.clock.run(now)
        return self.recording()

    def recording(self, sampled: bool = True) -> Recording:
        """Return the results of the run so far.

        Args:
            sampled: Rules are checked, and places noted, once more.
        """
        if sampled:
            self._watch()
            self._sample()
        stage = self.stage
        field = self.field
        events = self._events()
        return Recording(
            scenario=self.scenario,
            seed=stage.seed,
            site=stage.site,
            recorder=self.recorder,
            incidents=field.incidents,
            surroundings=field.surroundings,
            labels=stage.labels,
            radii={name: robot.body.spec.radius for name, robot in field.robots.items()},
            duration=self.clock.now,
            contained=field.contained,
            endings=[
                ending_of(event_about(i, events, stage.site, field.robots)) for i in field.incidents
            ],
            events=events,
            robots={name: log_of(robot) for name, robot in field.robots.items()},
            links=self.links,
            people=self._people(),
            depth=self._connector.deepest,
            persons=self.persons,
            facts=sorted(self._facts(), key=lambda fact: fact.time),
        )

    def _events(self) -> list[Event]:
        """Return every event once; for one that was taken over, its latest state."""
        events: dict[int, Event] = {}
        for dva in sorted(self._ever, key=lambda dva: not dva.is_gone):
            events |= {n: event for n, event in dva.events.items() if n not in dva.copies}
        return [events[number] for number in sorted(events)]

    def _facts(self) -> list[Fact]:
        return [fact for dva in self._ever for fact in dva.facts]

    @property
    def _ever(self) -> list[DvaAgent]:
        """Return all DVAs of the run, those that have died first."""
        return [*self._dead, *self.dvas.values()]

    def _people(self) -> list[PersonLog]:
        logs = []
        for name, agent in self.field.people():
            kind = "guard"
            left = (math.inf, math.inf)
            if isinstance(agent, BystanderAgent):
                kind = "bystander"
                left = (agent.leaves_at, agent.out_at)
            dose = agent.dose.heat, agent.dose.toxic
            exposure = self.recorder.exposure[name]
            logs.append(PersonLog(name, kind, agent.activity, exposure, *dose, *left))
        return logs

    def _settled(self) -> bool:
        """Return True if all incidents are known and closed, and nobody drives or is leaving."""
        events = self._events()
        return (
            bool(events)
            and not any(e.open for e in events)
            and all(d.ended is not None for d in self.recorder.drives)
            and not any(b.activity in (ALARMED, EVACUATING) for b in self.field.bystanders)
            and all(
                event_about(i, events, self.stage.site, self.field.robots) is not None
                for i in self.field.incidents
                if i.detected < math.inf
            )
        )

    def start_dva(self, memory: Store) -> None:
        """Start another DVA in place of the crashed one, from its memory."""
        self.dva = add_dva(self.stage, None, memory, self._keeps_events)
        self.dva.start()

    def _schedule_death(self, order: int, death: DvaDeath) -> None:
        """End a DVA at its time, and start it again if the scenario says so."""
        draws = self.stage.streams[f"death-{order}"]
        at_s = float(draws.uniform(death.at_s, max(death.at_s, death.latest_s or 0.0)))
        number = 1 + int(len(self.dvas) * draws.random())
        if death.region is not None:
            number = 1 + list(self.scenario.dva.regions).index(death.region)
        self.clock.call_at(at_s, self.end_dva, number)
        if death.back_after_s is not None:
            self.clock.call_at(at_s + death.back_after_s, self.start_region_again, number)

    def end_dva(self, number: int) -> None:
        """Kill a DVA by its number among those of the regions, without any message."""
        dva = self.dvas[id_of("dva", number)]
        if not dva.is_gone and isinstance(self.network, VirtualNetwork):
            dva.device.tell("is killed", "link")
            self.network.leave(dva.device.id_tag)
            dva.crash()

    def start_region_again(self, number: int) -> None:
        """Start the DVA of a region again, with nothing kept."""
        id_tag = id_of("dva", number)
        if not isinstance(self.network, VirtualNetwork):
            return
        self.stage.devices.remove(self.dvas[id_tag].device)
        self._dead.append(self.dvas[id_tag])
        self.network.come_back(id_tag)
        life = sum(dead.device.id_tag == id_tag for dead in self._dead)
        keeps = self._keeps_events
        self.dvas[id_tag] = add_dva(self.stage, None, None, keeps, number, life)
        self.dvas[id_tag].device.tell("is started again", "link")
        self.dvas[id_tag].start()

    def be_patient(self, scenario: Scenario) -> None:
        """Set all time-outs to those of another scenario, whose link is different."""
        for device in self.stage.devices:
            device.be_patient(request_timeout_s(scenario))

    # --- the network -------------------------------------------------------------------

    def _sent(self, now: float, source: str, to: str, size: int, payload: Any) -> None:
        for observer in self._observers:
            observer.sent(now, source, to, payload)
        self.recorder.message_sent(now, source, to, size, payload)

    def _make_links(self) -> dict[str, tuple[Link, Link]]:
        """Return links to each robot and back, by its id."""
        links = {}
        for number in range(1, self.scenario.robot.count + 1):
            robot = id_of("robot", number)
            links[robot] = self._make_link(robot, "up"), self._make_link(robot, "down")
        return links

    def _make_link(self, robot: str, direction: Direction) -> Link:
        stage = self.stage
        reception = partial(self._reception, robot) if stage.site.wifi else None
        name = f"{stage.labels[robot]}/link"
        return make_link(self.scenario.link, direction, stage.streams, name, reception)

    def _make_backbone(self) -> dict[tuple[str, str], tuple[Link, Link]]:
        """Return the link from each DVA to each other and back; none where all are on the LAN."""
        config = self.scenario.dva.backbone
        links: dict[tuple[str, str], tuple[Link, Link]] = {}
        if config is None:
            return links
        for one, other in combinations(dvas_of(self.scenario), 2):
            name = f"{self.stage.labels[one]}/{self.stage.labels[other]}"
            up = make_link(config, "up", self.stage.streams, name)
            down = make_link(config, "down", self.stage.streams, name)
            links |= {(one, other): (up, down), (other, one): (down, up)}
        return links

    def _reception(self, robot: str) -> Reception | None:
        """Return the radio link's quality where a robot was at the last tick of the physics."""
        agent = self.field.robots.get(robot)  # others send before this robot is placed
        if agent is None:
            return None
        here = self.stage.site.link_quality(agent.body.x, agent.body.y)
        return None if here is None else here.quality

    def _link_between(self, source: str, destination: str) -> tuple[Link, Link]:
        """Return the links between two nodes, there and back, with their partitions."""
        links = self._unparted(source, destination)
        partitions = self.scenario.link.partitions
        if not partitions:
            return links
        name_of = self.stage.labels.get
        return part_links(
            links, name_of(source, source), name_of(destination, destination), partitions
        )

    def _unparted(self, source: str, destination: str) -> tuple[Link, Link]:
        """Return a robot's link or the backbone; everybody else is on the LAN."""
        if destination in self.links:
            return self.links[destination]
        if source in self.links:
            up, down = self.links[source]
            return down, up
        return self._backbone.get((source, destination), self._lan)

    # --- observers: see `Observer` -----------------------------------------------------

    def observe(self, observer: Observer) -> None:
        """Pass all facts of this run to an observer from now on."""
        self._observers = *self._observers, observer

    def _keep_facts(self) -> FactLog:
        """Return an observer that keeps the facts of the run for its recording."""
        facts = self.recorder.facts = []
        robots = self.field.robots
        look = self._motion_of
        return FactLog(facts.append, robots, look, self._page, dvas=self.dvas)

    def _page(self, dva: str) -> Page:
        return page_of(self.dvas[dva])

    def _motion_of(self, robot: str) -> RobotMotion:
        return motion_of(self.field.robots[robot])

    def sent(self, now: float, source: str, to: str, payload: Any) -> None:
        """Note that a message has been sent."""
        for observer in self._observers:
            observer.sent(now, source, to, payload)

    def delivered(self, now: float, source: str, to: str, payload: Any) -> None:
        """Note that a message has arrived."""
        for observer in self._observers:
            observer.delivered(now, source, to, payload)

    def _accepted(self, command: Accepted) -> None:
        for observer in self._observers:
            observer.accepted(command)

    def _by_hand(self, done: ByHand) -> None:
        for observer in self._observers:
            observer.by_hand(done)

    def deafened(self, robot: str, deaf: bool) -> None:
        """Let a robot's computer hang and hear nothing, or hear again."""
        for observer in self._observers:
            observer.deafened(self.clock.now, robot, deaf)

    def slowed(self, processing: float) -> None:
        """Note the mean processing time of a message by a robot's computer from now on [s]."""
        for observer in self._observers:
            observer.slowed(self.clock.now, processing)

    # --- watching ----------------------------------------------------------------------

    def _watch(self) -> None:
        """Check the rules that must hold at every moment."""
        now = self.clock.now
        self.field.world.advance_to(now)
        dangers = self.field.dangers(now)
        for name, agent in self.field.people():
            if agent.activity == SAFE:
                continue
            x, y = agent.walking.place
            if is_dangerous(agent.exposure.conditions) or self.field.is_near(dangers, x, y):
                self.recorder.exposure[name] += WATCH_PERIOD
        if self._log is not None:
            self._log.places(now, self.field.places())
        self.show_motions()
        self.show_page()

    def show_motions(self) -> None:
        """Let all observers see how the robots move now."""
        now = self.clock.now
        self.field.world.advance_to(now)
        motions = {name: motion_of(robot) for name, robot in self.field.robots.items()}
        for observer in self._observers:
            observer.moves(now, motions)

    def show_page(self) -> None:
        """Show all observers the current table of each DVA."""
        for page in map(page_of, self.dvas.values()):
            for observer in self._observers:
                observer.shows(self.clock.now, page)

    def _sample(self) -> None:
        """Record the positions of all robots and people on the site."""
        for name, point in self.field.whereabouts(self.clock.now):
            self.recorder.tracks[name].append(point)
