"""Trials in which a cursor, or the tip of an arm, is moved; what is to be done is a goal.

References:
    R. J. Snowden, O. J. Braddick: The temporal integration and resolution of velocity signals.
    Vision Research 31, 1991 (speeds seen for longer than about 100 ms are discriminated
    no better).
    D. C. Burr: Temporal summation of moving images by the human visual system. Proc. R. Soc.
    Lond. B 211, 1981 (moving dots are summed over about 100 ms).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from typing import Any, NamedTuple

from typing_extensions import override

from dva_sim.agents.operator.strategies import (
    Driver,
    Oracle,
    PathView,
    PointView,
    Reach,
    Sighting,
    Strategy,
    Truth,
    Velocity,
)
from dva_sim.agents.route_following import Route
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.task.delays import normals
from dva_sim.simulation.task.devices import make_device
from dva_sim.simulation.task.plants import Cursor, Pair
from dva_sim.simulation.task.scenario import TaskScenario
from dva_sim.simulation.task.tasks import Pointing, ReachTask
from dva_sim.simulation.task.trial import Seat, Trace, Trial

MOVED_BY = 1e-3  # distance by which a cursor counts as moved [m]; assumed
SUMMED = 0.1  # time over which vision sums motion into a velocity [s]


class Places(NamedTuple):
    """Positions of cursor and target over time [s, m]."""

    time: float
    x: float
    y: float
    target_x: float
    target_y: float


class Motion:
    """Velocities as they are seen: from the frames of the last tenth of a second, two at least.

    Steps that a device makes within that time are not seen one by one, so that a cursor which
    is updated at another rate than it is shown seems to move evenly all the same.
    """

    def __init__(self) -> None:
        self._frames: deque[Places] = deque()

    def add(self, frame: Places) -> None:
        """Add one more frame."""
        frames = self._frames
        since = frame.time - SUMMED - 1e-9
        while len(frames) > 1 and frames[0].time < since:
            frames.popleft()
        frames.append(frame)

    def velocities(self) -> tuple[float, float, float, float]:
        """Return the velocities of cursor and target along x and y: least-squares slopes [m/s]."""
        frames = self._frames
        middle = sum(frame.time for frame in frames) / len(frames)
        squares = sum((frame.time - middle) ** 2 for frame in frames)
        sums = [0.0, 0.0, 0.0, 0.0]
        if squares:
            for time, *places in frames:
                share = (time - middle) / squares
                sums = [so_far + share * at for so_far, at in zip(sums, places, strict=True)]
        vx, vy, target_vx, target_vy = sums
        return vx, vy, target_vx, target_vy


def summed_over(rate: float) -> float:
    """Return the time from the first to the last frame of which a velocity is seen [s].

    Args:
        rate: Frames per second.
    """
    return max(1, math.floor(SUMMED * rate + 1e-6)) / rate


class Goal(ABC):
    """Goal of a pointing trial, and its measures.

    Attributes:
        flat: True if the cursor moves only along x.
        is_stationary: True if the target does not move; one that takes another's place has no
            velocity, and nobody leads it.
        path: The middle line, if the cursor is led along one.
        tolerance: Half the width of the target or tunnel [m].
        edge: Distance from the start at which a moving target turns back [m].
        is_pushed: True if the cursor is moved by something else as well: its motion then says
            nothing about the delay.
    """

    flat = False
    is_pushed = False
    edge = math.inf
    is_stationary = True
    path: Route | None = None
    tolerance: float

    @abstractmethod
    def target(self, now: float) -> Pair:
        """Return the position of the target [m]."""

    @abstractmethod
    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        """Take the cursor's place [m] for `dt` [s]; return True if the trial is over."""

    @abstractmethod
    def corrected(self, share: float, now: float, at: Cursor, wanted: Velocity) -> Velocity:
        """Return the command when a machine makes a share of the correction itself [m/s]."""

    @abstractmethod
    def row(self, trial: CursorTrial) -> dict[str, Any]:
        """Return what is measured."""

    @abstractmethod
    def draw(self, trace: Trace) -> None:
        """Add the geometry to a picture."""

    def press(self, now: float) -> None:  # noqa: B027
        """Press the button; some goals are reached by that."""

    @property
    def awaits_press(self) -> bool:
        """True if pressing the button has an effect now."""
        return False

    def pushed(self, now: float, command: Velocity) -> Velocity:
        """Return the command with what disturbs the cursor [m/s]."""
        return command

    def holds(self, now: float) -> bool:
        """Return True while something else is done, during which the cursor stays."""
        return False


