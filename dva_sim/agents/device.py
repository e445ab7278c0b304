"""Base of every agent: an identity, messaging, and lines in the timeline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field
from functools import partial
from itertools import islice

from dva_sim.agents.dva_watch import DvaWatch
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.labels import distinct
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.messaging import Request, Requester, Subscription, Transport
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.exchange import (
    ANSWERED,
    IGNORED,
    NOON,
    Nuisances,
    Outbox,
    ReplyCache,
    key_of,
)
from dva_sim.worlds.geo import GeoFrame

HEARTBEAT = "heartbeat|"  # topics; the bar ends each, so that none is a prefix of another
STATUS = "status|"
HOLDER = "holder|"
EMERGENCY = "emergency|"
MISSION = "mission|"
EVENT = "event|"
AUDIT = "audit|"
PEER_STATUS = "peer|"
HEARTBEAT_PERIOD = 2.0  # design: time between two heartbeats [s]
FIRST_WORD = 2.0  # design: time after which a named DVA counts as not answering [s]
REGISTER_AGAIN = 2.0  # design: pause after a registration that was refused or not answered [s]
UNUSED_FOR = 600.0  # design: time without a request after which a connection is closed [s]
REPORT_AGAIN = 5.0  # design: pause after a report that no DVA has recorded [s]
MAX_BID = 1e6  # design: longest arrival time of a bid [s]
RENEW_PERIOD = 10.0  # design: time between two registrations [s]

Handler = Callable[[m.Message], m.Reply | None]


def urgent(message: m.Message) -> bool:
    """Return True if a message overtakes everything else."""
    return isinstance(message.body, m.Emergency)


def do_nothing(*_: object) -> None:
    """Do nothing, for callers that need no answer."""


@dataclass(kw_only=True)
class AgentDevice:
    """An agent's share in the system.

    Attributes:
        id_tag: Id on the wire.
        label: Name for people, such as `robot-1`.
        device_type: Type in its registration.
        address: Address in its registration.
        dva: Id of the DVA that it is registered with, and obeys.
        dvas: Ids of all DVAs that it knows, that of its region first; empty: the one.
        network: Transport of the messages.
        clock: The run's clock.
        recorder: Recorder of the run.
        frame: Conversion between longitude/latitude on the wire and metres inside.
        timeout: Time-out of a request on the acknowledged channel [s].
        attempts: Number of attempts of such a request.
        labels: Names of all devices by id, for the timeline.
        time_of_day: Start of the run [s since midnight], and True for exact timestamps.
        silent: True if it sends nothing at all, for lack of power.
        withdrawn: True if it publishes nothing and lets its registration lapse, so that the DVA
            counts it as silent and sends nobody to it; it still replies.
        meanwhile: Description of its behaviour while the DVA is silent.
        other_id: Description of how to give it another id, if its own is in use.
        dva_address: Address of the DVA for messages to people; empty if they need not know it.
        dva_watch: Watch on the DVA's heartbeats.
        on_dva: Callback for another DVA, by id, that the device obeys from then on, and for
            its own one when that was started again.
        is_engaged: Predicate: True while the device has to stay with its DVA.
    """

    id_tag: str
    label: str
    _: KW_ONLY
    device_type: str
    address: str
    dva: str
    network: Transport
    recorder: Recorder
    frame: GeoFrame
    timeout: float
    attempts: int
    labels: dict[str, str] = field(default_factory=dict)
    time_of_day: tuple[float, bool] = (NOON, False)
    silent: bool = False
    withdrawn: bool = False
    meanwhile: str = ""
    other_id: str = ""
    dva_address: str = ""
    dvas: tuple[str, ...] = ()
    dva_watch: DvaWatch = field(default_factory=DvaWatch)
    on_dva: Callable[[str], object] = do_nothing
    is_engaged: Callable[[], bool] = lambda: False
    clock: Clock = field(init=False)
    outbox: Outbox = field(init=False)
    _refusal: str = ""  # last reported reason of a refused registration
    _life: int = 0  # number of restarts; repeated actions end with their life
    _requesters: dict[tuple[str, bool], Requester] = field(default_factory=dict)
    _kept_open: set[str] = field(default_factory=set)  # peers with connections even if unused
    _addresses: dict[str, str] = field(default_factory=dict)
    _replies: ReplyCache = field(default_factory=ReplyCache)
    _nuisances: Nuisances = field(default_factory=Nuisances)
    _dva_beats: Subscription | None = None
    _reports: dict[str, m.Body] = field(default_factory=dict)  # not taken yet, by their subject
    _turns: bool = False  # a registration with another DVA is in progress

    def __post_init__(self) -> None:
        self.clock = self.network.clock
        self.outbox = Outbox(self.id_tag, *self.time_of_day)
        self.labels[self.id_tag] = self.label

    def call(self, label: str) -> None:
        """Change the label, which must be distinguishable from all others here."""
        other_labels = [
            label_there for id_tag, label_there in self.labels.items() if id_tag != self.id_tag
        ]
        self.label = self.labels[self.id_tag] = distinct(label, self.id_tag, other_labels)

    def register(self, then: Callable[[], object] = do_nothing, hears_dva: bool = True) -> None:
        """Register with the DVA until it has answered, then renew that now and then.

        So a restarted DVA learns of every device again.

        Args:
            then: Called when the DVA has answered for the first time.
            hears_dva: True to listen to the DVA's heartbeats.
        """
        self._register(then, self._bond)
        self._begin_to_beat(hears_dva)

    @property
    def _bond(self) -> tuple[int, str]:
        """The life and the DVA that a registration is of."""
        return self._life, self.dva

    def _begin_to_beat(self, hears_dva: bool = True) -> None:
        """Publish heartbeats, and listen to those of the DVA."""
        if hears_dva and self._dva_beats is None:
            hear = self._on_dva_beat
            self._dva_beats = self.network.subscribe(self.id_tag, self.dva, HEARTBEAT, hear)
        self.clock.every(HEARTBEAT_PERIOD, partial(self._heartbeat, self._life))
        self.clock.every(
            UNUSED_FOR, partial(self._disconnect_unused, self._life), self.clock.now + UNUSED_FOR
        )

    def look_for_dva_at(self, address: str) -> None:
        """Name an address in messages about the DVA, and report soon if nobody answers there."""
        self.dva_address = address
        self.clock.call_after(FIRST_WORD, self._expect_dva)

    def _expect_dva(self) -> None:
        if self.dva_watch.heard is None:  # long before all attempts have failed
            self.dva_watch.failed()
            self._look_for_dva()

    def register_once(
        self, on_reply: Callable[[m.Reply], object], on_failure: Callable[[], object]
    ) -> None:
        """Ask the DVA once; only if it agrees does the device stay registered from then on."""

        def answered(reply: m.Reply) -> None:
            if reply.code == m.OK:
                self.clock.call_after(RENEW_PERIOD, self._register, do_nothing, self._bond)
                self._begin_to_beat()
            on_reply(reply)

        self.ask(self.dva, self._registration, answered, on_failure)

    def resume(self) -> None:
        """Register at once, and publish again, after it was withdrawn."""
        self._life += 1
        self.withdrawn = False
        self.register()

    def leave(self) -> None:
        """Send nothing more: the DVA finds out as of any device that falls silent."""
        self.silent = True
        self._life += 1
        if self._dva_beats is not None:
            self._dva_beats.close()
        self._dva_beats = None
        self.dva_watch = DvaWatch()

    def crash(self) -> None:
        """Vanish silently: open requests are not repeated, and their replies are ignored."""
        self.leave()
        for requester in self._requesters.values():
            requester.close()
        self._requesters.clear()

    def restart(self) -> None:
        """Continue as the same device in a new process, which numbers from 1."""
        self.crash()
        self.outbox = Outbox(self.id_tag, *self.time_of_day)
        self._replies = ReplyCache()
        self._nuisances = Nuisances()
        self.come_back()

    def come_back(self) -> None:
        """Start a new life, registered nowhere yet."""
        self.silent = False

    def _register(self, then: Callable[[], object], bond: tuple[int, str]) -> None:
        if bond != self._bond:
            return

        def answered(reply: m.Reply) -> None:
            if reply.code == m.OK:
                self._refusal = ""
                then()
                self.clock.call_after(RENEW_PERIOD, self._register, do_nothing, bond)
                return
            refusal = self.why_refused(reply)
            if refusal != self._refusal:  # report a repeated refusal once
                self.tell(f"is not registered: {refusal}", "link")
            self._refusal = refusal
            failed()

        def failed() -> None:
            self.clock.call_after(REGISTER_AGAIN, self._register, then, bond)

        if self.withdrawn:
            failed()
            return
        self.ask(self.dva, self._registration, answered, failed)

    def turn_to(self, dva: str) -> None:
        """Register with another DVA; from its confirmation on, obey that one and no other (S12)."""
        if self._turns:
            return
        self._turns = True
        life = self._life

        def answered(reply: m.Reply) -> None:
            self._turns = False
            if reply.code == m.OK and life == self._life:
                self._obey(dva)

        def failed() -> None:
            self._turns = False

        self.ask(dva, self._registration, answered, failed)

    def _obey(self, dva: str) -> None:
        """Change to another DVA; open requests to the previous one fail."""
        before = self.dva
        self.dva = dva
        self.dva_watch = DvaWatch()
        self.dva_watch.answered(self.clock.now)
        if self._dva_beats is not None:
            self._dva_beats.close()
            hear = self._on_dva_beat
            self._dva_beats = self.network.subscribe(self.id_tag, dva, HEARTBEAT, hear)
        self.clock.call_after(RENEW_PERIOD, self._register, do_nothing, self._bond)
        label = self.label_of(dva)
        self.tell(f"is registered with {label} instead of {self.label_of(before)}", "link")
        self.on_dva(dva)
        self.give_up(before)

    def _handed_over(self, message: m.Message, body: m.HandOver) -> m.Reply:
        """Change to another DVA if the present one requests it and the device is free to."""
        number = message.message_id
        if message.source != self.dva:
            return m.Reply(number, m.NOT_PERMITTED, "only the DVA hands its devices over")
        if body.dva not in self.dvas:
            return m.Reply(number, m.UNKNOWN_DEVICE, f"no DVA {body.dva} is known here")
        if self.is_engaged():
            return m.Reply(number, m.BUSY, "has something to do for this DVA")
        if body.address is not None:
            self.introduce(body.dva, body.address)
        self.clock.call_after(0.0, self.turn_to, body.dva)
        return m.Reply(number, m.OK, "")

    def why_refused(self, reply: m.Reply) -> str:
        """Return the reason of a refused registration, and a remedy."""
        advice = self.other_id if reply.code == m.BUSY else ""
        return f"{reply.text}; {advice}" if advice else reply.text

    @property
    def _registration(self) -> m.Registration:
        return m.Registration(self.label, self.device_type, self.address)

    def ask(
        self,
        peer: str,
        body: m.Body,
        on_reply: Callable[[m.Reply], object] = do_nothing,
        on_failure: Callable[[], object] = do_nothing,
        session: int = 0,
    ) -> None:
        """Send a request on the acknowledged channel; replies come in the order of requests.

        An emergency has a socket of its own, so that it never waits behind another request; so
        has a robot's question who may act on it.
        """
        if self.silent:
            self.clock.call_after(self.attempts * self.timeout, on_failure)
            return
        requester = self._requester(peer, isinstance(body, m.Emergency | m.GetGrant))
        message = self.outbox.message(peer, body, self.clock.now, session)

        def answered(data: bytes) -> None:
            reply = self.reply_to(message, data)
            if reply is not None and peer == self.dva:
                self.dva_watch.answered(self.clock.now)
                self._look_for_dva()
            if reply is None:
                on_failure()  # whether the request was executed is unknown
            else:
                self._meet(peer, reply)
                on_reply(reply)
            if reply is not None and reply.code == m.NOT_REGISTERED and peer == self.dva:
                self.ask(peer, self._registration)  # before the next request, which it needs

        def failed() -> None:
            if peer == self.dva:
                self.dva_watch.failed()
                self._look_for_dva()
            on_failure()

        requester.request(encode(message), answered, failed)

    def _requester(self, peer: str, urgent: bool) -> Requester:
        """Return the requester for a peer, with a connection of its own for urgent messages."""
        key = peer, urgent
        if key not in self._requesters:
            self._requesters[key] = Requester(
                self.network, self.id_tag, peer, self.timeout, self.attempts
            )
        return self._requesters[key]

    def connect(self, peer: str) -> None:
        """Connect to a peer now: over a long link the first request need not wait for that."""
        self._kept_open.add(peer)
        for urgent in (True, False):
            self._requester(peer, urgent).open()

    def be_patient(self, timeout: float) -> None:
        """Set the time-out of requests from now on [s]."""
        self.timeout = timeout
        for requester in self._requesters.values():
            requester.timeout = timeout

    def give_up(self, peer: str) -> None:
        """Treat all open requests to a peer as failed."""
        for key in [(peer, False), (peer, True)]:
            requester = self._requesters.pop(key, None)
            if requester is not None:
                requester.give_up()

    def forget(self, peer: str) -> None:
        """Forget a peer that has left; open requests to it fail."""
        self.give_up(peer)
        self._kept_open.discard(peer)
        self._addresses.pop(peer, None)
        self.network.forget(peer)

    def reply_to(self, message: m.Message, data: bytes) -> m.Reply | None:
        """Return the reply in `data`; None unless it is the peer's reply to this request."""
        answer = self.read(data, message.destination)
        if answer is None or not isinstance(answer.body, m.Reply):
            return None
        if answer.body.answers not in (message.message_id, 0):  # 0: it could not be read
            self.recorder.counters["refused: a reply to something else"] += 1
            return None
        return answer.body

    def _meet(self, peer: str, reply: m.Reply) -> None:
        """Introduce the devices in a permission of the DVA, in either role."""
        content = reply.content
        if peer == self.dva and isinstance(content, m.Permission) and content.address is not None:
            self.introduce(content.device, content.address)

    def introduce(self, peer: str, address: str) -> None:
        """Set the address of a peer; requests that are open elsewhere are repeated there."""
        before = self._addresses.get(peer, address)
        self._addresses[peer] = address
        self.network.introduce(peer, address)
        if before != address:
            for urgent in (True, False):
                if (requester := self._requesters.get((peer, urgent))) is not None:
                    requester.renew()

    def serve(self, handler: Handler) -> None:
        """Set the handler of requests on the acknowledged channel."""
        self.network.serve(self.id_tag, lambda request: self.take(request, handler))

    def take(self, request: Request, handler: Handler) -> None:
        """Answer a request: a copy by the earlier reply, others by a refusal or `handler`."""
        reply = self._replies.get(key_of(request.sender, request.data))
        message = self.admit(request) if reply is None else None
        if reply is not None:
            request.answer(reply)
        elif message is not None:
            self.conclude(request, message, handler)

    def admit(self, request: Request) -> m.Message | None:
        """Return the message of a request, if it is one, and for this device.

        Invalid messages are refused at once, at no cost but that of reading. A sender of little
        else gets no replies, and then is not read (`Nuisances`). A possible emergency always is.
        """
        now = self.clock.now
        count = self.recorder.counters
        hearing = self._nuisances.hearing(request.peer, now)
        if hearing is IGNORED and b"<EmergencyMsg" not in request.data:
            self._nuisances.bad(request.peer, now)
            count["refused unread: of a peer that sends no messages"] += 1
            return None
        try:
            message = decode(request.data)
        except ProtocolError as error:
            count["refused"] += 1
            self._nuisances.bad(request.peer, now)
            if hearing is ANSWERED:
                request.answer(self._bad_message(error))
            return None
        refusal = self._imposture(message, request.sender) or self._misdirection(message)
        if refusal is None and isinstance(message.body, m.Reply):
            refusal = m.Reply(message.message_id, m.NOT_SUPPORTED, "a reply to nothing")
        if refusal is not None:
            self.turn_away(request, message, refusal)
            return None
        return message

    def turn_away(self, request: Request, message: m.Message | None, refusal: m.Reply) -> None:
        """Refuse a message on arrival, even an unreadable one; report it unless too often."""
        now = self.clock.now
        hearing = self._nuisances.hearing(request.peer, now)
        self._nuisances.bad(request.peer, now)
        self.recorder.counters[f"refused: {m.CODE_NAMES[refusal.code]}"] += 1
        if hearing is not ANSWERED:
            return
        if message is None:
            request.answer(self._bad_message(ProtocolError(refusal.code, refusal.text)))
        else:
            request.answer(self.reply(message, refusal))

    def conclude(
        self,
        request: Request,
        message: m.Message,
        handler: Callable[[m.Message], m.Reply | None],
        *,
        at_once: bool = False,
    ) -> None:
        """Handle an admitted message once, by `handler`, and answer it.

        Args:
            request: Request that carried the message.
            message: Content of the request.
            handler: Handler that returns the reply; None: the message waits, and is concluded
                later.
            at_once: It is refused as it arrives: a sender of such is listened to less and less.
        """
        note = self._nuisances.bad if at_once else self._nuisances.good
        note(request.peer, self.clock.now)
        key = key_of(request.sender, request.data)
        reply = self._replies.get(key)
        if reply is None:
            if isinstance(message.body, m.HandOver):
                body: m.Reply | None = self._handed_over(message, message.body)
            else:
                body = handler(message)
            if body is None:
                return
            if body.code != m.OK:
                self.recorder.counters[f"refused: {m.CODE_NAMES[body.code]}"] += 1
            reply = self.reply(message, body)
            # Repeated emergencies act, too: a button may always send the same bytes.
            if not urgent(message):
                self._replies.put(key, message.source, reply)
        request.answer(reply)

    def _imposture(self, message: m.Message, sender: str | None) -> m.Reply | None:
        """Return the refusal of a message that speaks for another device than its key is of.

        An emergency is obeyed all the same: it can only stop.
        """
        if sender in (None, message.source) or urgent(message):
            return None
        self.tell(f"{sender} speaks for {message.source}", "link")
        return m.Reply(message.message_id, m.NOT_PERMITTED, f"this is the key of {sender}")

    def _misdirection(self, message: m.Message) -> m.Reply | None:
        """Return the refusal of a message for another device; emergencies are obeyed anyway."""
        if message.destination == self.id_tag or urgent(message):
            return None
        return m.Reply(message.message_id, m.UNKNOWN_DEVICE, f"this is {self.id_tag}")

    def reply(self, message: m.Message, body: m.Reply) -> bytes:
        """Return a reply to `message` as bytes.

        One that no message can hold keeps its code alone.
        """
        session = message.session or 0
        now = self.clock.now
        try:
            return self.outbox.encode(message.source, body, now, session)
        except ProtocolError:
            self.recorder.counters["replies cut short"] += 1
            short = m.Reply(body.answers, body.code, "")
            return self.outbox.encode(message.source, short, now, session)

    def read(self, data: bytes, source: str | None = None) -> m.Message | None:
        """Return a message from bytes.

        None, and counted, if it is not valid or not from `source`.
        """
        try:
            message = decode(data)
        except ProtocolError:
            self.recorder.counters["refused"] += 1
            return None
        if source not in (None, message.source):
            self.recorder.counters["refused: of another source"] += 1
            return None
        return message

    def report_finding(
        self,
        body: m.EventReport,
        on_reply: Callable[[m.Reply], object] = do_nothing,
        on_failure: Callable[[], object] = do_nothing,
    ) -> None:
        """Report a finding, until a DVA takes it or something newer was found there.

        Args:
            body: The finding.
            on_reply: Callback for the first reply.
            on_failure: Called if no reply to the first request arrives.
        """
        self._report(f"finding {body.event_id}", body, on_reply, on_failure)

    def progress(
        self,
        event_id: int,
        state: str,
        on_reply: Callable[[m.Reply], object] = do_nothing,
        on_failure: Callable[[], object] = do_nothing,
    ) -> None:
        """Report how an order stands, until a DVA takes it or it stands differently.

        Args:
            event_id: Event of the order.
            state: State as in the message.
            on_reply: Callback for the first reply.
            on_failure: Called if no reply to the first request arrives.
        """
        self._report("order", m.OrderProgress(event_id, state), on_reply, on_failure)

    def _report(
        self,
        subject: str,
        body: m.Body,
        on_reply: Callable[[m.Reply], object] = do_nothing,
        on_failure: Callable[[], object] = do_nothing,
    ) -> None:
        """Ask the present DVA, then the next, to take a report, unless a newer one replaces it."""
        self._reports[subject] = body
        life = self._life

        def repeat() -> None:
            if life == self._life and self._reports.get(subject) is body:
                self._report(subject, body)

        def answered(reply: m.Reply) -> None:
            on_reply(reply)
            if reply.code == m.BUSY:
                self.clock.call_after(REPORT_AGAIN, repeat)
            elif self._reports.get(subject) is body:
                del self._reports[subject]

        def unheard() -> None:
            on_failure()
            self.clock.call_after(REPORT_AGAIN, repeat)

        self.ask(self.dva, body, answered, unheard)

    def publish(self, topic: str, body: m.Body, to: str | None = None) -> None:
        """Publish a message to all subscribers; its header names the DVA or another receiver."""
        if self.silent or self.withdrawn:
            return
        data = encode(self.outbox.message(to or self.dva, body, self.clock.now))
        self.network.publish(self.id_tag, topic, data, len(data))

    @property
    def round_trips(self) -> list[float]:
        """Durations of the last requests to each peer [s], on the acknowledged channel."""
        return [
            trip
            for asker in self._requesters.values()
            for trip in islice(reversed(asker.round_trips), 50)
        ]

    def tell(self, what: str, kind: str = "event") -> None:
        """Add a line to the timeline."""
        self.recorder.tell(self.clock.now, self.label, what, kind)

    def label_of(self, id_tag: str) -> str:
        """Return the name of a device for people."""
        return self.labels.get(id_tag, id_tag)

    def _heartbeat(self, life: int) -> bool:
        if life == self._life:
            self.publish(HEARTBEAT, m.Heartbeat())
            self._look_for_dva()
        return life == self._life

    def _disconnect_unused(self, life: int) -> bool:
        """Close connections to peers of whom nothing was asked: they leave without a word."""
        for (peer, _), requester in self._requesters.items():
            if peer not in self._kept_open:
                requester.rest()
        return life == self._life

    def _on_dva_beat(self, data: bytes) -> None:
        message = self.read(data, self.dva)
        if message is None or not isinstance(message.body, m.Heartbeat):
            return
        is_restarted = self.dva_watch.beat(self.clock.now, message.message_id)
        if is_restarted and len(self.dvas) > 1:  # it may have forgotten all permissions
            self.ask(self.dva, self._registration, lambda _: self.on_dva(message.source))
        self._look_for_dva()

    def _look_for_dva(self) -> None:
        """Say when the DVA has fallen silent, and when it is back."""
        now = self.clock.now
        watch = self.dva_watch
        has_changed = watch.look(now)
        if self.silent:
            return
        if watch.silent and len(self.dvas) > 1:
            self.turn_to(self.dvas[(self.dvas.index(self.dva) + 1) % len(self.dvas)])
        if not has_changed:
            return
        if watch.silent:
            self.recorder.counters["the DVA was silent to a device"] += 1
            meanwhile = self.meanwhile and watch.heard is not None and f"; {self.meanwhile}"
            self.tell(f"{self.dva_alert}{meanwhile or ''}", "link")
        else:
            self.tell("hears the DVA again", "link")

    @property
    def dva_alert(self) -> str:
        """Alert for a person while the DVA is silent; empty otherwise."""
        watch = self.dva_watch
        if not watch.silent:
            return ""
        if watch.heard is None:
            where = self.dva_address and f" at {self.dva_address}"
            return f"no DVA has answered{where} yet: it was never registered"
        return f"the DVA is silent for {watch.silence(self.clock.now):.0f} s"

    def _bad_message(self, error: ProtocolError) -> bytes:
        body = m.Reply(0, error.code, error.reason[:256])
        return self.outbox.encode(self.dva, body, self.clock.now)


def command_topic(robot: str) -> str:
    """Return the topic of the commands for a robot.

    The bar ends it, so that no topic begins another.
    """
    return f"{robot}|"
