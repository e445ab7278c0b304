"""A person at a console: an operator's device whose decisions a real person makes.

It registers, takes orders of the DVA and says what was found; it holds one robot or two and drives
them by the same input. It obeys revocations and requests to hand over, as simulated operators do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.observation import CameraFrame
from dva_sim.agents.operator.handheld import Console, Gathered, OnResult
from dva_sim.agents.operator.held_robot import HeldRobot
from dva_sim.agents.operator.operator import RECALLED
from dva_sim.agents.operator.steps import ask_emergency
from dva_sim.agents.tilt import GivenTilt, TiltSources
from dva_sim.protocol import messages as m

MAX_ROBOTS = 2  # design: maximum robots that a person drives by the same input
DECLINED_AFTER = 30.0  # design: an order that none of the people at open pages takes [s]
ARRIVED_WITHIN_M = 3.0  # design: distance from an event that counts as arrived [m]


class PersonAgent:
    """A seat of a console, occupied or not.

    Args:
        device: Device of the seat on the network.
        console: Equipment.
        tilt: Function that returns the source of commands for the next drive; by default the
            desired command is given as tilt.

    Attributes:
        console: Equipment; a new one counts from the next drive on.
        attended: True if the seat is occupied.
        order: The newest order of the DVA, until it is settled or declined.
        robots: Robots under control, by id.
        alert: Message for the person.
        on_robot: Callback for each robot taken, so that it is watched.
    """

    def __init__(
        self,
        device: AgentDevice,
        console: Console,
        tilt: Callable[[], GivenTilt | TiltSources] | None = None,
    ) -> None:
        self.device = device
        self.console = console
        self.steer_by(tilt)
        self.attended = False
        self.order: m.Order | None = None
        self.robots: dict[str, HeldRobot] = {}
        self.alert = ""
        self.on_robot: Callable[[HeldRobot], object] = lambda _: None
        self._arrived = False
        device.serve(self._on_request)

    @property
    def activity(self) -> str:
        """Activity of the person, in words."""
        driven = [held.label for held in self.robots.values() if held.is_driven]
        if driven:
            return f"drives {' and '.join(driven)}"
        if self.robots:
            return f"holds {' and '.join(held.label for held in self.robots.values())}"
        return "waiting" if self.attended else "nobody there"

    def steer_by(self, tilt: Callable[[], GivenTilt | TiltSources] | None) -> None:
        """Set the source of the next drives' commands; None: input is converted to tilt."""
        self._tilt = tilt or (lambda: GivenTilt(self.console.phone))

    def man(self, is_manned: bool) -> None:
        """Take part while a person is present; otherwise the DVA counts the seat as silent."""
        if is_manned and self.device.withdrawn:
            self.device.resume()
        elif not is_manned and not self.device.withdrawn:
            self.device.withdrawn = True
            if self.order is not None:
                self._put_down("failed" if self._arrived else "declined")

    # --- actions of the person ----------------------------------------------------------

    def sit_down(self) -> None:
        """Let a person take the seat."""
        self.attended = True
        self.alert = ""

    def take(
        self, robots: Sequence[str], on_result: OnResult, level: str = "teleoperation"
    ) -> None:
        """Request robots at one level of permission; keep all of them or none."""
        free = [robot for robot in robots if robot not in self.robots]
        if len(self.robots) + len(free) > MAX_ROBOTS:
            on_result(False, f"one person drives {MAX_ROBOTS} robots at most")
            return
        if not free:
            on_result(True, "they are yours already")
            return
        answers = Gathered(len(free), on_result)
        taken = []
        for robot in free:
            held = HeldRobot(
                self.device,
                robot,
                lambda: self.console,
                lambda: self._tilt(),
                self._alert,
                let_go=self._let_go,
                wanted=self.robots.__contains__,
            )
            held.on_frame = self._on_frame
            self.robots[robot] = held
            self.device.connect(robot)
            taken.append(held)
            self.on_robot(held)

        def give_all_back() -> None:
            for held in taken:
                held.give_back()

        answers.failed = give_all_back
        for held in taken:
            self._note_event(held)
            held.ask(answers, level)

    def release(self, on_result: OnResult) -> None:
        """Stop all robots, return their permissions, and leave the seat."""
        for held in list(self.robots.values()):
            held.give_back()
        if self.order is not None:
            self._put_down("failed" if self._arrived else "declined")
        self.attended = False
        on_result(True, "released")

    def start(self, on_result: OnResult) -> None:
        """Start driving all controlled robots."""
        self._each(lambda held, each: held.start(each), on_result)

    def stop(self, on_result: OnResult, why: str = "") -> None:
        """Stop all controlled robots."""
        if why and any(held.is_driven for held in self.robots.values()):
            self._alert(why)
        self._each(lambda held, each: held.stop("stopped", each), on_result)

    def emergency(self, robots: Sequence[str], on_result: OnResult) -> None:
        """Stop robots at once, regardless of their drivers."""
        answers = Gathered(len(robots), on_result)
        for robot in robots:
            held = self.robots.get(robot)
            if held is None:
                ask_emergency(self.device, robot, 0, answers)
            else:
                held.emergency(answers)

    def ended_by_others(self, robots: Sequence[str]) -> None:
        """Note an emergency stop of these robots by another person at this console."""
        for robot in robots:
            held = self.robots.get(robot)
            if held is not None and held.is_driven:
                held.end("emergency")
                self._alert(f"{held.label}: somebody has pressed the emergency stop")

    def want(self, number: int, speed: float, turn: float) -> None:
        """Set the person's command to all robots: shares of their limits, positive to the left."""
        for held in self.robots.values():
            held.want(number, speed, turn)

    def report(self, finding: str, on_result: OnResult) -> None:
        """Report the finding of the present order: `confirmed` or `refuted`."""
        order = self.order
        if order is None:
            on_result(False, "You have no order.")
            return

        def answered(reply: m.Reply) -> None:
            if reply.code != m.OK:
                on_result(False, reply.text)
                return
            held = self.robots.get(order.device or "")
            if held is not None and held.log is not None and held.log.event == order.event_id:
                held.log.outcome = finding
            self.device.tell(f"{finding} event {order.event_id}", "event")
            if self.order is order:
                self._put_down("done")
            on_result(True, f"event {order.event_id} is {finding}")

        unreachable = lambda: on_result(False, "the DVA does not answer")  # noqa: E731
        body = m.EventReport(order.event_id, order.kind, order.position, 0.5, 0.95, finding)
        self.device.ask(self.device.dva, body, answered, unreachable)

    def decline(self, on_result: OnResult) -> None:
        """Give the order back."""
        if self.order is None:
            on_result(False, "You have no order.")
            return
        number = self.order.event_id
        self._put_down("declined")
        on_result(True, f"event {number} is declined")

    def _each(self, act: Callable[[HeldRobot, OnResult], object], on_result: OnResult) -> None:
        if not self.robots:
            on_result(False, "no robot is in hand")
            return
        answers = Gathered(len(self.robots), on_result)
        for held in list(self.robots.values()):
            act(held, answers)

    # --- messages of the DVA ------------------------------------------------------------

    def _on_request(self, message: m.Message) -> m.Reply:
        if message.source != self.device.dva:
            return m.Reply(message.message_id, m.NOT_PERMITTED, "only the DVA gives orders")
        match message.body:
            case m.PermissionRevocation(device=robot, session=session):
                if robot in self.robots:
                    self.robots[robot].revoked(session)
            case m.Order() if self.device.withdrawn:
                return m.Reply(message.message_id, m.BUSY, "nobody is at this seat")
            case m.Order(device=str(), task="confirm") as order:
                self._on_order(order)
            case m.OrderProgress(event_id=event, state="done"):
                if self.order is not None and self.order.event_id == event:
                    self._end_order(f"event {event} is settled, or another's", RECALLED)
            case m.HandoverRequest(device=robot, label=asker):
                held = self.robots.get(robot)
                if held is not None and held.is_driven:
                    self._alert(f"{asker} asks for {held.label}")
                    return m.Reply(message.message_id, m.BUSY, "at work with it")
            case _:
                return m.Reply(message.message_id, m.NOT_SUPPORTED, "a person drives robots")
        return m.Reply(message.message_id, m.OK, "")

    def _on_order(self, order: m.Order) -> None:
        if order == self.order:
            return  # a repeated order
        self.order = order
        self._arrived = False
        robot = self.device.label_of(order.device or "")
        self.device.tell(f"shall drive {robot} to event {order.event_id}", "order")
        for held in self.robots.values():
            self._note_event(held)
        self.device.clock.call_after(DECLINED_AFTER, self._decline_alone, order)

    def _note_event(self, held: HeldRobot) -> None:
        order = self.order
        held.event = order.event_id if order is not None and order.device == held.robot else 0
        if held.event and held.phase == "driving":
            self.device.progress(held.event, "departed")

    def _decline_alone(self, order: m.Order) -> None:
        """Decline the order, since the seat is empty."""
        if self.order is order and not self.attended:
            self.device.tell(f"declines event {order.event_id}: nobody sits here", "order")
            self._put_down("declined")

    def _put_down(self, state: str) -> None:
        assert self.order is not None
        self.device.progress(self.order.event_id, state)
        self._end_order(f"event {self.order.event_id} is {state}", "gave up")

    def _end_order(self, why: str, outcome: str) -> None:
        """End an order, and with it the right to drive its robot."""
        assert self.order is not None
        held = self.robots.get(self.order.device or "")
        self.order = None
        if held is not None:
            held.taken_back(outcome)
            why += f"; to drive {held.label} on, take control again"
        self._alert(why)

    def _on_frame(self, held: HeldRobot, frame: CameraFrame) -> None:
        """Note the arrival where the robot was sent, as the app does."""
        order = self.order
        seen = frame.observation
        if order is None or self._arrived or not (held.event and held.phase == "driving"):
            return
        goal = self.device.frame.to_xy(order.position.latitude, order.position.longitude)
        if math.dist((seen.x, seen.y), goal) < ARRIVED_WITHIN_M:
            self._arrived = True
            self.device.progress(order.event_id, "arrived")

    def _alert(self, what: str) -> None:
        self.alert = what
        if what:
            self.device.tell(what, "link")

    def _let_go(self, held: HeldRobot) -> None:
        if self.robots.get(held.robot) is held:
            del self.robots[held.robot]
