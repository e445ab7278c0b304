"""A DVA among others, each of which serves regions of one site."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from dva_sim.core.dva import Dva
from dva_sim.core.event_status import status_of
from dva_sim.core.events import Event, State, apart
from dva_sim.core.regions.borders import Borders
from dva_sim.core.regions.division import FIRST_EPOCH, Claim, Division
from dva_sim.core.regions.help import MutualHelp, event_told
from dva_sim.core.regions.leases import Leases
from dva_sim.core.regions.returns import Returns
from dva_sim.core.regions.strays import Strays
from dva_sim.core.regions.takeover import Deputy
from dva_sim.core.registry import DeviceEntry
from dva_sim.core.reports import NO_NEWS
from dva_sim.core.sessions import DvaAnswer, Send
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import PEER, ROBOT, ControlRoomRole

FOUND = frozenset({State.CONFIRMED, State.CONTAINED, State.ESCALATED})
NUMBERS = 1_000_000  # event numbers reserved for each DVA, so that no two give the same
LIFE = 10_000  # event numbers reserved for each start of a DVA


class RegionalDva(Dva):
    """Core of a DVA among others; everything else is as in `Dva`.

    Args:
        *args: Arguments of `Dva`.
        division: Division of the site, with the service of each region.
        **kwargs: Keyword arguments of `Dva`.

    Attributes:
        help: Help that it asks for and gives.
        borders: Devices that cross a border.
        deputy: Copies of the events of others.
        strays: Events that belong to others.
        returns: Regions that are given back.
        leases: Permissions that robots bring from a DVA that has died.
        peers: Latest status of the other DVAs, by id.
    """

    def __init__(self, *args: Any, division: Division, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.division = division
        index = [dvas[0] for dvas in division.lines.values()].index(division.own)
        self.events.first = NUMBERS * index + LIFE * (division.life % (NUMBERS // LIFE))
        self.help = MutualHelp(division, self.dispatcher)
        self.borders = Borders(division, self.orders, self.help)
        self.deputy = Deputy(division, self.orders, self.help)
        self.strays = Strays(division, self.orders, self.help)
        self.returns = Returns(division, self.orders, self.borders, self.deputy)
        self.leases = Leases(self.registry, self.sessions)
        self.peers: dict[str, m.PeerStatus] = {}
        self.orders.unwatched |= set(division.peers)
        self._strangers: set[str] = set()
        self._deputies: dict[str, str] = {}

    # --- what the agent asks --------------------------------------------------------------

    def passes_on(self, message: m.Message) -> str | None:
        """Return the DVA that a report is for, if that is another one, and it is there."""
        body = message.body
        entry = self.registry.entries.get(message.source)
        if not isinstance(body, m.EventReport) or body.event_id is not None or entry is None:
            return None
        if entry.kind == PEER:
            return None
        return self.division.other_at(body.position, self.registry)

    def replica_of(self, event: Event, fact: int, now: float) -> tuple[str, m.Replicate] | None:
        """Return the deputy of an event and the message to it; None if there is none."""
        region = self.division.region_at(event.position)
        epoch, dva = self.division.claims[region]
        deputy = self.division.deputy_of(region, self.registry)
        if dva != self.division.own or deputy is None or event.number in self.help.copies:
            return None
        return deputy, m.Replicate(region, epoch, fact, status_of(event, None, now))

    def peer_status(self, now: float) -> m.PeerStatus:
        """Return the status of this DVA for the others."""
        served = tuple(m.ServedRegion(*each) for each in self.division.served())
        count = sum(not entry.silent for entry in self.registry.entries.values())
        idle = len(self.dispatcher.situations.idle(now))
        return m.PeerStatus(served, count, len(self.events.open), idle)

    # --- what comes in --------------------------------------------------------------------

    def note(self, message: m.Message, now: float) -> list[Send]:
        """Take a published message, as in `Dva`; note the regions that other DVAs serve."""
        body = message.body
        if isinstance(body, m.PeerStatus):
            return self._with_revocations(self._hears_of(message.source, body, now))
        if isinstance(body, m.RobotStatus):
            self._meet_stranger(message.source, body)
        return super().note(message, now)

    def delivered(self, send: Send, now: float, content: object = None) -> list[Send]:
        """Handle the reply OK; a device that agrees to a hand-over is registered here no more."""
        if isinstance(send.body, m.HandOver):
            self.orders.counters["handed over"] += 1
            return self.dismiss(send.to, now)
        if isinstance(send.body, m.GiveBack):
            claim = Claim(send.body.epoch or 0, send.to)
            region = send.body.region
            if self.division.learn(region, claim):
                return self._with_revocations(self._yields([region], now))
            return self.deputy.return_copies(send.to, {region: claim.epoch}, now)
        if isinstance(send.body, m.EventReport) and send.body.event_id is None:
            return self._with_revocations(self.strays.taken(send, now))
        self.help.on_the_way.discard(send)
        if isinstance(send.body, m.Order) and send.to in self.division.peers:
            number = send.body.event_id
            if self.orders.engaged.find(send.to, number) is None:  # it has ended meanwhile
                return self._with_revocations([Send(send.to, m.OrderProgress(number, "done"))])
        return super().delivered(send, now, content)

    def undelivered(self, send: Send, now: float) -> list[Send]:
        """Handle a message that was not taken; others than orders are said again later."""
        if self._is_word(send):
            self.help.on_the_way.discard(send)
            self.help.unheard.setdefault(send.to, []).append(send)
        is_later = isinstance(send.body, m.HandOver | m.EventReport)
        return [] if is_later else super().undelivered(send, now)

    def _gone(self, device: str, now: float) -> list[Send]:
        """Drop a silent device, as in `Dva`; tell another DVA later what has ended."""
        if device in self.division.peers:
            over = [m.OrderProgress(e.number, "done") for e in self.orders.engaged.all(device)]
            self.help.unheard.setdefault(device, []).extend(Send(device, body) for body in over)
        return super()._gone(device, now)

    def dismiss(self, device: str, now: float) -> list[Send]:
        """Forget a device at once, as in `Dva`."""
        self.borders.forget(device)
        return super().dismiss(device, now)

    def tick(self, now: float) -> list[Send]:
        """Handle the passing of time, as in `Dva`: the dead, borders, and help."""
        self.deputy.take_over(now)
        self.deputy.resume(now)
        self._copy_to_new_deputies()
        self.leases.lapse(now)
        self.help.adopt_orphans(now)
        sends = super().tick(now)
        sends += self.borders.cross(now)
        sends += self.help.ask(now)
        sends += self.strays.pass_on(now)
        return self._with_revocations(sends)

    def _answer(self, message: m.Message, now: float) -> DvaAnswer:
        body = message.body
        entry = self.registry.entries.get(message.source)
        is_new = isinstance(body, m.Registration) and (
            entry is None or entry.is_new_life(message.message_id, message.timestamp)
        )
        if is_new and isinstance(body, m.Registration) and body.device_type == PEER:
            self._deputies.clear()
            self.deputy.replace_restarted(message.source, now)
            self.help.forgotten_by(message.source, now)
            known = dict.fromkeys(self.division.lines, FIRST_EPOCH)
            returned = self.deputy.return_copies(message.source, known, now)
            answer = super()._answer(message, now)
            return replace(answer, sends=[*answer.sends, *returned])
        if is_new and entry is None:
            self.deputy.came(message.source, now)
            answer = super()._answer(message, now)
            self.deputy.spare(message.source, now)
            return answer
        match body:
            case m.EventReport(event_id=None, position=place):
                self.deputy.reported(message.source, self.division.region_at(place))
            case m.EventReport(event_id=int(number)) | m.OrderProgress(event_id=number):
                if self.deputy.may_go_on(message.source, number):
                    text = f"event {number} may be taken over soon; say it again then"
                    return DvaAnswer(m.BUSY, text)
        if isinstance(body, m.GetGrant) and entry is not None and entry.kind == ROBOT:
            self.leases.bring(message.source, body, message.session or 0, now)
        if isinstance(body, m.PermissionRequest) and self._is_a_strangers(body):
            return DvaAnswer(m.BUSY, "it is driven under a session of another DVA")
        if isinstance(body, m.GiveBack) and entry is not None and entry.kind != PEER:
            return self._gives_back(entry, body)
        if entry is None or entry.kind != PEER:
            return super()._answer(message, now)
        self.registry.heard(message.source, now)
        return self._of_peer(message, entry, now)

    def _of_peer(self, message: m.Message, entry: DeviceEntry, now: float) -> DvaAnswer:
        """Answer another DVA."""
        source = message.source
        match message.body:
            case m.EventReport(event_id=None, origin=str(origin)) as report:
                is_stray = origin in self.division.peers
                if is_stray and self._is_no_news(report, now):
                    return DvaAnswer()  # somebody has been there meanwhile
                reporter = replace(entry, device=replace(entry.device, id_tag=origin))
                sends = self.help.claim(report.kind, report.position)
                answer = self._reports.sighted(reporter, report, now)
                return replace(answer, sends=[*answer.sends, *sends])
            case m.Order() as order:
                return self.help.give(source, order, now)
            case m.OrderProgress(event_id=number, state="done") if copy := self.help.copy_of(
                source, number
            ):
                return DvaAnswer(sends=self.help.end(copy, now))
            case m.OrderProgress(event_id=number, state="arrived"):
                event = self.orders.engaged.find(source, number)
                if event is not None:  # where it has sent somebody, it has seen him arrive
                    self.registry.locate(entry, event.position)
            case m.Replicate() as copied:
                return self.deputy.keep(source, copied, now)
            case m.GiveBack() as returned:
                return self.returns.take(returned)
        return super()._answer(message, now)

    def _copy_to_new_deputies(self) -> None:
        """Let all open events be copied, where another DVA is the deputy than before."""
        registry = self.registry
        served = (region for region, _ in self.division.served())
        chosen = {region: self.division.deputy_of(region, registry) for region in served}
        deputies = {region: deputy for region, deputy in chosen.items() if deputy is not None}
        if deputies != self._deputies:
            self._deputies = deputies
            for event in self.events.open.values():
                self.events.touch(event)

    def _is_no_news(self, report: m.EventReport, now: float) -> bool:
        """Return True if the same event was found here recently."""
        lately = (e for e in self.events.closed.values() if now - e.times["closed"] < NO_NEWS)
        confirmed = (e for e in lately if e.state in FOUND and e.kind == report.kind)
        near = self.events.merge_distance
        return any(apart(event.position, report.position) < near for event in confirmed)

    def _hears_of(self, peer: str, status: m.PeerStatus, now: float) -> list[Send]:
        entry = self.registry.heard(peer, now)
        if entry is None or entry.kind != PEER:
            self.refused += 1
            return []
        self.peers[peer] = status
        self.help.told[peer] = now
        before = dict(self.division.served())
        claims = [(each.region, Claim(each.epoch, peer)) for each in status.regions]
        learned = [self.division.learn(*claim) for claim in claims]
        lost = sorted(before.keys() - dict(self.division.served()).keys())
        sends = self.help.unheard.pop(peer, [])
        known = {region: claim.epoch for region, claim in claims}
        has_forgotten = any(
            claim < self.division.claims.get(region, claim) for region, claim in claims
        )
        if any(learned) or has_forgotten:
            sends += self.deputy.return_copies(peer, known, now)
        return sends + (self._yields(lost, now) if lost else [])

    def _yields(self, regions: list[str], now: float) -> list[Send]:
        """Stop serving regions, and pass their events on."""
        self.orders.counters["region yielded"] += len(regions)
        self.returns.yielded(regions)
        return self.strays.pass_on(now)

    def _gives_back(self, entry: DeviceEntry, body: m.GiveBack) -> DvaAnswer:
        """Answer a supervisor who wants a region to be its own DVA's again."""
        device = entry.device
        refusal = self.control_rooms.may(device, ControlRoomRole.SUPERVISE, "give a region back")
        if refusal is not None and device.id_tag not in self.handovers.supervisors:
            return DvaAnswer(m.NOT_PERMITTED, refusal)
        return self.returns.ask(body.region)

    # --- robots under sessions of others ---------------------------------------------------

    def _meet_stranger(self, robot: str, status: m.RobotStatus) -> None:
        """Keep a robot that acts under a session of another DVA from everybody until it is idle."""
        is_held = robot in self.sessions.permissions.grants
        is_registered = robot in self.registry.entries
        if is_registered and status.mode != "Idle" and not is_held:
            self._strangers.add(robot)
            self.sessions.reserved.add(robot)
        elif robot in self._strangers:
            self._strangers.discard(robot)
            self.sessions.reserved.discard(robot)

    def _is_a_strangers(self, body: m.PermissionRequest) -> bool:
        return body.device in self._strangers and body.level != "sensors"

    def _with_revocations(self, sends: Iterable[Send]) -> list[Send]:
        """Return the messages as `Dva` does, and the news for DVAs that asked for help."""
        sends = [*super()._with_revocations(sends), *self.help.news()]
        self.help.on_the_way.update(filter(self._is_word, sends))
        return sends

    def _is_word(self, send: Send) -> bool:
        """Return True for a message that tells another DVA of an order."""
        return send.to in self.division.peers and event_told(send.body) is not None
