"""Robots that people send to an event by themselves: an order of the DVA each, to a control room.

The control room is the operator of the order: it has the robot begin, tells the DVA how far it is,
and ends the order with a finding. A person who watches says what is there; where nobody does, what
the robot has had in view counts once it has looked for long enough, but never as an all-clear.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import do_nothing
from dva_sim.agents.observation import IN_VIEW
from dva_sim.agents.operator.steps import give_back, start
from dva_sim.console.asking.refusal import OnResult, Refused, unanswered
from dva_sim.protocol import messages as m

ASK_PERIOD: Final = 3.0  # from one question how a mission stands to the next [s]
MAX_UNANSWERED: Final = 10  # of such questions in a row; then it is given back
UNDER_WAY: Final = ("under_way", "waiting", "replanning")
BY_A_PERSON: Final = 0.95  # confidence in a finding; of operators, too
BY_ITS_CAMERA: Final = 0.6  # in what a robot's sensor alone reports; assumed
NOTHING: Final = f"nothing {IN_VIEW}"


class RobotMission:
    """Robot on its way to an event, and its order.

    Args:
        agent: Control room that sends it.
        robot: Id of the robot.
        status: The event, as it was known.
        on_over: Callback once the order has ended.

    Attributes:
        agent: The control room.
        robot: Id of the robot.
        status: The event.
    """

    def __init__(
        self,
        agent: ControlRoomAgent,
        robot: str,
        status: m.EventStatus,
        on_over: Callable[[], object],
    ) -> None:
        self.agent = agent
        self._device = agent.device
        self.robot = robot
        self._label = agent.device.label_of(robot)
        self.status = status
        self._on_over = on_over
        self._session = 0
        self._is_there = False
        self._is_over = False

    def begin(self, reason: str | None, decisions: int | None, on_result: OnResult) -> None:
        """Have the DVA assign the robot to this control room, and the robot begin.

        Args:
            reason: Reason in words.
            decisions: Number of decisions on the event that the person knew of.
            on_result: Callback for the result.
        """

        def assigned(reply: m.Reply) -> None:
            if reply.code == m.OK:
                self._get_permission(on_result)
            else:
                self._put_away()
                on_result(False, reply.reason)

        def unheard() -> None:
            self._put_away()
            unanswered(on_result)

        self._device.connect(self.robot)
        room = self._device.id_tag
        body = m.Assign(self.status.event_id, self.robot, room, None, reason, decisions)
        self.agent.ask(body, assigned, unheard)

    def _get_permission(self, on_result: OnResult) -> None:
        def granted(reply: m.Reply) -> None:
            if isinstance(reply.content, m.Permission):
                self._session = reply.content.session
                self._start(on_result)
            else:
                refused(reply.reason)

        def refused(text: str) -> None:
            self._end("failed")
            on_result(False, f"{self._label}: {text}")

        def unheard() -> None:
            self._end("failed")
            unanswered(on_result)

        wish = m.PermissionRequest(self.robot, "missions")
        self._device.ask(self._device.dva, wish, granted, unheard)

    def _start(self, on_result: OnResult) -> None:
        status = self.status

        def begun() -> None:
            self._device.progress(status.event_id, "departed")
            self._device.clock.call_after(ASK_PERIOD, self._ask, 0)
            on_result(True, f"{self._label} goes to event {status.event_id} by itself")

        def refused(text: str) -> None:
            self._end("failed")
            on_result(False, f"{self._label}: {text}")

        def lost() -> None:
            self._end("failed")
            unanswered(on_result, f"{self._label}: it does not answer")

        start(
            *(self._device, self.robot),
            m.Inspect(status.event_id, status.kind, status.position),
            lambda: self._session,
            wanted=lambda: not self._is_over,
            begun=begun,
            refused=refused,
            lost=lost,
        )

    @property
    def event(self) -> int:
        """Number of the event."""
        return self.status.event_id

    # --- on its way -------------------------------------------------------------------------

    def _ask(self, silences: int) -> None:
        """Ask how the mission stands, until it is over."""

        def lost() -> None:
            if self._is_over:
                return
            if silences < MAX_UNANSWERED:
                self._device.clock.call_after(ASK_PERIOD, self._ask, silences + 1)
                return
            text = f"{self._label} does not answer: how its mission stands is unknown"
            self._device.tell(text, "link")
            self._end("failed")

        if self._is_over:
            return
        order = self.agent.orders.get(self.status.event_id)
        if order is None or order.device != self.robot:
            self._end("")  # the DVA has taken the order back
            return
        body = m.GetMissionStatus()
        self._device.ask(self.robot, body, self._go_on, lost, self._session)

    def _go_on(self, reply: m.Reply) -> None:
        status = reply.content
        if self._is_over:
            return
        if not isinstance(status, m.MissionStatus):
            self._end("failed")
            return
        is_looking = status.reason.endswith(IN_VIEW)
        if is_looking and not self._is_there:
            self._is_there = True
            self._device.progress(self.status.event_id, "arrived")
        if status.mission_state in UNDER_WAY:
            self._device.clock.call_after(ASK_PERIOD, self._ask, 0)
            return
        text = status.mission_state.replace("_", " ")
        self._device.tell(f"the mission of {self._label} is {text}: {status.reason}", "order")
        if is_looking and status.reason != NOTHING:
            self._report("confirmed", BY_ITS_CAMERA)
            self._end("done")
        else:
            self._end("failed")

    # --- its end ----------------------------------------------------------------------------

    def found(self, finding: str, on_result: OnResult) -> None:
        """Report what a person sees through the robot, and end the order.

        Args:
            finding: `confirmed` or `refuted`.
            on_result: Callback for the result.
        """
        number = self.status.event_id

        def answered(reply: m.Reply) -> None:
            if reply.code != m.OK:
                on_result(False, reply.reason)
                return
            self._device.tell(f"{finding} event {number}", "event")
            self._end("done")
            on_result(True, f"event {number} is {finding}")

        self._report(finding, BY_A_PERSON, answered, partial(unanswered, on_result))

    def _report(
        self,
        finding: str,
        confidence: float,
        answered: Callable[[m.Reply], object] = do_nothing,
        unheard: Callable[[], object] = do_nothing,
    ) -> None:
        about = self.status
        severity = about.severity
        body = m.EventReport(
            about.event_id, about.kind, about.position, severity, confidence, finding
        )
        self._device.report_finding(body, answered, unheard)

    def _end(self, state: str) -> None:
        """End the order, and give the robot back; without a state the DVA has ended it."""
        if self._is_over:
            return
        self._put_away()
        if self._session:
            self._device.ask(self.robot, m.CancelMission(), session=self._session)
        if state:
            self.agent.orders.pop(self.status.event_id, None)
            self._device.progress(self.status.event_id, state)
        if self._session:
            give_back(self._device, self.robot, self._session)

    def _put_away(self) -> None:
        self._is_over = True
        self._on_over()


class SentRobots:
    """Robots that the people of a console have sent to events, by page."""

    def __init__(self) -> None:
        self._missions: dict[tuple[str, int], RobotMission] = {}

    def send(
        self, client: str, agent: ControlRoomAgent, robot: str, status: m.EventStatus
    ) -> RobotMission:
        """Return the mission of a robot, which is known here until it is over.

        Args:
            client: Page that sends it.
            agent: Control room of the page's person.
            robot: Id of the robot.
            status: The event, as it is known.
        """

        def forget() -> None:
            for key in [key for key, sent in self._missions.items() if sent is mission]:
                del self._missions[key]

        mission = RobotMission(agent, robot, status, forget)
        self._missions[client, status.event_id] = mission
        return mission

    def mission(self, client: str, event: int) -> RobotMission:
        """Return the mission that a page has sent a robot on.

        Raises:
            Refused: it has sent none there.
        """
        mission = self._missions.get((client, event))
        if mission is None:
            raise Refused(f"you have sent no robot to event {event}")
        return mission

    def of_client(self, client: str) -> list[RobotMission]:
        """Return the missions that a page has sent robots on."""
        return [mission for (of, _), mission in self._missions.items() if of == client]

    def hand_to(
        self, client: str, agent: ControlRoomAgent, mission: RobotMission, on_result: OnResult
    ) -> None:
        """Let another page's person answer for a mission.

        A control room of their own gets an order of its own; people who share one keep the order.

        Args:
            client: Page of the person.
            agent: Control room of the person.
            mission: Mission of somebody else.
            on_result: Callback for the result.
        """
        if mission.agent is agent:
            self._missions = {key: one for key, one in self._missions.items() if one is not mission}
            self._missions[client, mission.event] = mission
            on_result(True, f"event {mission.event} is yours")
            return
        status = agent.events.get(mission.event, mission.status)
        handed = self.send(client, agent, mission.robot, status)
        handed.begin("handed over", status.decisions, on_result)
