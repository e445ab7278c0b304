"""An operator at work: takes an order, gets permission, drives, reports, is free again."""

from __future__ import annotations

from dva_sim.agents.camera import CAMERA_SCHEME
from dva_sim.agents.operator.drive import Drive, DriverSeat
from dva_sim.protocol import messages as m
from dva_sim.recorder import DriveLog

ASK_AGAIN = 2.0  # when the robot is held by somebody else [s]
START_TRIES = 20
START_AGAIN = 1.0  # when the grant may still be on its way to the robot [s]


class OperatorAgent:
    """A person with a phone in the control room.

    Args:
        seat: Who it is, and what is at hand.
    """

    def __init__(self, seat: DriverSeat) -> None:
        self.device, self._seat = seat.device, seat
        self._drive: Drive | None = None
        self.device.serve(self._on_request)

    @property
    def activity(self) -> str:
        """What the person is doing, in words."""
        drive = self._drive
        if drive is None:
            return "waiting"
        robot = self.device.label_of(drive.robot)
        return f"{'reads of' if drive.log.started is None else 'drives'} {robot}"

    def put_down(self) -> None:
        """Leave: a drive that is going on ends here, and its robot is told to stop."""
        if self._drive is not None:
            self._drive.end("gave up", "the operator leaves")

    def _on_request(self, message: m.Message) -> m.Reply:
        if message.source != self.device.dva:
            return m.Reply(message.message_id, m.NOT_PERMITTED, "only the DVA gives orders")
        if isinstance(message.body, m.PermissionRevocation):
            return self._on_revocation(message, message.body)
        return self._on_order(message)

    def _on_revocation(self, message: m.Message, body: m.PermissionRevocation) -> m.Reply:
        """The robot is no longer ours to drive; it has been told, too."""
        drive = self._drive
        if drive is not None and (drive.robot, drive.session) == (body.device, body.session):
            drive.end("gave up", "the permission was revoked")
        return m.Reply(message.message_id, m.OK, "")

    def _on_order(self, message: m.Message) -> m.Reply:
        order, device = message.body, self.device
        if not isinstance(order, m.Order) or order.device is None:
            return m.Reply(message.message_id, m.NOT_SUPPORTED, "an operator drives robots")
        if self._drive is not None:
            return m.Reply(message.message_id, m.BUSY, "driving already")
        now = device.clock.now
        log = DriveLog(order.device, device.id_tag, order.event_id, now)
        log.human_delay = self._seat.person.perceptual_delay + self._seat.person.hand_lag
        device.recorder.drives.append(log)
        drive = self._drive = Drive(self._seat, order, log, self._finish)
        robot = device.label_of(order.device)
        device.tell(f"shall drive {robot} to event {order.event_id}", "order")
        device.clock.call_after(self._seat.person.reading, self._ask_permission, drive)
        return m.Reply(message.message_id, m.OK, "")

    def _ask_permission(self, drive: Drive) -> None:
        def answered(reply: m.Reply) -> None:
            if isinstance(reply.content, m.Permission):
                drive.session = reply.content.session
                self._turn_on_picture(drive)
                self._start(drive)
            elif reply.code == m.BUSY:
                self.device.clock.call_after(ASK_AGAIN, self._ask_permission, drive)
            else:
                drive.end("gave up", reply.text)

        body = m.PermissionRequest(drive.robot, "teleoperation")
        unreachable = lambda: drive.end("lost link", "the DVA does not answer")  # noqa: E731
        self.device.ask(self.device.dva, body, answered, unreachable)

    def _turn_on_picture(self, drive: Drive) -> None:
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

    def _start(self, drive: Drive, tries: int = 1) -> None:
        def answered(reply: m.Reply) -> None:
            if drive.over:
                return
            if reply.code == m.OK:
                self.device.progress(drive.order.event_id, "departed")
                self.device.tell(f"drives {self.device.label_of(drive.robot)}", "drive")
                drive.begin()
            elif tries < START_TRIES and reply.code in (m.BUSY, m.NOT_PERMITTED, m.BAD_SESSION):
                self.device.clock.call_after(START_AGAIN, self._start, drive, tries + 1)
            else:
                drive.end("gave up", reply.text)

        if not drive.over:
            body = m.StartTeleOp()
            self.device.ask(drive.robot, body, answered, drive.link_lost, drive.session)

    def _finish(self, drive: Drive, outcome: str, why: str) -> None:
        """A drive is over: stop the robot, tell the DVA, be free again."""
        device, order = self.device, drive.order
        device.tell(f"{outcome}{': ' + why if why else ''}", "drive")
        found = outcome in ("confirmed", "refuted")
        if found:
            body = m.EventReport(order.event_id, order.kind, order.position, 0.5, 0.95, outcome)
            device.ask(device.dva, body)

        def give_back(_: object = None) -> None:
            device.progress(order.event_id, "done" if found else "failed")
            self._drive = None

        if outcome == "lost link":
            # Whatever still gets through shall stop the robot; nobody waits for the answer.
            device.ask(drive.robot, m.Emergency(), session=drive.session)
            give_back()
        elif drive.log.started is None:
            give_back()
        else:
            device.ask(drive.robot, m.StopTeleOp(), give_back, give_back, drive.session)
