"""A DVA of regions on the network, with its peers, forwarded reports and pending answers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any, Final

from dva_sim.agents.device import PEER_STATUS, REGISTER_AGAIN, RENEW_PERIOD, AgentDevice
from dva_sim.core.events import Event
from dva_sim.core.regions.regional_dva import RegionalDva
from dva_sim.core.sessions import Send
from dva_sim.network.messaging import Request
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import PEER
from dva_sim.simulation.full.dva_server import DvaAgent

PASS_WITHIN: Final = 3.0  # design: the other DVA takes a report within this time, or this does [s]
COPY_WITHIN: Final = 0.3  # design: time for which a report waits for its copy at the deputy [s]
JOIN_AFTER: Final = 0.1  # design: delay of the first registration with other DVAs [s]
STATUS_PERIOD: Final = 2.0  # design: time between two status messages [s]
OF_A_DVA: Final = m.HandOver | m.Order | m.Relocation | m.TaskAward | m.PermissionGrant
UNREPLICATED: Final = "unreplicated"
NOT_COPIED: Final = "reports acknowledged without a copy at the deputy"


class RegionalDvaAgent(DvaAgent):
    """A DVA among others; its core is a `RegionalDva`.

    Args:
        device: As in `DvaAgent`, like all that follow.
        core: Core of a DVA of regions.
        **options: Keyword arguments of `DvaAgent`.
    """

    def __init__(self, device: AgentDevice, core: RegionalDva, **options: Any) -> None:
        super().__init__(device, core, **options)
        self._regional = core
        self._request: Request | None = None  # that is being taken
        self._facts = 0
        self._copied: dict[int, int] = {}  # newest fact of each event that waits for its copy
        self._held_by: dict[str, dict[int, Event]] = {}  # events that a deputy has open, by deputy
        self._missed: set[int] = set()  # events whose newest state a deputy has not heard of
        self._held: dict[int, list[Callable[[str], object]]] = {}  # by fact
        self._told: m.PeerStatus | None = None

    def start(self) -> None:
        """Begin as a single DVA does, and register with the others."""
        super().start()
        clock = self.device.clock
        for peer in self._peers:
            clock.call_after(JOIN_AFTER, self._join, peer)
        clock.every(STATUS_PERIOD, self._publish_status, start=clock.now + STATUS_PERIOD)

    # --- the other DVAs --------------------------------------------------------------------

    def _join(self, peer: str) -> None:
        """Register with another DVA, again and again, as any device does with its own."""
        if self.is_gone:
            return
        device = self.device

        def answered(reply: m.Reply) -> None:
            again = RENEW_PERIOD if reply.code == m.OK else REGISTER_AGAIN
            device.clock.call_after(again, self._join, peer)

        def failed() -> None:
            device.clock.call_after(REGISTER_AGAIN, self._join, peer)

        device.ask(peer, self._registration, answered, failed)

    def _publish_status(self) -> bool:
        if not self.is_gone and not self.device.silent:
            self._tell_peers()
        return not self.is_gone

    def _tell_peers(self) -> None:
        self._told = self._regional.peer_status(self.device.clock.now)
        self.device.publish(PEER_STATUS, self._told)

    def _tick(self) -> bool:
        """Look at deadlines; a change of the regions that it serves goes out at once."""
        goes_on = super()._tick()
        for peer in self._peers:
            entry = self._regional.registry.entries.get(peer)
            if entry is not None and entry.silent:
                self.device.give_up(peer)
        self._catch_up()
        served = tuple(m.ServedRegion(*each) for each in self._regional.division.served())
        if goes_on and self._told is not None and self._told.regions != served:
            news = sorted({s.region for s in served} - {s.region for s in self._told.regions})
            if news:
                self.device.tell(f"takes over {', '.join(news)}", "link")
            self._tell_peers()
        return goes_on

    def _answered(self, send: Send, reply: m.Reply) -> None:
        """Handle an answer; a device that takes no orders from here is another DVA's by now."""
        if reply.code == m.NOT_REGISTERED and send.to in self._peers:
            answered = partial(super()._answered, send)
            self._ask_again(send.to, send.body, answered, partial(self._undelivered, send))
            return
        super()._answered(send, reply)
        is_order = isinstance(send.body, OF_A_DVA)
        if is_order and reply.code == m.NOT_PERMITTED and send.to not in self._peers:
            self.dismiss(send.to)

    def _ask_peer(
        self,
        peer: str,
        body: m.Body,
        answered: Callable[[m.Reply], object],
        failed: Callable[[], object],
    ) -> None:
        """Ask another DVA; one that was started again has to know this one first."""

        def peer_answered(reply: m.Reply) -> None:
            if reply.code == m.NOT_REGISTERED:
                self._ask_again(peer, body, answered, failed)
            else:
                answered(reply)

        self.device.ask(peer, body, peer_answered, failed)

    def _ask_again(
        self,
        peer: str,
        body: m.Body,
        answered: Callable[[m.Reply], object],
        failed: Callable[[], object],
    ) -> None:
        device = self.device
        device.ask(
            peer,
            self._registration,
            lambda _: device.ask(peer, body, answered, failed),
            failed,
        )

    @property
    def _registration(self) -> m.Registration:
        return m.Registration(self.device.label, PEER, self.device.address)

    @property
    def _peers(self) -> tuple[str, ...]:
        return self._regional.division.peers

    # --- reports ---------------------------------------------------------------------------

    def _take(self, request: Request) -> None:
        self._request = request
        super()._take(request)

    def _on_request(self, message: m.Message) -> m.Reply | None:
        request = self._request
        assert request is not None
        peer = self._regional.passes_on(message)
        if peer is not None:
            self._pass_on(request, message, peer)
            return None
        return self._decide(request, message)

    def _decide(self, request: Request, message: m.Message) -> m.Reply | None:
        """Answer a request here; the reply to a new report waits for the deputy's copy."""
        reply = super()._on_request(message)
        is_new = isinstance(message.body, m.EventReport) and message.body.event_id is None
        if not is_new or reply is None or reply.code != m.OK:
            return reply
        return self._held_back(request, message, reply)

    def _pass_on(self, request: Request, message: m.Message, peer: str) -> None:
        """Let another DVA take a report about its region; take it here if that one does not."""
        assert isinstance(message.body, m.EventReport)
        is_over = False

        def conclude(reply: m.Reply | None) -> None:
            nonlocal is_over
            is_over = True
            if reply is not None:
                self.device.conclude(request, message, lambda _: reply)

        def take_here() -> None:
            if not is_over and not self.is_gone:
                self.device.recorder.counters["reports kept for another DVA"] += 1
                self._request = request
                conclude(self._decide(request, message))

        def answered(reply: m.Reply) -> None:
            if is_over:
                return
            if reply.code in (m.OK, m.BUSY):
                self.device.recorder.counters["reports passed on"] += 1
                conclude(replace(reply, answers=message.message_id))
            else:
                take_here()

        body = replace(message.body, origin=message.source)
        self._ask_peer(peer, body, answered, take_here)
        self.device.clock.call_after(PASS_WITHIN, take_here)

    def _held_back(self, request: Request, message: m.Message, reply: m.Reply) -> m.Reply | None:
        """Return the reply to a report, or None while it waits for the copy at the deputy."""
        assert isinstance(message.body, m.EventReport)
        event = self._regional.events.near(message.body.kind, message.body.position)
        if event is None:
            return reply
        fact = self._copied.get(event.number)
        if fact is None:
            has_deputy = self._regional.replica_of(event, 1, self.device.clock.now) is not None
            return reply if has_deputy else self._unreplicated(reply)
        is_over = False

        def release(text: str) -> None:
            nonlocal is_over
            if not is_over and not self.is_gone:
                is_over = True
                said = self._unreplicated(reply) if text else reply
                self.device.conclude(request, message, lambda _: said)

        self._held.setdefault(fact, []).append(release)
        self.device.clock.call_after(COPY_WITHIN, release, UNREPLICATED)
        return None

    def _unreplicated(self, reply: m.Reply) -> m.Reply:
        self.device.recorder.counters[NOT_COPIED] += 1
        return replace(reply, text=UNREPLICATED)

    # --- copies at the deputy ----------------------------------------------------------------

    def _publish_news(self, changed: Iterable[Event]) -> None:
        super()._publish_news(changed)
        if self._keep_events:
            self.copies.update(self._regional.help.copies)
            self.copies -= self._regional.help.adopted
        for event in changed:
            self._replicate(event)

    def _replicate(self, event: Event) -> None:
        """Send the current state of an event to its deputy."""
        replica = self._regional.replica_of(event, self._facts + 1, self.device.clock.now)
        if replica is None:
            return
        deputy, body = replica
        self._facts += 1
        fact = self._facts
        self._copied[event.number] = fact
        self._missed.discard(event.number)
        held = self._held_by.setdefault(deputy, {})
        held[event.number] = event

        def settled(text: str) -> None:
            if self._copied.get(event.number) == fact:
                del self._copied[event.number]
            for release in self._held.pop(fact, []):
                release(text)

        def answered(reply: m.Reply) -> None:
            if body.event.closed_for is not None:
                held.pop(event.number, None)
            settled("" if reply.code == m.OK else UNREPLICATED)

        def unheard() -> None:
            if self._copied.get(event.number) == fact:
                self._missed.add(event.number)
            settled(UNREPLICATED)

        self._ask_peer(deputy, body, answered, unheard)

    def _catch_up(self) -> None:
        """Tell each deputy that is there again what it has missed, the end of events above all."""
        division = self._regional.division
        for deputy, held in self._held_by.items():
            for number, event in list(held.items()):
                if number in self._copied or (event.open and number not in self._missed):
                    continue
                region = division.region_at(event.position)
                if division.claims[region].dva != division.own:
                    del held[number]  # another DVA goes on with it
                elif self._is_deputy(deputy, region):
                    self._replicate(event)

    def _is_deputy(self, peer: str, region: str) -> bool:
        return self._regional.division.deputy_of(region, self._regional.registry) == peer