class CursorTrial(Trial[Sighting]):
    """One trial with a cursor.

    Args:
        scenario: Device, links, frames.
        seat: Person who does the trial.
        goal: Goal of the trial.
        streams: The noise of this trial.
        reaction: See `Trial`.

    Attributes:
        path: Way gone so far [m].
        moved_at: Time at which the cursor first moved [s], or None.
    """

    STEP = 0.004
    plant: Cursor

    def __init__(
        self,
        scenario: TaskScenario,
        seat: Seat,
        goal: Goal,
        streams: Streams,
        reaction: float = 0.0,
    ) -> None:
        top = math.inf if scenario.plant.speed_mps is None else scenario.plant.speed_mps
        config = scenario.device
        if isinstance(scenario.task, ReachTask):
            config = config.model_copy(update={"gain": top})
        device = make_device(config, seat.person, streams, self.STEP)
        self.plant = Cursor(scenario.plant.lag_s, top)
        reach = Reach(min(top, device.top), 0.0)
        super().__init__(scenario, seat, reach, device, streams, reaction)
        self.goal = goal
        self._motion = Motion()
        self._summed = summed_over(scenario.frames.rate_hz)
        self.moved_at: float | None = None
        self._eye = Strategy(seat.person, reach)
        self._noise = normals(streams.fresh("aims"))

    def sight(self) -> Sighting:
        """Take velocities over the last frames; see `Motion`."""
        now = self.now
        x = self.plant.x
        y = self.plant.y
        tx, ty = self.goal.target(now)
        self._motion.add(Places(now, x, y, target_x=tx, target_y=ty))
        vx, vy, tvx, tvy = self._motion.velocities()
        if self.goal.is_stationary:
            tvx = tvy = 0.0
        return Sighting(
            tick=round(1000 * now),
            x=x,
            y=y,
            vx=vx,
            vy=vy,
            target_x=tx,
            target_y=ty,
            target_vx=tvx,
            target_vy=tvy,
            tolerance=self.goal.tolerance,
            edge=self.goal.edge,
        )

    @override
    def decide(self, driver: Driver, sighting: Sighting, now: float) -> None:
        if not self.goal.is_pushed:
            self.seat.delay.see(now, sighting.vx, sighting.vy, self._summed)
        judged = self.seat.judged_delay(now)
        vx, vy = self._ask(driver, sighting, now, judged)
        if self.goal.awaits_press and self._presses(
            driver, PointView(now, sighting, judged, self._noise)
        ):
            self.goal.press(self.now)
        if self.goal.flat:
            vy = 0.0
        self.device.aim(vx, vy)
        self.intended(now, vx, vy)

    def _presses(self, driver: Driver, view: PointView) -> bool:
        task = self.scenario.task
        hurried = isinstance(task, Pointing) and task.errors == "free"
        if isinstance(driver, Oracle):
            return Strategy.presses(self._eye, view, hurried)
        return driver.presses(view, hurried)

    def _ask(self, driver: Driver, sighting: Sighting, now: float, delay: float) -> Velocity:
        path = self.goal.path
        if isinstance(driver, Oracle):
            truth = Truth(sighting)
            return driver.point(truth) if path is None else driver.follow(path, truth)
        if path is None:
            return driver.point(PointView(now, sighting, delay, self._noise))
        return driver.follow(PathView(now, sighting, delay, path))

    @override
    def advance(self, dt: float) -> None:
        now = self.now
        plant = self.plant
        goal = self.goal
        command = self.commanded(dt)
        if self.scenario.automation:
            command = goal.corrected(self.scenario.automation, now, plant, command)
        command = goal.pushed(now, command)
        if goal.holds(now):
            command = 0.0, 0.0
        plant.step(command[0], 0.0 if goal.flat else command[1], dt)
        self.path += math.hypot(plant.vx, plant.vy) * dt
        if self.moved_at is None and self.path > MOVED_BY:
            self.moved_at = now + dt
        self.over = goal.check(now + dt, plant.x, plant.y, dt)

    def draw_goal(self) -> None:
        """Add the geometry to the trace."""
        self.goal.draw(self.trace)
