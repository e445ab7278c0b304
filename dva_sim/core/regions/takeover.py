"""Deputies: copies of the events of another DVA, and their resumption when that one has died."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

from dva_sim.core.events import LOOKING, Event, State
from dva_sim.core.orders import Orders
from dva_sim.core.regions.division import Claim, Division
from dva_sim.core.regions.help import MutualHelp
from dva_sim.core.sessions import DvaAnswer, Send
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import DETECTOR, GUARD, PEER, ROBOT
from dva_sim.protocol.wire_size import sent_time

COME_WITHIN: Final = 4.0  # design: a responder not registered within this time is given up [s]
MAX_COPIES: Final = 10_000  # of the events of one region
_OF_A_PLACE: Final = PEER, DETECTOR, ROBOT, GUARD


class Copy(NamedTuple):
    """Status of an event as its DVA has told it, and when [s]."""

    status: m.EventStatus
    told: float


@dataclass
class Deputy:
    """Copies of the events of other regions, and what becomes of them.

    Attributes:
        division: Division of the site, with the service of each region.
        orders: Current orders.
        help: Help that is given: an event that is looked at already needs no second look.
        copies: Copies of open events, by region and number.
        taken_over: Time at which each region was taken over [s].
    """

    division: Division
    orders: Orders
    help: MutualHelp
    copies: dict[str, dict[int, Copy]] = field(default_factory=dict)
    taken_over: dict[str, float] = field(default_factory=dict)
    _silent_since: dict[str, float] = field(default_factory=dict)
    _died: dict[str, float] = field(default_factory=dict)  # by region taken over [s]
    _came: dict[str, float] = field(default_factory=dict)
    _reported: dict[str, float] = field(default_factory=dict)  # when such a one came [s]

    def keep(self, peer: str, body: m.Replicate, now: float) -> DvaAnswer:
        """Keep a copy of an event, unless a newer claim to its region is known."""
        claim = self.division.claims.get(body.region)
        if claim is None:
            return DvaAnswer(m.NOT_SUPPORTED, f"no region {body.region!r} is known here")
        if claim == Claim(body.epoch, self.division.own):  # it returns what this DVA has forgotten
            copies = self.copies.setdefault(body.region, {})
            copies.setdefault(body.event.event_id, Copy(body.event, now))  # it may come twice
            self.taken_over.setdefault(body.region, now)
            return DvaAnswer()
        self.division.learn(body.region, Claim(body.epoch, peer))
        if self.division.claims[body.region] != Claim(body.epoch, peer):
            text = f"epoch {body.epoch} of {body.region} is over: it is {claim.epoch}"
            return DvaAnswer(m.STALE, text)
        copies = self.copies.setdefault(body.region, {})
        number = body.event.event_id
        if body.event.closed_for is not None:
            copies.pop(number, None)
        elif number in copies or len(copies) < MAX_COPIES:
            copies[number] = Copy(body.event, now)
        return DvaAnswer()

    def return_copies(self, peer: str, known: Mapping[str, int], now: float) -> list[Send]:
        """Return the copies that a restarted DVA needs if no other has replaced it.

        Args:
            peer: The DVA.
            known: Epoch of each region that it believes it serves. After a region was given
                back to it, the true epoch is higher: it gets that first, in a `GiveBack`, as it
                would take copies of a higher epoch for another DVA's.
            now: Time [s].
        """
        sends: list[Send] = []
        for region, (epoch, dva) in self.division.claims.items():
            if dva != peer or region not in known:
                continue
            if epoch > known[region]:
                is_home = peer == self.division.lines[region][0]
                sends += [Send(peer, m.GiveBack(region, epoch))] if is_home else []
                continue
            for copy in self.copies.get(region, {}).values():
                passed = now - copy.told
                age = sent_time(copy.status.age + passed)
                state_for = sent_time(copy.status.state_for + passed)
                status = replace(copy.status, age=age, state_for=state_for)
                sends.append(Send(peer, m.Replicate(region, epoch, len(sends) + 1, status)))
        return sends

    def replace_restarted(self, peer: str, now: float) -> None:
        """Claim the regions that a DVA had taken over before it was started again: it forgot.

        Until the deputy has claimed such a region, its events go to nobody.
        """
        for region, claim in list(self.division.claims.items()):
            if claim.dva != peer or peer == self.division.lines[region][0]:
                continue
            self.division.forgotten.add(region)
            if self.division.deputy_of(region, self.orders.registry) == self.division.own:
                self.division.learn(region, Claim(claim.epoch + 1, self.division.own))
                self.taken_over[region] = now
                self.orders.counters["region taken over"] += 1

    def yielded(self, region: str) -> list[str]:
        """Go on with no copies of a region that is another's again, as that one does.

        Returns:
            Devices without a place that have come since the DVA of the region died.
        """
        self.taken_over.pop(region, None)
        since = self._died.pop(region, math.inf)
        entries = self.orders.registry.entries
        came = (device for device, at in self._came.items() if at >= since and device in entries)
        return [device for device in came if entries[device].kind not in _OF_A_PLACE]

    def came(self, device: str, now: float) -> None:
        """Note a device that was not registered here before."""
        self._came[device] = now

    def spare(self, device: str, now: float) -> None:
        """Order a device nowhere that has just come, and that a copied event has in hand."""
        copies = (copy for kept in self.copies.values() for copy in kept.values())
        entry = self.orders.registry.entries.get(device)
        if entry is not None and any(device in self._sent(copy.status) for copy in copies):
            entry.free_from = now + COME_WITHIN

    def may_go_on(self, device: str, number: int) -> bool:
        """Return True if a device reports on an event that this DVA may go on with soon."""
        copies = (kept[number] for kept in self.copies.values() if number in kept)
        return any(device in self._sent(copy.status) for copy in copies)

    def reported(self, device: str, region: str) -> None:
        """Note a report about a region: a detector that has come here may be of that region."""
        if device in self._came:
            self._reported[region] = self._came[device]

    def take_over(self, now: float) -> list[str]:
        """Claim the regions of DVAs that have died, and whose devices come here; return them."""
        registry = self.orders.registry
        self._came = {d: at for d, at in self._came.items() if d in registry.entries}
        taken = []
        for region, claim in list(self.division.claims.items()):
            entry = registry.entries.get(claim.dva)
            if self.division.is_there(claim.dva, registry):
                self._silent_since.pop(region, None)
            else:
                heard = now if entry is None else entry.last_heard
                self._silent_since.setdefault(region, heard)
            since = self._silent_since.get(region, now)
            is_deputy = self.division.deputy_of(region, registry) == self.division.own
            if now - since <= registry.silent_after or not is_deputy:
                continue
            if not self._has_come(region, since):
                continue
            self.division.learn(region, Claim(claim.epoch + 1, self.division.own))
            self._died[region] = self._silent_since.pop(region)
            self.taken_over[region] = now
            self.orders.counters["region taken over"] += 1
            taken.append(region)
        return taken

    def _has_come(self, region: str, since: float) -> bool:
        """Return True if a device has come, or reports, that may have lost its DVA."""
        if self._reported.get(region, -math.inf) >= since:
            return True
        entries = self.orders.registry.entries
        late = (entries[device] for device, at in self._came.items() if at >= since)
        return any(
            entry.kind not in (PEER, DETECTOR)
            and (entry.position is None or self.division.region_at(entry.position) == region)
            for entry in late
        )

    def resume(self, now: float) -> None:
        """Go on with the copied events of regions that were taken over."""
        for region, since in self.taken_over.items():
            copies = self.copies.get(region, {})
            for number, copy in list(copies.items()):
                sent = self._sent(copy.status)
                are_back = all(self._is_there(device) for device in sent)
                are_back = are_back and copy.status.responder not in self.orders.engaged
                if are_back or now - max(since, copy.told) >= COME_WITHIN:
                    del copies[number]
                    self._go_on(copy, are_back, now)

    @staticmethod
    def _sent(status: m.EventStatus) -> list[str]:
        every = status.responder, status.operator, status.actor
        return [device for device in every if device is not None]

    def _is_there(self, device: str) -> bool:
        """Return True for a device that continues here; a helping DVA has to be asked again."""
        entry = self.orders.registry.entries.get(device)
        return entry is not None and not entry.silent and entry.kind != PEER

    def _go_on(self, copy: Copy, are_back: bool, now: float) -> None:
        status = copy.status
        events = self.orders.events
        if events.get(status.event_id) is not None or self._is_looked_at(status):
            return
        state = State(status.event_state.replace("_", " "))
        if state in LOOKING and not (are_back and status.responder):
            state = State.PENDING
        event = Event(
            status.event_id,
            status.kind,
            status.position,
            status.severity,
            needs_containment=self.orders.rules.containment,
            state=state,
            sources={"": status.confidence},
            times={"detected": copy.told - status.age},
        )
        began = copy.told - status.state_for
        event.waiting_since = began if status.event_state == State.PENDING else now
        event.handling.decisions = status.decisions
        if state is not State.PENDING:
            steps = {State.CONFIRMED: ["confirmed"], State.ON_SCENE: ["assigned", "arrived"]}
            event.times |= dict.fromkeys(steps.get(state, ["assigned"]), began)
        if are_back:
            self._keep_at_it(event, status, began)
        events.total += 1
        events.first -= 1  # the next one that is new here is numbered as before
        events.counts[event.state] += 1
        events.restore(event)
        self.orders.counters["event taken over"] += 1

    def _is_looked_at(self, status: m.EventStatus) -> bool:
        """Make a copy that this DVA looks at for the one that died an event of its own."""
        for number, lent in list(self.help.copies.items()):
            if lent.number == status.event_id:
                self.help.adopt(number)
                return True
        return False

    def _keep_at_it(self, event: Event, status: m.EventStatus, began: float) -> None:
        event.responder = status.responder
        event.operator = status.operator
        event.actor = status.actor
        event.taken_up = event.responder is not None
        event.attempts = int(event.taken_up)
        if event.actor is not None:
            event.act_taken_up = True
            event.times["act_assigned"] = began
        for device in self._sent(status):
            self.orders.engaged.begin(device, event)
            event.sent.add(device)
