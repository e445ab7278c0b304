"""An operator at work: takes an order, gets permission, drives or supervises, reports, is free.

The newest order holds: it takes the place of the present work, whose robot is stopped first.
"""

from __future__ import annotations

from dva_sim.agents.camera import CAMERA_SCHEME
from dva_sim.agents.operator.drive import Drive
from dva_sim.agents.operator.seat import DriverSeat
from dva_sim.agents.operator.work import Work
from dva_sim.protocol import messages as m
from dva_sim.recorder import DriveLog

ASK_AGAIN = 2.0  # when the robot is held by somebody else [s]
START_TRIES = 20
START_AGAIN = 1.0  # when the grant may still be on its way to the robot [s]
STANDSTILL = 1.5  # after a stop, a robot certainly stands; before, it would refuse to start [s]
REDIRECTED, RECALLED = BY_DVA = "redirected", "recalled"  # how a drive ends by the DVA's word


class OperatorAgent:
    """A person with a phone in the control room.

    Args:
        seat: Who it is, and what is at hand.
        kind: How it has robots look at events: `Drive` them, or `Supervise` their missions.
    """

    def __init__(self, seat: DriverSeat, kind: type[Work] = Drive) -> None:
        self.device, self._seat, self._kind = seat.device, seat, kind
        self._drive: Work | None = None
        self._next: m.Order | None = None  # what to do when the present drive has ended
        self._ordered = 0.0  # when the newest order came [s]
        self.device.serve(self._on_request)

    @property
    def activity(self) -> str:
        """What the person is doing, in words."""
        drive = self._drive
        if drive is None:
            return "waiting"
        robot = self.device.label_of(drive.robot)
        return f"{'reads of' if drive.log.started is None else drive.verb} {robot}"

    def put_down(self) -> None:
        """Leave: a drive that is going on ends here, and its robot is told to stop."""
        self._next = None
        if self._drive is not None:
            self._drive.end("gave up", "the operator leaves")

    def _on_request(self, message: m.Message) -> m.Reply:
        if message.source != self.device.dva:
            return m.Reply(message.message_id, m.NOT_PERMITTED, "only the DVA gives orders")
        match message.body:
            case m.PermissionRevocation() as body:
                self._on_revocation(body)
            case m.Order(device=str(), task="confirm") as order:
                self._on_order(order)
            case m.OrderProgress(event_id=event, state="done"):
                self._on_recall(event)
            case _:
                return m.Reply(message.message_id, m.NOT_SUPPORTED, "an operator drives robots")
        return m.Reply(message.message_id, m.OK, "")

    def _on_revocation(self, body: m.PermissionRevocation) -> None:
        """The robot is no longer ours to drive; it has been told, too."""
        drive = self._drive
        if drive is not None and (drive.robot, drive.session) == (body.device, body.session):
            drive.end("gave up", "the permission was revoked")

    @property
    def _order(self) -> m.Order | None:
        """The newest order that the DVA has not taken back."""
        if self._next is not None or self._drive is None:
            return self._next
        return None if self._drive.log.outcome in BY_DVA else self._drive.order

    def _on_order(self, order: m.Order) -> None:
        held = self._order
        if held is not None and (held.event_id, held.device) == (order.event_id, order.device):
            return  # the DVA says again what it has said before
        self._ordered = self.device.clock.now
        if self._drive is None:
            self._take_up(order)
        else:
            self._next = order
            self._drive.end(REDIRECTED)

    def _on_recall(self, event_id: int) -> None:
        """The DVA says that an order is over."""
        if self._order is not None and self._order.event_id == event_id:
            self._next = None
            if self._drive is not None and self._drive.order.event_id == event_id:
                self._drive.end(RECALLED)

    def _take_up(self, order: m.Order) -> None:
        assert order.device is not None
        device = self.device
        log = DriveLog(order.device, device.id_tag, order.event_id, self._ordered)
        device.recorder.drive_ordered(log)
        drive = self._drive = self._kind(self._seat, order, log, self._finish)
        robot = device.label_of(order.device)
        device.tell(f"shall {drive.wish} {robot} to event {order.event_id}", "order")
        device.clock.call_after(self._seat.person.reading, self._ask_permission, drive)

    def _ask_permission(self, drive: Work) -> None:
        if drive.over:
            return

        def answered(reply: m.Reply) -> None:
            if drive.over:
                if isinstance(reply.content, m.Permission):
                    self._give_back(drive.robot, reply.content.session)
            elif isinstance(reply.content, m.Permission):
                drive.session = reply.content.session
                self._turn_on_picture(drive)
                self._start(drive)
            elif reply.code == m.BUSY:
                self.device.clock.call_after(ASK_AGAIN, self._ask_permission, drive)
            else:
                drive.end("gave up", reply.text)

        body = m.PermissionRequest(drive.robot, drive.level)
        unreachable = lambda: drive.end("lost link", "the DVA does not answer")  # noqa: E731
        self.device.ask(self.device.dva, body, answered, unreachable)

    def _turn_on_picture(self, drive: Work) -> None:
        """Ask the robot where its camera is, and watch it."""

        def answered(reply: m.Reply) -> None:
            if drive.over:
                return
            url = reply.content.camera_url if isinstance(reply.content, m.SensorInfo) else ""
            if not url.startswith(CAMERA_SCHEME):
                drive.end("gave up", f"no camera to watch at {url!r}")
                return
            topic = url.rpartition("/")[2]
            drive.picture = self.device.network.subscribe(
                self.device.id_tag, drive.robot, topic, drive.on_frame
            )

        self.device.ask(drive.robot, m.GetSensorInfo(), answered, session=drive.session)

    def _start(self, drive: Work, tries: int = 1) -> None:
        def answered(reply: m.Reply) -> None:
            if drive.over:
                return
            if reply.code == m.OK:
                self.device.progress(drive.order.event_id, "departed")
                self.device.tell(f"{drive.verb} {self.device.label_of(drive.robot)}", "drive")
                drive.begin()
            elif tries < START_TRIES and reply.code in (m.BUSY, m.NOT_PERMITTED, m.BAD_SESSION):
                self.device.clock.call_after(START_AGAIN, self._start, drive, tries + 1)
            else:
                drive.end("gave up", reply.text)

        if not drive.over:
            body = drive.beginning()
            self.device.ask(drive.robot, body, answered, drive.link_lost, drive.session)

    def _finish(self, drive: Work, outcome: str, why: str) -> None:
        """A drive is over: stop the robot, tell the DVA, be free again."""
        device, order = self.device, drive.order
        device.tell(f"{outcome}{': ' + why if why else ''}", "drive")
        found, by_dva = outcome in ("confirmed", "refuted"), outcome in BY_DVA
        if found:
            body = m.EventReport(order.event_id, order.kind, order.position, 0.5, 0.95, outcome)
            device.ask(device.dva, body)

        def give_back(_: object = None) -> None:
            if by_dva:
                self._give_back(drive.robot, drive.session)
            else:
                device.progress(order.event_id, "done" if found else "failed")
            self._be_free(drive)

        if outcome == "lost link":
            # Whatever still gets through shall stop the robot; nobody waits for the answer.
            device.ask(drive.robot, m.Emergency(), session=drive.session)
            give_back()
        elif drive.log.started is None and not (drive.session and by_dva):
            give_back()
        else:
            device.ask(drive.robot, drive.ending(), give_back, give_back, drive.session)

    def _give_back(self, robot: str, session: int) -> None:
        """A permission is needed no longer, unless the next drive is of the same robot."""
        if session and (self._order is None or self._order.device != robot):
            body = m.PermissionRevocation(robot, self.device.id_tag, session)
            self.device.ask(self.device.dva, body)

    def _be_free(self, drive: Work) -> None:
        """The robot was told to stop: what is next?"""
        if self._next is None:
            self._drive = None
        elif drive.session == 0:
            self._go_on()  # nothing moves
        else:
            self.device.clock.call_after(STANDSTILL, self._go_on)

    def _go_on(self) -> None:
        order, self._drive, self._next = self._next, None, None
        if order is not None:
            self._take_up(order)
