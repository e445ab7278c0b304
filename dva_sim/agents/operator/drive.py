"""One drive of one robot: frames in, perception, intent, tilt out, until the event is seen."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from dva_sim.agents.camera import Frame, Observation
from dva_sim.agents.commands import CommandSender, PublishedCommands, RequestedCommands
from dva_sim.agents.device import Device
from dva_sim.agents.operator.delay import DelayEstimate
from dva_sim.agents.operator.person import Person
from dva_sim.agents.operator.strategies import Intent, Oracle, Pursuit, Truth
from dva_sim.agents.steering import Route
from dva_sim.agents.tilt import Phone
from dva_sim.network.patterns import Requester, Subscription
from dva_sim.protocol import messages as m
from dva_sim.recorder import DriveLog
from dva_sim.worlds.planning import Planner

FIRST_GUESS = 0.6  # delay a person expects before having seen any [s]
BLIND_AFTER = 20.0  # without a frame for so long, the link counts as lost [s]
STILL = 0.02  # a robot that moves less stands [m/s, rad/s]
ASKED_SPEED, ASKED_TURN = 0.05, 0.1  # from here on one expects to see it move [m/s, rad/s]
STUCK_AFTER = 4.0  # standing for so long though asked to drive, a person plans anew [s]
LET_GO_FOR = 1.0  # one who sees no effect levels the phone for so long, and tilts again [s]
GIVE_UP_AFTER = 4  # after so many attempts in a row without any motion, the link is lost
SEARCH_FOR = 25.0  # looking around at the place for so long, a person says there is nothing [s]
KEEP_OFF = 1.2  # distance kept to the event [m]
AT_PLACE = 1.5  # nearer than this one is at the place [m]
MATCH_WITHIN = 4.0  # a hazard so near the reported place is the one reported [m]


@dataclass(frozen=True)
class OperatorSetup:
    """How an operator works, beside who it is.

    Attributes:
        window: Of the requests that carry SetTeleOp: how many may be unanswered at once; None
            if SetTeleOp is published instead.
        rate_hz: Wanted commands per second.
        timeout: Of a request [s].
        attempts: Of a request.
        truth: The true state of a robot by id, if the strategy is the oracle; else None.
    """

    window: int | None
    rate_hz: float
    timeout: float
    attempts: int
    truth: Callable[[str], Truth] | None = None


class DriverSeat:
    """Everything a person brings to a drive, and keeps from one to the next.

    Args:
        device: Identity and ways to talk.
        person: Who it is.
        phone: The phone in the hand.
        strategy: How the person drives.
        planner: The person knows the building.
        setup: Pattern, rate, time-outs.
        rng: Luck of this person's judgement.

    Attributes:
        delay: What the person has learnt of the delay.
    """

    def __init__(
        self,
        device: Device,
        person: Person,
        phone: Phone,
        strategy: Pursuit | Oracle,
        planner: Planner,
        setup: OperatorSetup,
        rng: np.random.Generator,
    ) -> None:
        self.device, self.person, self.phone, self.strategy = device, person, phone, strategy
        self.planner, self.setup = planner, setup
        self.delay = DelayEstimate(0.0, FIRST_GUESS)
        self._errors = _normals(rng)

    def judge(self, seen: Observation) -> Observation:
        """A frame as the person takes it: place and heading with an error."""
        person, error = self.person, self._errors
        return Observation(
            seen.tick,
            seen.x + person.position_error * next(error),
            seen.y + person.position_error * next(error),
            seen.heading + person.heading_error * next(error),
            seen.speed,
            seen.turn_rate,
            seen.hazards,
        )


class Drive:
    """One drive.

    Args:
        seat: Who drives, with what.
        order: Where to, and why.
        log: What is measured of it.
        on_end: Told once how it ended: the drive, the outcome, and why.
    """

    def __init__(
        self,
        seat: DriverSeat,
        order: m.Order,
        log: DriveLog,
        on_end: Callable[[Drive, str, str], object],
    ) -> None:
        self._seat, self._device, self._clock = seat, seat.device, seat.device.clock
        self.order, self.log, self.robot, self._on_end = order, log, log.robot, on_end
        self.session = 0
        self.picture: Subscription | None = None
        self.over = False
        place = order.position
        self._goal = seat.device.frame.to_xy(place.latitude, place.longitude)
        self._sender: CommandSender | None = None
        self._route: Route | None = None
        self._intent = Intent(0.0, 0.0)
        self._seen_tick: int | None = None
        self._last_frame = self._clock.now
        self._in_view_since: float | None = None
        self._standing_since: float | None = None
        self._at_place_since: float | None = None
        self._arrived = False
        self._let_go_until = 0.0
        self._without_effect = 0

    def begin(self) -> None:
        """The robot has agreed to be driven: look, and tilt."""
        seat, now = self._seat, self._clock.now
        self.log.started = self._last_frame = now
        self._device.recorder.drive_begins(self._device.id_tag)
        seat.delay = DelayEstimate(now, seat.delay.value)
        self._sender = self._make_sender()
        self._sender.start()
        self._clock.every(1.0, self._watch_picture)
        if isinstance(seat.strategy, Oracle):
            self._clock.every(Oracle.DELAY, self._look_at_truth)

    def on_frame(self, shown: Frame | bytes) -> None:
        """A frame is on the screen; the person perceives it a little later."""
        frame = shown if isinstance(shown, Frame) else Frame.unpack(shown)
        if frame is None:
            self._device.recorder.counters["refused: no picture"] += 1
            return
        now = self._clock.now
        self._last_frame, self._seen_tick = now, frame.observation.tick
        self.log.frame_times.append((frame.captured, now))
        if self._sender is not None and isinstance(self._seat.strategy, Pursuit):
            delay = self._seat.person.perceptual_delay
            self._clock.call_after(delay, self._perceive, frame.observation)

    def link_lost(self) -> None:
        """Three sends without an answer, or no picture: the app alerts."""
        self.end("lost link", "no answer and no picture")

    def end(self, outcome: str, why: str = "") -> None:
        """Put the phone down; said once."""
        if self.over:
            return
        self.over = True
        self.log.ended, self.log.outcome = self._clock.now, outcome
        if self._sender is not None:
            self._sender.stop()
        if self.picture is not None:
            self.picture.close()
        self._on_end(self, outcome, why)

    def _make_sender(self) -> CommandSender:
        """The pattern decides how commands travel, and nothing else."""
        seat, device, setup = self._seat, self._device, self._seat.setup
        kind = PublishedCommands if setup.window is None else RequestedCommands
        sender = kind(
            device.network,
            device.outbox,
            self.log,
            self.session,
            seat.phone,
            setup.rate_hz,
            device.recorder,
            lambda: self._seen_tick,
        )
        if isinstance(sender, RequestedCommands):
            assert setup.window is not None
            requester = Requester(
                device.network,
                device.id_tag,
                self.robot,
                setup.timeout,
                setup.attempts,
                setup.window,
            )
            sender.connect(requester, self.link_lost)
        return sender

    # --- seeing ------------------------------------------------------------------------

    def _perceive(self, observation: Observation) -> None:
        """A frame has reached the person's mind."""
        seat, now = self._seat, self._clock.now
        if self.over or not isinstance(seat.strategy, Pursuit):
            return
        seat.delay.see(now, observation.speed, observation.turn_rate)
        judged = seat.judge(observation)
        self._device.recorder.view(now, self.robot, judged.x, judged.y, judged.heading)
        route = self._consider(judged)
        if route is not None:
            # The guess is made when a frame is perceived, so it holds the perceptual delay.
            self._intend(
                seat.strategy.drive(route, judged, seat.delay.value, self._keep_off(judged))
            )

    def _look_at_truth(self) -> bool:
        """The oracle's own loop; False ends it."""
        seat = self._seat
        if self.over or seat.setup.truth is None or not isinstance(seat.strategy, Oracle):
            return False
        truth = seat.setup.truth(self.robot)
        self._seen_tick = truth.state.tick
        route = self._consider(truth.state)
        if route is not None:
            self._intend(seat.strategy.drive_by_truth(route, truth, self._keep_off(truth.state)))
        return not self.over

    def _consider(self, seen: Observation) -> Route | None:
        """Is the event in view, is the place empty, is there a way? The way, if still needed."""
        self._look_for_event(seen)
        if not self.over:
            self._search(seen)
        return None if self.over else self._way(seen)

    def _look_for_event(self, seen: Observation) -> None:
        """An event that has been in view for long enough is confirmed."""
        now = self._clock.now
        if not any(self._is_the_event(h.kind, h.x, h.y) for h in seen.hazards):
            self._in_view_since = None
            return
        if self._in_view_since is None:
            self._in_view_since = now
            self._arrive()
        elif now - self._in_view_since >= self._seat.person.confirm_look:
            self.end("confirmed")

    def _is_the_event(self, kind: str, x: float, y: float) -> bool:
        return kind == self.order.kind and math.dist((x, y), self._goal) < MATCH_WITHIN

    def _search(self, seen: Observation) -> None:
        """At the place with nothing in view: look around for a while, then say so."""
        now = self._clock.now
        if not self._has_place_before_it(seen, AT_PLACE):
            self._at_place_since = None
        elif self._at_place_since is None:
            self._at_place_since = now
            self._arrive()
        elif self._in_view_since is None and now - self._at_place_since > SEARCH_FOR:
            self.end("refuted", "nothing there")

    def _has_place_before_it(self, seen: Observation, within: float) -> bool:
        """Whether the place is near [m], and by the map no wall stands between."""
        here = seen.x, seen.y
        near = math.dist(here, self._goal) < within
        return near and self._seat.planner.line_of_sight(here, self._goal)

    def _keep_off(self, seen: Observation) -> float:
        """How far before the event to stop [m]; no wall may stand between."""
        return KEEP_OFF if self._has_place_before_it(seen, 2 * KEEP_OFF) else 0.0

    def _arrive(self) -> None:
        if not self._arrived:
            self._arrived = True
            self._device.progress(self.order.event_id, "arrived")

    def _watch_picture(self) -> bool:
        """No picture for too long: the link is lost, whatever the pattern."""
        if not self.over and self._clock.now - self._last_frame > BLIND_AFTER:
            self.link_lost()
        return not self.over

    # --- steering ----------------------------------------------------------------------

    def _way(self, seen: Observation) -> Route | None:
        """The way to the goal; planned anew when the robot does not get on."""
        if self._is_stuck(seen):
            self._route, self._standing_since = None, None
            self._let_go_until = self._clock.now + LET_GO_FOR
            self._device.recorder.counters["replans"] += 1
            self._without_effect += 1
            if self._without_effect >= GIVE_UP_AFTER:
                self.end("lost link", "the robot does not move")
                return None
        if self._route is None:
            points = self._seat.planner.path((seen.x, seen.y), self._goal)
            if points is None:
                self.end("gave up", "no way there")
                return None
            self._route = Route(points)
        return self._route

    def _is_stuck(self, seen: Observation) -> bool:
        """Whether the robot has stood for too long although it was asked to move."""
        now, intent = self._clock.now, self._intent
        moves = abs(seen.speed) >= STILL or abs(seen.turn_rate) >= STILL
        if moves:
            self._without_effect = 0
        if moves or (intent.speed <= ASKED_SPEED and abs(intent.turn_rate) <= ASKED_TURN):
            self._standing_since = None
            return False
        if self._standing_since is None:
            self._standing_since = now
        return now - self._standing_since > STUCK_AFTER + 2.0 * self._seat.delay.value

    def _intend(self, intent: Intent) -> None:
        now = self._clock.now
        if now < self._let_go_until:
            intent = Intent(0.0, 0.0)
        self._intent = intent
        self._seat.phone.ask(now, intent.speed, intent.turn_rate)
        self._seat.delay.intend(now, intent.speed, intent.turn_rate)


def _normals(rng: np.random.Generator, block: int = 512) -> Iterator[float]:
    """Standard normal numbers without end, drawn in blocks."""
    while True:
        yield from rng.normal(size=block).tolist()
