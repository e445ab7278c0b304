"""Supervision of one order with one robot, from the permission to the outcome.

Supervisory control: the operator gives the goal, the robot acts, the operator judges.

References:
    T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from dva_sim.agents.observation import IN_VIEW, CameraFrame, Observation
from dva_sim.agents.operator.attention import DriverSeat
from dva_sim.agents.operator.inspection import Looking
from dva_sim.kernel.recorder import DriveLog, make_shown
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m

REFUSED = "refused"  # how a drive ends when the robot obeys no more


class Work:
    """One order to look at an event through a robot, in whatever way it is controlled.

    Args:
        seat: Person and equipment.
        order: Order with destination and reason.
        log: Log of the drive.
        on_end: Callback at the end, once: the work, the outcome, and the reason.

    Attributes:
        at_once: Number of works of this kind that one person does at once; None: no limit of its
            own.
        level: Level of the permission that it needs.
        verb: Verb for the person's action on the robot.
        wish: Request to the person, in words.
        session: Session of the permission; 0 before there is one.
        granted: True once a permission was granted.
        picture: The robot's camera, once it is watched.
        over: True once it has ended.
        waits_since: Time since which the robot has waited for a judgement [s]; None: it does not
            wait.
    """

    at_once: ClassVar[int | None] = None
    level: ClassVar[str]
    verb: ClassVar[str]
    wish: ClassVar[str]

    def __init__(
        self,
        seat: DriverSeat,
        order: m.Order,
        log: DriveLog,
        on_end: Callable[[Work, str, str], object],
    ) -> None:
        self._seat = seat
        self._device = seat.device
        self._clock = seat.device.clock
        self.order = order
        self.log = log
        self.robot = log.robot
        self._on_end = on_end
        self.session = 0
        self.granted = False
        self.picture: Subscription | None = None
        self.over = False
        self.waits_since: float | None = None
        place = order.position
        self._goal = seat.device.frame.to_xy(place.latitude, place.longitude)
        self._last_frame = self._clock.now
        self._looking = Looking(
            order.kind,
            self._goal,
            planner=seat.planner,
            person=seat.person,
            normals=seat.noise(order.event_id),
            arrived=self._arrive,
        )

    def beginning(self) -> m.Body:
        """Return the request that begins it."""
        raise NotImplementedError

    def ending(self) -> m.Body:
        """Return the request that ends it."""
        raise NotImplementedError

    def begin(self) -> None:
        """Begin to look: the robot has agreed."""
        self.log.started = self._last_frame = self._clock.now
        self._clock.every(1.0, self._watch_picture)
        self._seat.attention.begin(self)

    def look_away(self) -> None:
        """Turn to another screen."""
        self._looking.look_away()

    def on_frame(self, payload: CameraFrame | bytes) -> None:
        """Take a frame on the screen."""
        frame = payload if isinstance(payload, CameraFrame) else CameraFrame.unpack(payload)
        if frame is None:
            self._device.recorder.counters["refused: no picture"] += 1
            return
        now = self._clock.now
        self._last_frame = now
        self.log.frames.append(make_shown(frame.captured, now, frame.observation.tick))
        self._see(frame.observation)

    def link_lost(self, why: str = "no answer and no picture") -> None:
        """Take the app's alert: three sends without an answer, or no picture."""
        self.end("lost link", why)

    def end(self, outcome: str, why: str = "") -> None:
        """Put everything down; said once."""
        if self.over:
            return
        self.over = True
        self.log.ended = self._clock.now
        self.log.outcome = outcome
        self._put_down()
        self._seat.attention.end(self)
        if self.picture is not None:
            self.picture.close()
        self._on_end(self, outcome, why)

    def _see(self, observation: Observation) -> None:
        """Look at a frame."""
        raise NotImplementedError

    def _put_down(self) -> None:
        """Put down whatever is in the hand."""

    def _arrive(self) -> None:
        self._device.progress(self.order.event_id, "arrived")

    def _watch_picture(self) -> bool:
        """Lose the link after too long without a picture; return True while there is work."""
        patience = self._seat.person.habits.looking.wait_for_picture_s
        passed = self._clock.now - self._last_frame
        if not self.over and passed > max(patience, self._device.timeout):
            self.link_lost()
        return not self.over


class Supervision(Work):
    """One inspection that a robot makes by itself, watched through its camera.

    The same pictures, perceived as late and judged with the same errors, decide as in
    `Teleoperation`: only who steers differs.
    """

    level = "missions"
    verb = "watches"
    wish = "send"

    def beginning(self) -> m.Body:
        """Return the request that begins it."""
        return m.Inspect(self.order.event_id, self.order.kind, self.order.position)

    def ending(self) -> m.Body:
        """Return the request that ends it."""
        return m.CancelMission()

    def begin(self) -> None:
        """Watch the picture of a robot on its way, and ask now and then how it stands."""
        super().begin()
        self._ask_later()

    def _see(self, observation: Observation) -> None:
        """Take a frame on the screen; who looks at it perceives it a little later."""
        if self._seat.attention.looks_at(self):
            delay = self._seat.person.perceptual_delay
            self._clock.call_after(delay, self._perceive, observation)

    def _perceive(self, observation: Observation) -> None:
        if self.over:
            return
        now = self._clock.now
        judged = self._seat.judge(observation)
        self._device.recorder.view(now, self.robot, judged.x, judged.y, judged.heading)
        conclusion = self._looking.look(now, judged)
        if conclusion is not None:
            self.end(*conclusion)

    def _ask(self) -> None:
        """Ask how the mission stands; again when this was answered."""
        if self.over:
            return

        def answered(reply: m.Reply) -> None:
            status = reply.content
            if self.over or not isinstance(status, m.MissionStatus):
                return
            if status.mission_state in ("done", "failed"):
                self.end("gave up", f"the robot: {status.reason or status.mission_state}")
                return
            if self.waits_since is None and status.reason.endswith(IN_VIEW):
                self.waits_since = self.log.waits_from = self._clock.now
            self._ask_later()

        body = m.GetMissionStatus()
        self._device.ask(self.robot, body, answered, self.link_lost, self.session)

    def _ask_later(self) -> None:
        self._clock.call_after(self._seat.person.habits.asking.mission_every_s, self._ask)
