"""A shift: the world of one timed run, around the DVA itself, and the balance of its events.

Every event of the world is in exactly one state, and none is lost: what the world counted is held
against what the DVA's book says, and the rules that hold whatever a policy advises against what
everybody is really at.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from dva_sim.core.dispatch import Policy
from dva_sim.core.events import Event, State
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.streams import Streams
from dva_sim.protocol import messages as m
from dva_sim.simulation.timed import control_room
from dva_sim.simulation.timed.demand import CALLERS, Demand
from dva_sim.simulation.timed.distributions import Law
from dva_sim.simulation.timed.draws import Draws, times
from dva_sim.simulation.timed.incidents import Incident
from dva_sim.simulation.timed.mail import Mail
from dva_sim.simulation.timed.recording import (
    CODES,
    STEPS_IN_ORDER,
    Ledger,
    Level,
    Slices,
    TimedRecording,
    UnitRecord,
)
from dva_sim.simulation.timed.responders import Job, Unit
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.timed.travel import Occurrence, Place, Terrain, terrain_of

SLACK = 1e-3  # tolerance of deadlines: the clock's step [s]
CHECKS = 64  # checks of the balance in a run
CHECKED_OF_SHIFTS = f"S6 checked {CHECKS} times, S7 at the end of each event; slack {SLACK:g} s"


def check(shift: Shift) -> None:
    """Count every rule that does not hold now."""
    for broken in (*_conservation(shift), *_limits(shift), *_team(shift)):
        shift.violations[broken] += 1


def _conservation(shift: Shift) -> Iterator[str]:
    """Yield S6: the counts add up, here and in the book, and both know the same open events."""
    present = sum(len(incidents) for incidents in shift.events.values())
    if shift.total != len(shift.unnoticed) + present + sum(shift.settled.values()):
        yield "an event of the world is lost"
    events = shift.core.events
    if sum(events.counts.values()) != events.total:
        yield "the book's counts do not add up"
    if events.open.keys() != shift.events.keys():
        yield "the book and the world know different open events"
    if len(events.waiting) != sum(level.now for level in shift.waiting):
        yield "the book and the world count different waiting events"


def _limits(shift: Shift) -> Iterator[str]:
    """Yield breaches: something waits beyond its deadline, or more than may wait."""
    rules = shift.core.orders.rules
    now = shift.clock.now
    events = shift.core.events
    for event in events.waiting.values():
        if now - event.waiting_since > rules.escalate_after + SLACK:
            yield "an event waits beyond its deadline"
    if rules.most_waiting is not None and len(events.waiting) > rules.most_waiting:
        yield "more events wait than may"


def _team(shift: Shift) -> Iterator[str]:
    """Yield one event per responder and one responder per event, as the DVA believes it to be."""
    engaged = shift.core.orders.engaged
    for unit in shift.units:
        job = unit.job
        at = [event.number for event in engaged.all(unit.device)]
        if ([] if job is None else [job.order.event_id]) != at:
            yield "a responder is at something else than the DVA believes"
    for event in shift.core.events.in_state(State.ASSIGNED, State.ON_SCENE):
        if event.responder is None:
            yield "an event that somebody should be at has nobody"
        elif event.responder == event.actor:
            yield "somebody is to do two things at once"


class Shift:
    """World of a shift, with all units in place at time zero.

    Args:
        seed: Random seed.
        policy: Dispatch policy, made from the scenario by the caller.

    Raises:
        ConfigError: a site that cannot hold the team.
    """

    def __init__(self, scenario: TimedScenario, seed: int, policy: Policy) -> None:
        self.scenario = scenario
        self.seed = seed
        self.clock = Clock()
        self.streams = Streams(seed)
        self.terrain: Terrain = terrain_of(scenario)
        slices = Slices(scenario.warm_up_s, scenario.horizon_s, scenario.batches)
        self.slices = slices
        self.ledger = Ledger(len(scenario.demand), slices, scenario.keep == "events")
        self.waiting = [Level(slices) for _ in scenario.demand]
        self.served = [Level(slices) for _ in scenario.demand]
        self.demand = Demand(
            scenario, self.streams, self.terrain, self.clock, self._happens, self._noticed
        )
        self.stations = control_room.stations(scenario, self.terrain)
        self.units = control_room.hire(self, self.streams, self.stations)
        self.by_device = {unit.device: unit for unit in self.units}
        self.numbers = {unit.device: unit.number for unit in self.units}
        self.core = control_room.make_core(self, policy)
        self.mail = self._open_mail(policy)
        self.records = [UnitRecord(unit.name, unit.kind) for unit in self.units]
        self.events: dict[int, list[Incident]] = {}
        self.reports: dict[int, int] = {}
        self.unnoticed: dict[int, Incident] = {}
        self.total = 0
        self.settled = Counter[str]()
        self.violations: Counter[str] = Counter()
        self.driven = {
            control_room.id_of("operator", n): 0.0 for n in range(scenario.operators.count)
        }
        self.published_places: list[m.Position | None] = [None] * len(self.units)
        self.half_way: dict[Unit, Place] = {}
        self._served: set[int] = set()
        self._newest = 0
        self._moving: dict[Unit, None] = {}
        self._draws: dict[tuple[str, int, str, int], Draws[float]] = {}
        control_room.register(self)
        self.mail.carry()
        for start in sorted({group.from_s for group in scenario.responders}):
            on_duty = [unit for unit in self.units if unit.group.from_s == start]
            self.clock.call_at(start, self._begin_shift, on_duty)

    def _open_mail(self, policy: Policy) -> Mail:
        """Return the mail: after a decision it ticks again if one decision can enable the next."""
        containment = self.scenario.dispatch.containment
        attentive = containment or policy.preempts or policy.relocates
        return Mail(self.core, self.clock, self._changed, self._tell_who_moves, attentive)

    def _begin_shift(self, units: list[Unit]) -> None:
        for unit in units:
            self.publish_place(unit, "waiting")
        self.mail.tick()

    # --- a run ---------------------------------------------------------------------------

    def run(self) -> TimedRecording:
        """Let time pass until the horizon, or until all is settled."""
        scenario = self.scenario
        self.demand.start()
        for check_number in range(1, CHECKS + 1):
            self.clock.run(scenario.horizon_s * check_number / CHECKS)
            check(self)
            if self.demand.exhausted and not self.events and not self.unnoticed:
                break
        if scenario.drain:
            # What is open is closed, as far as anybody will still do anything.
            while (self.events or self.unnoticed) and self.clock.env.peek() < math.inf:
                self.clock.step()
            check(self)
        return self._close()

    def _close(self) -> TimedRecording:
        now = self.clock.now
        scenario = self.scenario
        for level in (*self.waiting, *self.served):
            level.advance(now)
        for unit in self.units:
            if unit.job is not None:
                self.spent(unit, unit.job.phase, unit.since)
                self.freed(unit, unit.job)
        for incidents in self.events.values():
            for incident in incidents:
                assert incident.event is not None
                self.ledger.write(incident, CODES[incident.event.state.value], self.numbers)
        for incident in self.unnoticed.values():
            self.ledger.write(incident, CODES["unnoticed"], self.numbers)
        counters = Counter(self.core.counters)
        counters.update({f"refused {text}": n for text, n in self.mail.refused.items()})
        for unit, record in zip(self.units, self.records, strict=True):
            record.distance = unit.distance
            record.jobs = unit.jobs
        return TimedRecording(
            scenario=scenario,
            seed=self.seed,
            zones=self.terrain.zones,
            streams=scenario.stream_names,
            responders=[unit.name for unit in self.units],
            columns=self.ledger.columns() if scenario.keep == "events" else {},
            cells=self.ledger.cells,
            outcomes=self.ledger.outcomes,
            waiting=np.array([level.areas for level in self.waiting]),
            served=np.array([level.areas for level in self.served]),
            units=self.records,
            operators=list(self.driven.values()),
            counters=counters,
            violations=self.violations,
            events=self.total,
            messages=self.mail.sent,
            ended=now,
            duration=max(0.0, min(now, scenario.horizon_s) - scenario.warm_up_s),
        )

    # --- what happens --------------------------------------------------------------------

    def _happens(self, incident: Incident) -> None:
        self.total += 1
        self.unnoticed[incident.number] = incident
        self.terrain.remember(incident.place)

    def _noticed(self, incident: Incident) -> None:
        """Handle the first report; draw later reports and the withdrawal by event."""
        draws = self.demand.draws[incident.stream]
        incident.noticed = self.clock.now
        self._report(incident, "caller")
        repeat = draws.repeat_after(incident.index)
        if repeat is not None:
            self.clock.call_after(repeat, self._report_again, incident)
        if self.scenario.demand[incident.stream].patience is not None:
            patience = draws.patience[incident.index]
            self.clock.call_after(patience, self._take_back, incident)

    def _report(self, incident: Incident, kind: str) -> None:
        stream = self.scenario.demand[incident.stream]
        caller = incident.index % CALLERS if stream.patience or stream.repeats else 0
        source = control_room.id_of(kind, incident.stream * CALLERS + caller)
        incident.sources.append(source)
        self.mail.say(source, incident.report("detected"), incident)
        self.mail.carry()

    def _report_again(self, incident: Incident) -> None:
        """Handle a repeated report; if the event is over, there is nothing to report."""
        if incident.event is not None and incident.event.open:
            self._report(incident, "second")

    def _take_back(self, incident: Incident) -> None:
        if incident.event is not None and incident.event.open:
            for source in incident.sources:
                self.mail.say(source, incident.report("refuted"))
            self.mail.carry()

    # --- what the DVA has done -----------------------------------------------------------

    def _changed(self, about: object) -> None:
        """Follow the events of the DVA."""
        changes = self.core.events.changes()
        if changes:
            now = self.clock.now
            for event in changes:
                if event.number > self._newest or event.number in self.events:
                    self._match(about, event, now)
                    self._follow(event, now)
        if isinstance(about, Incident) and about.event is None:
            self._settle(about, "refused", self.clock.now)

    def _match(self, about: object, event: Event, now: float) -> None:
        """Find the event to which the DVA assigned a report."""
        if event.number > self._newest:
            self._newest = event.number
            assert isinstance(about, Incident)
            self.events[event.number] = [about]
            self._reported(about, event)
            self.waiting[about.stream].change(1, now)
        elif event.reports > self.reports[event.number]:
            self.reports[event.number] = event.reports
            if isinstance(about, Incident) and about.event is None:
                about.shared = True
                self.events[event.number].append(about)
                self._reported(about, event)

    def _reported(self, incident: Incident, event: Event) -> None:
        """Note the DVA's event of an incident."""
        incident.event = event
        self.reports[event.number] = event.reports
        del self.unnoticed[incident.number]

    def _follow(self, event: Event, now: float) -> None:
        """Count an event where it stands now: waiting, served or over."""
        number = event.number
        events = self.core.events
        stream = self.events[event.number][0].stream
        waited = number not in self._served
        if number not in events.open:
            (self.waiting if waited else self.served)[stream].change(-1, now)
            self._served.discard(number)
            self._end(event, now)
        elif waited and number not in events.waiting:
            self.waiting[stream].change(-1, now)
            self.served[stream].change(1, now)
            self._served.add(number)
        elif not waited and number in events.waiting:
            self.waiting[stream].change(1, now)
            self.served[stream].change(-1, now)
            self._served.discard(number)

    def _end(self, event: Event, now: float) -> None:
        given_up = event.state in (State.ESCALATED, State.EXPIRED)
        del self.reports[event.number]
        for incident in self.events.pop(event.number):
            if given_up:
                incident.over = min(incident.over, now)
            self._settle(incident, event.state.value, now)

    def _settle(self, incident: Incident, outcome: str, now: float) -> None:
        """Settle a closed incident: count it, and let its source make the next."""
        self.unnoticed.pop(incident.number, None)
        self.settled[outcome] += 1
        if incident.event is not None and not in_order(incident):
            self.violations["times are out of order"] += 1
        self.ledger.write(incident, CODES[outcome], self.numbers)
        self.terrain.forget(incident.place)
        self.demand.closed(incident, now)

    def _tell_who_moves(self) -> None:
        """Report the positions of moving, available units to the DVA before each decision."""
        for unit in self._moving:
            self._publish(unit, unit.here(), "walking")

    # --- what units may ask, and tell: see `responders.ShiftWorld` ---------------------------

    def after(self, delay: float, action: Any, *args: Any) -> None:
        """Run an action later [s]; its messages are delivered after it."""
        self.clock.call_after(delay, self._do, action, args)

    def _do(self, action: Any, args: tuple[Any, ...]) -> None:
        action(*args)
        self.mail.carry()

    def say(self, source: str, body: m.Body) -> None:
        """Send a message to the DVA."""
        self.mail.say(source, body)

    def says_arrived(self, unit: Unit, job: Job) -> None:
        """Tell the DVA that a unit is where it was sent; so it knows where the unit is."""
        event = job.incident.event
        self.published_places[unit.number] = None if event is None else event.position
        self.mail.say(job.voice, m.OrderProgress(job.order.event_id, "arrived"))

    def publish_place(self, unit: Unit, activity: str) -> None:
        """Publish where a unit is."""
        self._publish(unit, unit.here(), activity)

    def _publish(self, unit: Unit, place: Place, activity: str) -> None:
        if (
            unit.group.from_s > self.clock.now
            or self.published_places[unit.number] is place.position
        ):
            return
        self.published_places[unit.number] = place.position
        self.terrain.forget(self.half_way.pop(unit, place))
        if place.fixed is None and place.about is None:
            self.half_way[unit] = self.terrain.remember(place)
        if unit.kind == "guard":
            self.mail.publish(unit.device, m.PersonStatus(activity, place.position))
        else:
            mode = "Idle" if unit.job is None else "Teleoperation"
            body = m.RobotStatus(
                mode, place.position, 0.0, 0.0, 0.0, round(self.clock.now * 1000.0)
            )
            self.mail.publish(unit.device, body)

    def incident_at(self, event: int) -> Incident:
        """Return the true incident of an event: the first one reported as it."""
        return self.events[event][0]

    def mobilisation(self, unit: Unit, incident: Incident) -> float:
        """Return the time that this unit takes to get ready for this incident [s]."""
        return self._drawn("mobilisation", unit.group.mobilisation, incident, unit.name)

    def trip(self, unit: Unit, start: Place, goal: Place) -> float:
        """Time to get somewhere [s]; infinite if no path exists."""
        law = self.scenario.way
        if isinstance(law, str):
            return self.terrain.length(start, goal) / unit.speed
        if goal.about is None:
            return 0.0  # back
        return self._drawn("travel", law, goal.about, unit.name)

    def look(self, unit: Unit, incident: Incident) -> float:
        """Time from arrival to certainty [s]; random by event, the same for every responder."""
        law = self.scenario.demand[incident.stream].look or unit.group.look
        return self._drawn("look", law, incident)

    def act(self, unit: Unit, incident: Incident) -> float:
        """Time to contain it [s]; random by event, the same for every responder."""
        law = self.scenario.demand[incident.stream].act or unit.group.act
        return self._drawn("act", law, incident)

    def _drawn(self, purpose: str, law: Law, incident: Occurrence, whose: str = "") -> float:
        """Return a draw by the event's index; two laws for one purpose share random numbers."""
        key = purpose, incident.stream, whose, id(law)
        draws = self._draws.get(key)
        if draws is None:
            stream = self.scenario.stream_names[incident.stream]
            name = f"demand/{stream}/{purpose}/{whose}"
            draws = self._draws[key] = times(self.streams, name, law)
        return draws[incident.index]

    def needs_people(self, incident: Incident) -> bool:
        """Return True if a person will be called to contain it."""
        return (
            self.scenario.dispatch.containment
            and incident.true
            and incident.event is not None
            and incident.event.open
        )

    def spent(self, unit: Unit, phase: str, since: float) -> None:
        """Note that a unit was at something until now; what lies in the measured time counts."""
        seconds = self._measured(since)
        if seconds > 0.0:
            self.records[unit.number].spent[phase] += seconds

    def freed(self, unit: Unit, job: Job) -> None:
        """Note that a job is over: so is the work of the operator who drove."""
        if unit.kind == "robot":
            self.driven[job.voice] += self._measured(job.begun)

    def _measured(self, since: float) -> float:
        return max(0.0, min(self.clock.now, self.slices.end) - max(since, self.slices.start))

    def exposed(self, unit: Unit, stage: str, seconds: float) -> None:
        """Note the time of a guard within a danger radius."""
        if seconds > 0.0 and self.slices.of(self.clock.now) is not None:
            self.records[unit.number].exposure[stage] += seconds

    def moving(self, unit: Unit, moves: bool) -> None:
        """Note that a unit starts or stops moving; inform the DVA of units it might call."""
        if moves and (unit.job is None or self.core.dispatcher.policy.preempts):
            self._moving[unit] = None
        else:
            self._moving.pop(unit, None)


def in_order(incident: Incident) -> bool:
    """Return True if the times of an incident's event are in order (S7)."""
    event = incident.event
    assert event is not None
    last = event.times["detected"] if incident.shared else incident.occurred
    for step in STEPS_IN_ORDER:
        time = event.times.get(step)
        if time is not None:
            if time < last:
                return False
            last = time
    return True
