"""One drive of one robot by tilting the phone: frames in, perception, intent, tilt out.

It lasts until the event is seen, or nothing more can be done. A person whose robot is held back by
its collision guard drives in close quarters for a while: slowly, step by step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.attention import DriverSeat
from dva_sim.agents.operator.command_sender import CommandSender
from dva_sim.agents.operator.delay_estimation import DelayEstimate
from dva_sim.agents.operator.strategies import (
    SHORTEST,
    Intent,
    Oracle,
    Reach,
    Strategy,
    Truth,
    gain_at,
)
from dva_sim.agents.operator.supervision import REFUSED, Work
from dva_sim.agents.population import Person
from dva_sim.agents.route_following import Route, make_view
from dva_sim.agents.tilt import Phone
from dva_sim.kernel.recorder import DriveLog
from dva_sim.protocol import messages as m
from dva_sim.worlds.planning import Planner

Floats = NDArray[np.float64]
Point = tuple[float, float]

HEADINGS = 16  # design: number of directions searched for room


def roomiest(here: Point, planner: Planner, step: float) -> Point:
    """Return the place a step [m] away that is farthest from walls, and is reached straight [m]."""
    angles = np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS)
    ring = np.array(here) + step * np.stack([np.cos(angles), np.sin(angles)], 1)
    half = 0.5 * (ring + np.array(here))
    least = np.minimum(planner.room_at(half), planner.room_at(ring))
    x, y = ring[int(least.argmax())].tolist()
    return x, y


class CloseQuarters:
    """Notices that the robot is blocked, and then follows a new path closely for a moment.

    Args:
        person: Gain and caution.
        reach: Limits of the robot.
    """

    def __init__(self, person: Person, reach: Reach) -> None:
        self._person = person
        self._reach = reach
        self._habits = person.habits.close_quarters
        self._held = 0.0
        self._last_look = math.inf
        self._from: tuple[float, float] | None = None
        self._turning = self._again = False

    @property
    def on(self) -> bool:
        """True if the person drives carefully now."""
        return self._from is not None

    def notice(self, now: float, seen: Observation, intended_mps: float, delay: float) -> bool:
        """Perceive a frame.

        True if from now on the person drives carefully, on a new way.

        Args:
            now: [s]
            seen: The frame, as the person judges it.
            intended_mps: Commanded speed [m/s].
            delay: Whole delay as the person perceives it [s].
        """
        here = (seen.x, seen.y)
        habits = self._habits
        if self._from is not None and math.dist(here, self._from) > habits.clear_m:
            self._from = None
        if seen.speed >= habits.held_still_mps:
            self._held = 0.0
        elif intended_mps > habits.asked_mps:  # turning on the spot gives no evidence
            self._held += max(now - self._last_look, 0.0)
        self._last_look = now
        if self._held <= habits.understood_after_s + 2.0 * delay:
            return False
        self._again = self._from is not None
        self._held = 0.0
        self._from = here
        return True

    def way(self, here: Point, goal: Point, planner: Planner) -> Floats | None:
        """Return the new way `(n, 2)` [m].

        After being blocked again, the person first moves to a place with room.
        """
        via = roomiest(here, planner, self._habits.step_out_m) if self._again else here
        points = planner.path(via, goal)
        return points if points is None or not self._again else np.vstack([here, points])

    def drive(self, route: Route, seen: Observation, delay: float, stop_before: float) -> Intent:
        """See `Strategy`: turn on the spot towards a point close by on the way, then go there."""
        habits = self._habits
        look = self._habits.look_m
        most = self._reach.turn_rate
        ahead = route.ahead(seen.x, seen.y, seen.heading, look)
        gain = gain_at(self._person.crossover, self._person.margin, delay)
        turn = min(max(gain * ahead.bearing, -most), most)
        limit = habits.turns_until_rad if self._turning else habits.stops_from_rad
        self._turning = abs(ahead.bearing) > limit
        safe = self._person.caution * look / max(delay, SHORTEST)
        speed = max(min(habits.slowly * self._reach.speed, safe), habits.crawl_mps)
        stops = self._turning or ahead.remaining < stop_before
        return Intent(0.0 if stops else speed, turn)


ATTEMPTS = 3  # source: the document's app: after three sends without effect the link is lost


class Teleoperation(Work):
    """One drive by tilting the phone: direct control, or coordinated if the robot has a guard.

    Args:
        seat: Person and equipment.
        order: Order with destination and reason.
        log: Log of the drive.
        on_end: Callback at the end, once: the drive, the outcome, and the reason.
    """

    at_once = 1  # two hands, one phone
    level = "teleoperation"
    verb = "drives"
    wish = "drive"

    def __init__(
        self,
        seat: DriverSeat,
        order: m.Order,
        log: DriveLog,
        on_end: Callable[[Work, str, str], object],
    ) -> None:
        super().__init__(seat, order, log, on_end)
        self._sender: CommandSender | None = None
        self._route: Route | None = None
        self._lent: Route | None = None  # the strategy's own copy, to do with as it likes
        self._intent = Intent(0.0, 0.0)
        self._seen_tick: int | None = None
        reach = seat.reach(self.robot)
        self._strategy = seat.strategy(seat.person, reach)
        self._close_quarters = CloseQuarters(seat.person, reach) if seat.setup.guarded else None
        self._stuck = seat.person.habits.stuck
        self._asked_since: float | None = None  # start of commands to move without visible motion
        self._asked_for = self._stuck_look = 0.0
        self._stuck_after = self._stuck.plans_after_s + 2.0 * seat.delay.value
        self._let_go_until = 0.0
        self._without_effect = 0
        self._failures: dict[str, int] = {}
        self._plugged_in: list[tuple[Phone | CommandSender | Strategy, str, str]] = [
            (seat.phone, "a phone", "holds a phone that fails")
        ]
        if isinstance(self._strategy, Strategy):
            what = "lets go, as its strategy fails"
            self._plugged_in.append((self._strategy, "an operator", what))
        self._least_left = math.inf
        self._nearer_at = 0.0

    def begin(self) -> None:
        """Begin to look and to tilt: the robot has agreed to be driven."""
        seat = self._seat
        now = self._clock.now
        super().begin()
        self.log.hand_lag = seat.phone.hand_lag
        self._device.recorder.drive_begins(self._device.id_tag)
        seat.delay = DelayEstimate(now, seat.delay.value, habits=seat.person.habits.delay)
        self._sender = self._make_sender()
        self._plugged_in.insert(
            1, (self._sender, "a pattern", "loses commands, as its pattern fails")
        )
        self._sender.start()
        if isinstance(self._strategy, Oracle):
            self._clock.every(Oracle.DELAY, self._look_at_truth)
        else:
            self._let_go_until = now + seat.person.reaction

    def beginning(self) -> m.Body:
        """Return the request that begins the drive."""
        return m.StartTeleOp()

    def ending(self) -> m.Body:
        """Return the request that ends it."""
        return m.StopTeleOp()

    def _see(self, observation: Observation) -> None:
        """Take a frame on the screen; the person perceives it a little later."""
        self._seen_tick = observation.tick
        if self._sender is not None and isinstance(self._strategy, Strategy):
            delay = self._seat.person.perceptual_delay
            self._clock.call_after(delay, self._perceive, observation)

    def _put_down(self) -> None:
        if self._sender is None:
            return
        self._sender.stop()
        if isinstance(self._strategy, Strategy):
            self.log.workload = dict(self._strategy.workload())
        self._count_failures()

    def _make_sender(self) -> CommandSender:
        """Return the pattern's transport of commands."""
        setup = self._seat.setup
        return CommandSender(
            self._device,
            pattern=setup.pattern(self.robot),
            drive=self.log,
            session=self.session,
            phone=self._seat.phone,
            rate_hz=setup.rate_hz,
            timeout=setup.timeout,
            attempts=setup.attempts,
            window=setup.window,
            seen_tick=lambda: self._seen_tick,
            on_lost=self.link_lost,
            on_refused=partial(self.end, REFUSED),
            heeds=setup.heeds,
        )

    # --- seeing ------------------------------------------------------------------------

    def _perceive(self, observation: Observation) -> None:
        """Act on a frame that has reached the person's mind."""
        seat = self._seat
        now = self._clock.now
        if self.over or not isinstance(self._strategy, Strategy):
            return
        seat.delay.see(now, observation.speed, observation.turn_rate)
        judged = seat.judge(observation)
        self._device.recorder.view(now, self.robot, judged.x, judged.y, judged.heading)
        route = self._consider(judged)
        if route is not None:
            # The guess is made when a frame is perceived, so it holds the perceptual delay.
            drive = self._strategy.drive
            delay = seat.judged_delay(now)
            view = make_view(now, judged, delay)
            usual = lambda keep: drive(route, view, keep)  # noqa: E731
            self._intend(self._steer(judged, delay, usual), judged.tick)

    def _count_failures(self) -> None:
        """Count failures of a user's plug-in, and report the first one."""
        for plugged_in, whose, what in self._plugged_in:
            if plugged_in.failures != self._failures.get(whose, 0):
                counted = self._failures.get(whose, 0)
                failures = plugged_in.failures
                self._failures[whose] = failures
                if failures > counted:
                    count = self._device.recorder.counters
                    count[f"failed: an answer of {whose}"] += failures - counted
                    if not counted:
                        self._device.tell(f"{what}: {plugged_in.first_failure}", "drive")

    def _steer(self, seen: Observation, delay: float, usual: Callable[[float], Intent]) -> Intent:
        """Return the command to give; the guard's narrow mode is for those who know it holds them.

        Args:
            seen: Current observation.
            delay: Perceived whole delay [s].
            usual: The person's usual way of driving, given where to stop before the end of the
                route.
        """
        careful = self._close_quarters
        keep = self._keep_off(seen)
        if careful is None:
            return usual(keep)
        if careful.notice(self._clock.now, seen, self._intent.speed, delay):
            points = careful.way((seen.x, seen.y), self._goal, self._seat.planner)
            if points is not None:
                self._take(points)
        if not careful.on or self._route is None:
            return usual(keep)
        return careful.drive(self._route, seen, delay, keep)

    def _look_at_truth(self) -> bool:
        """Return the oracle's own loop; False ends it."""
        seat = self._seat
        if self.over or seat.setup.truth is None or not isinstance(self._strategy, Oracle):
            return False
        state = seat.setup.truth(self.robot).state
        applied = self.log.applied[-1:]
        truth = Truth(state, sum(command.time - command.captured for command in applied))
        self._seen_tick = state.tick
        route = self._consider(state)
        if route is not None:
            drive = self._strategy.drive
            usual = lambda keep: drive(route, truth, keep)  # noqa: E731
            self._intend(self._steer(state, truth.delay, usual), state.tick)
        return not self.over

    def _consider(self, seen: Observation) -> Route | None:
        """Return the strategy's way, if still needed: is the event in view, is the place empty?"""
        conclusion = self._looking.look(self._clock.now, seen)
        if conclusion is not None:
            self.end(*conclusion)
        return None if self.over else self._way(seen)

    def _keep_off(self, seen: Observation) -> float:
        """Return how far before the event to stop [m]; no wall may stand between."""
        keeps_off = self._seat.person.habits.looking.keeps_off_m
        if not self._looking.has_place_before_it(seen, 2 * keeps_off):
            return 0.0
        return self._stuck.in_smoke_m if self._looking.wants_nearer else keeps_off

    # --- steering ----------------------------------------------------------------------

    def _way(self, seen: Observation) -> Route | None:
        """Route to the goal for the strategy; planned again when the robot makes no progress."""
        if self._is_stuck(seen):
            self._route = self._lent = self._asked_since = None
            self._let_go_until = self._clock.now + self._stuck.lets_go_s
            self._device.recorder.counters["replans"] += 1
            self._without_effect += 1
            if self._without_effect >= ATTEMPTS:
                self.end("lost link", "the robot does not move")
                return None
        route = self._route
        if route is None:
            points = self._seat.planner.path((seen.x, seen.y), self._goal)
            if points is None:
                self.end("gave up", "no way there")
                return None
            route = self._take(points)
            self.log.ways.append((self._clock.now, points))
        if self._gets_nowhere(route.left):
            self.end("gave up", "the robot gets no nearer")
            return None
        route.advance(seen.x, seen.y)  # whether the strategy asks the way or not
        return self._lent

    def _take(self, points: NDArray[np.float64]) -> Route:
        """Follow this path `(n, 2)` [m] from now on."""
        self._route = route = Route(points)
        self._lent = route.twin()
        return route

    def _gets_nowhere(self, left: float) -> bool:
        """Return True if the remaining path [m] has long not become shorter."""
        now = self._clock.now
        if self._looking.at_place:
            return False
        nearer = self._stuck.nearer_m
        if left < self._least_left - nearer:
            self._least_left = left
            self._nearer_at = now
        return left > nearer and now - self._nearer_at > self._seat.person.patience

    def _is_stuck(self, seen: Observation) -> bool:
        """Return True if the robot has stood for too long despite commands to move.

        Who moves and waits asks for a while only: the time counts from the first asking, waits
        included. How long is too long is of the delay when motion was last seen, since a guess
        learns nothing from a picture that stands.
        """
        now = self._clock.now
        intent = self._intent
        habits = self._stuck
        passed = now - self._stuck_look
        self._stuck_look = now
        if abs(seen.speed) >= habits.still or abs(seen.turn_rate) >= habits.still:
            self._without_effect = 0
            self._stuck_after = self._stuck.plans_after_s + 2.0 * self._seat.delay.value
            self._asked_since = None
            return False
        if intent.speed > habits.asked_mps or abs(intent.turn_rate) > habits.asked_rad_s:
            if self._asked_since is None:
                self._asked_since = now
                self._asked_for = 0.0
            else:
                self._asked_for += passed
        if self._asked_since is None or self._asked_for < habits.asked_for_s:
            return False
        return now - self._asked_since > self._stuck_after

    def _intend(self, intent: Intent, tick: int) -> None:
        now = self._clock.now
        captured = self.log.followed(tick, now)
        if now < self._let_go_until:
            intent = Intent(0.0, 0.0)
        self._intent = intent
        self._seat.phone.ask(now, intent.speed, intent.turn_rate, captured)
        self._seat.delay.intend(now, intent.speed, intent.turn_rate)
        self._count_failures()
