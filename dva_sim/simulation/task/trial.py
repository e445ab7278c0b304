"""One trial: frames come, a person perceives them and wants something, a hand does it.

The way is that of a real drive: frames at a rate -> link -> perceptual delay -> strategy, told the
delay as the person has learnt it -> hand and device -> link -> what is moved. Only the oracle sees
and moves it without frames, links and perception. Time goes by fixed steps; what is due is done at
the step nearest to it, so that no delay is longer or shorter on average.

A trial begins when its goal appears, at the machine. A person who did not expect it acts a reaction
after the first frame is on its screen, on the newest one that it has perceived by then; so link,
encoding and lost frames come before the reaction, and how many frames there are does not matter.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from dva_sim.agents.operator.delay_estimation import DelayEstimate, Timing
from dva_sim.agents.operator.strategies import Driver, Oracle, Reach, Strategy
from dva_sim.agents.population import Person
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.task.delays import Channel
from dva_sim.simulation.task.devices import HandDevice
from dva_sim.simulation.task.plants import Cursor, Pair, Unicycle
from dva_sim.simulation.task.scenario import OneWayDelay, TaskScenario

S = TypeVar("S")  # what a frame shows

WAIT_FROM = 0.1  # a person who commands nothing for this long is waiting [s]; assumed
MACHINE_GAIN = 2.0  # gain of a machine that corrects by itself [rad/s]; assumed
TRACE_EVERY = 0.02  # interval of a trace [s]


@dataclass
class Seat:
    """Person who does the trials of a block, and what carries over between them.

    Attributes:
        strategy: Function that makes the strategy for what is steered.
        delay: The person's estimate of the delay, on a clock that runs on over trials.
        begun: Start of this trial, on that clock [s].
        timing: Errors of the perceived delay.
    """

    person: Person
    strategy: Callable[[Person, Reach], Driver]
    delay: DelayEstimate
    begun: float = 0.0
    timing: Timing | None = None

    def judged_delay(self, now: float) -> float:
        """Return the judged delay at a moment [s]; recent changes of it are misjudged."""
        value = self.delay.value
        usual = self.person.usual_delay
        return value if self.timing is None else self.timing.judged(value, usual, now)


@dataclass
class Trace:
    """Trace of a trial for drawing.

    Attributes:
        times: [s]
        places: [m]
        speeds: Since the time before [m/s].
        touched: Places where a wall was crossed, or a target left again [m].
        walls: Lines that show the geometry, each a list of places [m].
        marks: Circles that show targets: x, y and radius [m].
    """

    times: list[float] = field(default_factory=list)
    places: list[Pair] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    touched: list[Pair] = field(default_factory=list)
    walls: list[list[Pair]] = field(default_factory=list)
    marks: list[tuple[float, float, float]] = field(default_factory=list)


class Waits:
    """Counts how often, and how long, a person wants nothing and waits to see.

    Attributes:
        count: Number of waits.
        seconds: In all [s].
    """

    def __init__(self) -> None:
        self.count = 0
        self.seconds = 0.0
        self._since: float | None = None

    def note(self, now: float, moves: bool) -> None:
        """Note what the person wants to move, or to stand, from `now` [s] on."""
        if moves:
            if self._since is not None and now - self._since >= WAIT_FROM:
                self.count += 1
                self.seconds += now - self._since
            self._since = None
        elif self._since is None:
            self._since = now


class WayKept:
    """Departures from a path: a crossing of its edge counts once, until one is back.

    Args:
        limit: Largest distance from the middle of the path [m].

    Attributes:
        crossings: Number of crossings of the edge.
        touched: Places of the crossings [m].
    """

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self._squares = 0.0
        self._inside = True
        self.crossings = 0
        self.touched: list[Pair] = []

    def note(self, offset: float, place: Pair, dt: float) -> bool:
        """Note a distance from the middle [m] for a step [s]; return whether that is inside."""
        self._squares += offset * offset * dt
        inside = abs(offset) <= self._limit
        if self._inside and not inside:
            self.crossings += 1
            self.touched.append(place)
        self._inside = inside
        return inside

    def row(self, seconds: float) -> dict[str, float]:
        """Return the measures over a time [s]."""
        return {
            "error": float(self.crossings > 0),
            "wall_crossings": self.crossings,
            "path_error_rms_m": math.sqrt(self._squares / seconds) if seconds else math.nan,
        }


class Trial(ABC, Generic[S]):
    """Base class of all trials.

    Args:
        scenario: Rates, links, horizon.
        seat: Person who does the trial.
        reach: Limits of what is moved.
        device: Device in the hand.
        streams: Random streams of the trial.
        reaction: Time from the first frame on the screen to the first that is acted on, perception
            in it [s]; 0 for who expects the goal: it acts as soon as it has perceived a frame.

    Attributes:
        now: Since the trial began [s].
        over: True once the trial is finished.
        plant: Model of what is moved.
        path: Distance moved [m].
        first_move: Time at which the person first wanted to move anything [s], or None.
    """

    STEP: float  # [s]
    plant: Cursor | Unicycle

    def __init__(
        self,
        scenario: TaskScenario,
        seat: Seat,
        reach: Reach,
        device: HandDevice,
        streams: Streams,
        reaction: float = 0.0,
    ) -> None:
        self.scenario = scenario
        self.seat = seat
        self.trace = Trace()
        self.waits = Waits()
        self.now = 0.0
        self.over = False
        self.device = device
        self.path = 0.0
        self._next_reading = 0.0
        self.first_move: float | None = None
        self._driver = seat.strategy(seat.person, reach)
        perception = seat.person.perceptual_delay
        self._surprise = max(reaction - perception, 0.0)
        self._acts_from: float | None = None  # known once a frame is perceived
        self._newest: S | None = None
        self._late = scenario.frames.extra_s + perception
        self._frames: Channel[S] = Channel(scenario.link.down, self._late, streams, "down")
        delay = OneWayDelay() if self.is_oracle else scenario.link.up
        self._up: Channel[Pair] = Channel(delay, 0.0, streams, "up")

    @abstractmethod
    def sight(self) -> S:
        """Return the content of a frame taken now."""

    @abstractmethod
    def decide(self, driver: Driver, frame: S, now: float) -> None:
        """Decide on a perceived frame; `now` is the person's clock [s]."""

    @abstractmethod
    def advance(self, dt: float) -> None:
        """Advance hand, link and the moved object by `dt` [s]."""

    def run(self, keep: bool = False) -> None:
        """Play the trial to its end; `keep` its trace to be drawn."""
        step = self.STEP
        half = 0.5 * self.STEP
        look = Oracle.DELAY if self.is_oracle else 1.0 / self.scenario.frames.rate_hz
        steps = 0
        next_frame = 0.0
        next_trace = 0.0
        horizon = self.scenario.horizon_s
        while not self.over and self.now < horizon:
            now = self.now
            if now >= next_frame - half:
                self._frames_due(now)
                next_frame += look
            self._perceive(now, half)
            if keep and now >= next_trace - half:
                self._draw()
                next_trace += TRACE_EVERY
            self.advance(step)
            steps += 1
            self.now = steps * step
        if keep and self.now > self.trace.times[-1] + 0.5 * TRACE_EVERY:
            self._draw()
        self.waits.note(self.now, moves=True)

    def intended(self, now: float, one: float, other: float) -> None:
        """Note what the person wants: the delay is learnt from it, and waits are counted."""
        self.seat.delay.intend(now, one, other)
        moves = one != 0.0 or other != 0.0
        if moves and self.first_move is None:
            self.first_move = self.now
        if self.first_move is not None:
            self.waits.note(self.now, moves)

    def commanded(self, dt: float) -> Pair:
        """Return the machine's command in a step [s], after the hand, its reading and the delay."""
        now = self.now
        device = self.device
        device.move(dt)
        if now >= self._next_reading - 0.5 * dt:
            self._up.put(now, device.reading())
            self._next_reading += device.period
        arrived = self._up.take(now + 0.5 * dt)
        return device.command(arrived[-1] if arrived else None, dt)

    @property
    def is_oracle(self) -> bool:
        """True if the reference steers, which no delay reaches."""
        return isinstance(self._driver, Oracle)

    @property
    def move_and_wait_share(self) -> float:
        """For how much of its time the strategy moved and waited, if it can tell."""
        workload = self._driver.workload() if isinstance(self._driver, Strategy) else {}
        return workload.get("move_and_wait_share", 0.0)

    @property
    def failures(self) -> int:
        """Number of invalid answers of a user's strategy."""
        return self._driver.failures if isinstance(self._driver, Strategy) else 0

    def _frames_due(self, now: float) -> None:
        if self.is_oracle:
            self.decide(self._driver, self.sight(), self.seat.begun + now)
        else:
            self._frames.put(now, self.sight())

    def _perceive(self, now: float, half: float) -> None:
        """Act on the newest frame, if there is one that was not acted on, and not before the cue.

        Args:
            now: [s]
            half: Half the step size [s].
        """
        frames = self._frames.take(now + half)
        if frames:
            self._newest = frames[-1]
            if self._acts_from is None:
                self._acts_from = now + self._surprise
        newest = self._newest
        acts_from = self._acts_from
        if newest is not None and acts_from is not None and now >= acts_from - half:
            self._newest = None
            self.decide(self._driver, newest, self.seat.begun + now)

    def _draw(self) -> None:
        place = (self.plant.x, self.plant.y)
        trace = self.trace
        if trace.times:
            since = self.now - trace.times[-1]
            trace.speeds.append(math.dist(place, trace.places[-1]) / since)
        else:
            trace.speeds.append(0.0)
        trace.times.append(self.now)
        trace.places.append(place)
