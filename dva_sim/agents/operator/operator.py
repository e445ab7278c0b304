"""An operator at work: takes an order, gets permission, drives or supervises, reports, is free.

An operator handles a limited number of orders at once, each with its own robot. The newest order
holds: it takes the place of an older one of the same robot, or of the oldest at the limit; a robot
that was on its way is stopped first. Robots on missions are watched all at once; of those that are
driven, all but one stand until it is their turn.
"""

from __future__ import annotations

from functools import partial

from dva_sim.agents.operator import steps
from dva_sim.agents.operator.attention import DriverSeat
from dva_sim.agents.operator.drive import Teleoperation
from dva_sim.agents.operator.refusals import ASK_AGAIN
from dva_sim.agents.operator.steps import START_AGAIN
from dva_sim.agents.operator.supervision import REFUSED, Work
from dva_sim.kernel.recorder import DriveLog
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m

ASK_BEFORE = 3  # design: requests for one order before a drive
ASK_AFTER = 1  # design: requests for one order in a drive
AS_SEEN = {
    "lost link": "presumes the link lost",
    REFUSED: "is refused",
}  # report on an order, by the end of its drive
REDIRECTED = "redirected"
RECALLED = "recalled"
BY_DVA = (REDIRECTED, RECALLED)  # how a drive ends by the DVA's word


