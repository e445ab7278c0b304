"""What an operator does about one order with one robot, from the permission to the outcome."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from dva_sim.agents.camera import Frame, Observation
from dva_sim.agents.operator.looking import Looking
from dva_sim.agents.operator.seat import DriverSeat
from dva_sim.network.patterns import Subscription
from dva_sim.protocol import messages as m
from dva_sim.recorder import DriveLog, Shown

BLIND_AFTER = 20.0  # [s]; without a frame for so long the link counts as lost


class Work:
    """One order to look at an event through a robot, in whatever way it is controlled.

    Args:
        seat: Who works, with what.
        order: Where to, and why.
        log: What is measured of it.
        on_end: Told once how it ended: the work, the outcome, and why.

    Attributes:
        at_once: How many of its kind one person does at once; None: as many as it may.
        level: Of the permission that it needs.
        verb: What the person does with the robot, in words.
        wish: What the person shall do with it, in words.
        session: Of the permission; 0 before there is one.
        picture: The robot's camera, once it is watched.
        over: Whether it has ended.
        waits_since: From when on the robot has waited for a judgement [s]; None: it does not.
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
        self._seat, self._device, self._clock = seat, seat.device, seat.device.clock
        self.order, self.log, self.robot, self._on_end = order, log, log.robot, on_end
        self.session = 0
        self.picture: Subscription | None = None
        self.over = False
        self.waits_since: float | None = None
        place = order.position
        self._goal = seat.device.frame.to_xy(place.latitude, place.longitude)
        self._last_frame = self._clock.now
        self._looking = Looking(
            *(order.kind, self._goal, seat.planner, seat.person),
            *(seat.luck(order.event_id), self._arrive),
        )

    def beginning(self) -> m.Body:
        """What to ask the robot for."""
        raise NotImplementedError

    def ending(self) -> m.Body:
        """What to tell the robot when it is over."""
        raise NotImplementedError

    def begin(self) -> None:
        """The robot has agreed: from now on there is something to look at."""
        self.log.started = self._last_frame = self._clock.now
        self._clock.every(1.0, self._watch_picture)
        self._seat.attention.begin(self)

    def look_away(self) -> None:
        """The person looks at another screen."""
        self._looking.look_away()

    def on_frame(self, shown: Frame | bytes) -> None:
        """A frame is on the screen."""
        frame = shown if isinstance(shown, Frame) else Frame.unpack(shown)
        if frame is None:
            self._device.recorder.counters["refused: no picture"] += 1
            return
        now = self._clock.now
        self._last_frame = now
        self.log.frames.append(Shown(frame.captured, now, frame.observation.tick))
        self._see(frame.observation)

    def link_lost(self) -> None:
        """Three sends without an answer, or no picture: the app alerts."""
        self.end("lost link", "no answer and no picture")

    def end(self, outcome: str, why: str = "") -> None:
        """Put everything down; said once."""
        if self.over:
            return
        self.over = True
        self.log.ended, self.log.outcome = self._clock.now, outcome
        self._put_down()
        self._seat.attention.end(self)
        if self.picture is not None:
            self.picture.close()
        self._on_end(self, outcome, why)

    def _see(self, observation: Observation) -> None:
        """Look at a frame."""
        raise NotImplementedError

    def _put_down(self) -> None:
        """Whatever is in the hand."""

    def _arrive(self) -> None:
        self._device.progress(self.order.event_id, "arrived")

    def _watch_picture(self) -> bool:
        """No picture for too long: the link is lost, whatever the pattern."""
        if not self.over and self._clock.now - self._last_frame > max(
            BLIND_AFTER, self._device.timeout
        ):
            self.link_lost()
        return not self.over
