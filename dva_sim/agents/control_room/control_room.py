"""A control room: its knowledge of the events, and its requests to the DVA.

All control goes by messages, as from any console: the owner of the agent sends bodies of
`protocol/control_room.py` by `ask`; callbacks deliver the DVA's publications.
"""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.agents.control_room.history import EventHistory
from dva_sim.agents.device import AUDIT, EVENT, AgentDevice, do_nothing
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m

REFRESH = 10.0  # design: interval of requests for the whole list, as news may be lost [s]
MAX_CLOSED = 200  # design: maximum closed events that are kept


class ControlRoomAgent:
    """One control room.

    Args:
        device: Identity and connections of the agent; of type `ControlRoom`.

    Attributes:
        events: Latest published state of each event, by number.
        received_at: Time of that publication [s].
        histories: Steps of each event, by number, as far as they were received.
        devices: Registered devices by id, from the latest list.
        dispatch: Dispatch mode and own role; None until the first publication.
        raised: Number of the event that it raised last, from the DVA's record.
        orders: Orders for robots that it drives at its own wish, by event.
        on_event: Callback for each change of an event.
        on_list: Callback once the DVA has sent all current events.
        on_dispatch: Callback for each change of the dispatch mode.
        on_record: Callback for each decision.
        on_forgotten: Callback when the DVA does not know this room: it may have lost its memory.
        gives_up: True if it gives up a robot that another device requests.
        on_message: Callback for messages of the DVA to it: a session has ended, an order is over.
    """

    def __init__(self, device: AgentDevice) -> None:
        self.device = device
        self._listening: list[Subscription] = []
        self.events: dict[int, m.EventStatus] = {}
        self.received_at: dict[int, float] = {}
        self.histories: dict[int, EventHistory] = {}
        self.devices: dict[str, m.Device] = {}
        self.dispatch: m.DispatchStatus | None = None
        self.raised: int | None = None
        self.orders: dict[int, m.Order] = {}
        self.on_event: Callable[[m.EventStatus], object] = do_nothing
        self.on_list: Callable[[], object] = do_nothing
        self.on_dispatch: Callable[[m.DispatchStatus], object] = do_nothing
        self.on_record: Callable[[m.AuditRecord], object] = do_nothing
        self.on_forgotten: Callable[[], object] = do_nothing
        self.on_message: Callable[[m.Message], object] = do_nothing
        self.gives_up: Callable[[m.HandoverRequest], bool] = lambda _: False

    def start(self) -> None:
        """Register, listen to the DVA, and ask it for the whole list now and then."""
        device = self.device
        device.serve(self._on_request)
        self._listen(device.dva)
        device.on_dva = self._listen
        device.register(self.refresh)
        device.clock.every(REFRESH, self.refresh, start=device.clock.now + REFRESH)

    def _listen(self, dva: str) -> None:
        """Listen to a DVA, and to no other."""
        for subscription in self._listening:
            subscription.close()
        device = self.device
        heard = self._on_published
        topics = EVENT, AUDIT
        self._listening = [device.network.subscribe(device.id_tag, dva, t, heard) for t in topics]

    def refresh(self) -> None:
        """Request the lists of events and devices and the order rules, if it takes part."""
        if self.device.withdrawn:
            return
        self.ask(m.GetDispatch())
        self.ask(m.GetDeviceList())
        self._ask_above(None)

    def ask(
        self,
        body: m.Body,
        then: Callable[[m.Reply], object] = do_nothing,
        failed: Callable[[], object] = do_nothing,
    ) -> None:
        """Send a request to the DVA; `then` is called after the reply has been processed."""

        def answered(reply: m.Reply) -> None:
            if reply.code == m.NOT_REGISTERED:
                self.on_forgotten()
            self._take(reply.content)
            then(reply)

        self.device.ask(self.device.dva, body, answered, failed)

    def _ask_above(self, number: int | None) -> None:
        """Handle one part of a list that arrives in parts, ordered by number."""

        def more(reply: m.Reply) -> None:
            if not isinstance(reply.content, m.EventList):
                return
            if reply.content.events:
                self._ask_above(reply.content.events[-1].event_id)
            else:
                self.on_list()

        self.ask(m.GetEventList(number), more)

    # --- incoming messages ------------------------------------------------------------

    def _on_published(self, data: bytes) -> None:
        message = self.device.read(data, self.device.dva)
        if message is not None:
            self._take(message.body)

    def _take(self, body: object) -> None:
        match body:
            case m.EventStatus():
                self._note(body)
            case m.EventList(events=events):
                for status in events:
                    self._note(status)
            case m.DispatchStatus():
                before = self.dispatch
                # Published messages do not name the role.
                role = body.role or (before.role if before else None)
                self.dispatch = m.DispatchStatus(
                    body.dispatch_mode, body.decide_within, body.switched, role
                )
                if before is None or before.dispatch_mode != body.dispatch_mode:
                    self.on_dispatch(self.dispatch)
            case m.DeviceList(devices=devices):
                self.devices = {device.id_tag: device for device in devices}
            case m.AuditRecord():
                if body.event_id in self.histories:
                    history = self.histories[body.event_id]
                    history.hear_record(body, self.device.clock.now)
                if body.author == self.device.id_tag and body.action == "raise":
                    self.raised = body.event_id
                self.on_record(body)

    def _note(self, status: m.EventStatus) -> None:
        """Note the state of an event; replies may overtake publications."""
        number = status.event_id
        newest = self.events.get(status.event_id)
        if newest is not None and (status.age, status.decisions) < (newest.age, newest.decisions):
            return
        self.events[number] = status
        self.received_at[number] = now = self.device.clock.now
        self.histories.setdefault(number, EventHistory()).hear_status(status, now)
        self._forget_the_oldest()
        self.on_event(status)

    def _forget_the_oldest(self) -> None:
        if len(self.events) <= MAX_CLOSED:
            return
        closed = [n for n, status in self.events.items() if status.closed_for is not None]
        for number in sorted(closed)[:-MAX_CLOSED]:
            del self.events[number], self.received_at[number], self.histories[number]

    def _on_request(self, message: m.Message) -> m.Reply:
        """Answer a request of the DVA to holders of robots; it has requested none."""
        body = message.body
        answer = m.Reply(message.message_id, m.OK, "")
        if message.source != self.device.dva:
            text = "only the DVA says such things"
            return m.Reply(message.message_id, m.NOT_PERMITTED, text)
        match body:
            case m.HandoverRequest():
                if not self.gives_up(body):
                    return m.Reply(message.message_id, m.BUSY, "it is in use")
            case m.Order():
                self.orders[body.event_id] = body
            case m.OrderProgress():
                self.orders.pop(body.event_id, None)
            case m.PermissionRevocation():
                pass
            case _:
                name = type(body).__name__
                return m.Reply(message.message_id, m.NOT_SUPPORTED, f"no use for {name}")
        self.on_message(message)
        return answer