class OperatorAgent:
    """A person with a phone in the control room.

    Args:
        seat: Person and equipment.
        kind: Control of robots at events: `Teleoperation`, or `Supervision` of missions.
        span: Maximum number of orders handled at once.

    Attributes:
        works: Orders in progress or being wound up, by robot.
    """

    def __init__(self, seat: DriverSeat, kind: type[Work] = Teleoperation, span: int = 1) -> None:
        self.device = seat.device
        self._seat = seat
        self._kind = kind
        self._span = span
        self.works: dict[str, Work] = {}
        self._waiting: list[tuple[float, m.Order]] = []  # arrival time [s]; oldest first
        self._again: tuple[m.Order | None, int] = (None, 0)  # refused order, and number of refusals
        self._habits = seat.person.habits.asking
        self.device.serve(self._on_request)

    @property
    def activity(self) -> str:
        """Activity of the person, in words."""
        return ", ".join(map(self._doing, self.works.values())) or "waiting"

    def _doing(self, work: Work) -> str:
        verb = "reads of" if work.log.started is None else work.verb
        return f"{verb} {self.device.label_of(work.robot)}"

    def put_down(self) -> None:
        """Leave: end all current work and stop the robots."""
        self._waiting.clear()
        for work in list(self.works.values()):
            work.end("gave up", "the operator leaves")

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
            case m.HandoverRequest(device=robot, label=asker):
                if not self._gives_up(robot, asker):
                    return m.Reply(message.message_id, m.BUSY, "at work with it")
            case _:
                return m.Reply(message.message_id, m.NOT_SUPPORTED, "an operator drives robots")
        return m.Reply(message.message_id, m.OK, "")

    def _on_revocation(self, body: m.PermissionRevocation) -> None:
        """Release a robot whose permission has ended; the robot knows, too.

        Before the drive, that session may be over since the robot knows a higher one: ask again.
        """
        work = self.works.get(body.device)
        if work is None or work.over or work.session != body.session:
            return
        if work.log.started is None and self._may_ask_again(work):
            work.session = 0
            self.device.clock.call_after(START_AGAIN, self._ask_permission, work)
        else:
            work.end("gave up", "the permission was revoked")

    def _may_ask_again(self, work: Work) -> bool:
        """Return True if a refused order is tried once more, after asking the DVA."""
        times = 1 + self._asked_again(work)
        self._again = work.order, times
        return times <= (ASK_BEFORE if work.log.started is None else ASK_AFTER)

    def _asked_again(self, work: Work) -> int:
        order, times = self._again
        return times if order is work.order else 0

    def _gives_up(self, robot: str, asker: str) -> bool:
        """Return True if a robot may be given away: not on its way to an event, or watching it."""
        work = self.works.get(robot)
        keeps = work is not None and not work.over and work.log.started is not None
        label = self.device.label_of(robot)
        self.device.tell(f"{'keeps' if keeps else 'gives up'} {label}: {asker} asks", "order")
        return not keeps

    # --- orders ----------------------------------------------------------------------

    @property
    def _orders(self) -> list[m.Order]:
        """Orders in progress that the DVA has not recalled."""
        begun = [w.order for w in self.works.values() if w.log.outcome not in BY_DVA]
        return begun + [order for _, order in self._waiting]

    def _on_order(self, order: m.Order) -> None:
        if order in self._orders:
            return  # a repeated order
        self._make_room(order)
        self._waiting.append((self.device.clock.now, order))
        self._go_on()

    def _make_room(self, order: m.Order) -> None:
        """End the order that a new one replaces, if any."""
        going_on = [w for w in self.works.values() if not w.over]
        in_hand = [(w.log.ordered, w.order) for w in going_on] + self._waiting
        same = [old for old in in_hand if old[1].device == order.device]
        if same or len(in_hand) >= self._span:
            _, replaced = min(same or in_hand, key=lambda old: old[0])
            self._drop(replaced, REDIRECTED)

    def _drop(self, order: m.Order, outcome: str) -> None:
        self._waiting = [old for old in self._waiting if old[1] is not order]
        for work in list(self.works.values()):
            if work.order is order:
                work.end(outcome)

    def _on_recall(self, event_id: int) -> None:
        """End an order that is over by the DVA's word."""
        for order in self._orders:
            if order.event_id == event_id:
                self._drop(order, RECALLED)

    def _go_on(self) -> None:
        """Start waiting orders up to the operator's capacity, one per robot."""
        most = self._kind.at_once or self._span
        for since, order in list(self._waiting):
            if len(self.works) < most and order.device not in self.works:
                self._waiting.remove((since, order))
                self._take_up(order, since)

    def _take_up(self, order: m.Order, ordered: float) -> None:
        assert order.device is not None
        device = self.device
        log = DriveLog(order.device, device.id_tag, order.event_id, ordered)
        log.taken_up = device.clock.now
        device.recorder.drive_ordered(log)
        drive = self.works[order.device] = self._kind(self._seat, order, log, self._finish)
        robot = device.label_of(order.device)
        device.tell(f"shall {drive.wish} {robot} to event {order.event_id}", "order")
        device.clock.call_after(self._seat.reading(), self._ask_permission, drive)

    def _ask_permission(self, drive: Work) -> None:
        if drive.over:
            return

        def answered(reply: m.Reply) -> None:
            if drive.over:
                if isinstance(reply.content, m.Permission):
                    self._give_back(drive.robot, reply.content.session)
            elif isinstance(reply.content, m.Permission):
                was_granted = drive.granted
                drive.granted = True
                drive.session = reply.content.session
                if not was_granted:
                    self._turn_on_picture(drive)
                    self._start(drive)
            elif reply.code == m.BUSY and not self._asked_again(drive):
                later = self._habits.again_after_s
                self.device.clock.call_after(later, self._ask_permission, drive)
            else:
                drive.end("gave up", reply.text)

        def unreachable() -> None:
            drive.end("lost link", "the DVA does not answer")
            wanted = partial(self._wants, drive.robot)
            steps.give_back_unanswered(self.device, drive.robot, drive.level, wanted)

        body = m.PermissionRequest(drive.robot, drive.level)
        self.device.ask(self.device.dva, body, answered, unreachable)

    def _turn_on_picture(self, drive: Work) -> None:

        def seen(picture: Subscription) -> None:
            drive.picture = picture

        steps.watch(
            self.device,
            drive.robot,
            drive.session,
            topic=self._seat.setup.topic,
            on_frame=drive.on_frame,
            seen=seen,
            blind=lambda url: drive.end("gave up", f"no camera to watch at {url!r}"),
            wanted=lambda: not drive.over,
        )

    def _start(self, drive: Work) -> None:
        def begun() -> None:
            self.device.progress(drive.order.event_id, "departed")
            self.device.tell(f"{drive.verb} {self.device.label_of(drive.robot)}", "drive")
            drive.begin()

        steps.start(
            self.device,
            drive.robot,
            drive.beginning(),
            lambda: drive.session,
            wanted=lambda: not drive.over,
            begun=begun,
            refused=lambda why: drive.end("gave up", why),
            lost=drive.link_lost,
        )

    def _finish(self, drive: Work, outcome: str, why: str) -> None:
        """Finish a drive: stop the robot, tell the DVA, be free again."""
        device = self.device
        order = drive.order
        device.tell(f"{AS_SEEN.get(outcome, outcome)}{': ' + why if why else ''}", "drive")
        is_decided = outcome in ("confirmed", "refuted")
        by_dva = outcome in BY_DVA
        if is_decided:
            body = m.EventReport(order.event_id, order.kind, order.position, 0.5, 0.95, outcome)
            device.report_finding(body)

        def give_back(_: object = None) -> None:
            if by_dva:
                self._give_back(drive.robot, drive.session)
            elif drive.log.refusal in ASK_AGAIN and self._may_ask_again(drive):
                self._waiting.insert(0, (device.clock.now, order))
            else:
                # The DVA takes the robot back with the order, unless it has ended that before,
                # or has meanwhile given the order for another robot.
                state = "done" if is_decided else "failed"
                device.progress(order.event_id, state, ended, unheard)
            if self._waiting and drive.session:
                # Before it stands, the robot would refuse to start.
                self.device.clock.call_after(self._habits.stands_after_s, self._put_away, drive)
            else:
                self._put_away(drive)  # nothing moves

        also = any(
            other.event_id == order.event_id and other.device != order.device
            for other in self._orders
        )

        def ended(reply: m.Reply) -> None:
            if reply.code != m.OK or also:
                unheard()

        def unheard() -> None:
            self._give_back(drive.robot, drive.session)

        if outcome == "lost link":
            # One message to stop the robot, in case the link still carries it; the answer is not
            # awaited. A mission is cancelled: after an emergency only teleoperation could begin.
            ending = drive.ending()
            stop = m.Emergency() if isinstance(ending, m.StopTeleOp) else ending
            device.ask(drive.robot, stop, session=drive.session)
            give_back()
        elif drive.log.started is None and not (drive.session and by_dva):
            give_back()
        else:
            device.ask(drive.robot, drive.ending(), give_back, give_back, drive.session)

    def _give_back(self, robot: str, session: int) -> None:
        """Give back a permission, unless the next order is for the same robot."""
        if session and not self._wants(robot):
            steps.give_back(self.device, robot, session)

    def _wants(self, robot: str) -> bool:
        work = self.works.get(robot)
        goes_on = work is not None and not work.over
        return goes_on or any(order.device == robot for _, order in self._waiting)

    def _put_away(self, drive: Work) -> None:
        del self.works[drive.robot]
        self._go_on()
