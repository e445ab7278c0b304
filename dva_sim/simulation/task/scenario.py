"""What a task of the literature consists of: what is to be done, by whom, with what, how late.

Tasks and their geometry are what a publication lays before its subjects. A value may be one
number or several: several are crossed with those of the other keys, and each condition is given
its trials in turn.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, model_validator

from dva_sim.agents.tilt.accelerometer import load_part
from dva_sim.agents.tilt.filters import load_filter
from dva_sim.kernel import config_overrides
from dva_sim.kernel.config import Config, Fail, Key
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document, KeyPath
from dva_sim.network.link import LinkConfig
from dva_sim.simulation.scenario.loading import check_strategy
from dva_sim.simulation.scenario.parts import OperatorConfig
from dva_sim.simulation.scenario.scenario import population

Length = Annotated[float, Field(gt=0, le=1000)]  # nobody does a task that is longer
NonNegative = Annotated[float, Field(ge=0)]
Several = Annotated[tuple[Length, ...], Field(min_length=1, max_length=50)]
Values = Length | Several


def values_of(given: float | tuple[float, ...]) -> tuple[float, ...]:
    """One value or several, as several."""
    return given if isinstance(given, tuple) else (given,)


class Pointing(Config):
    """Bring a cursor onto a target.

    Attributes:
        amplitude_m: From the start to the centre of the target.
        width_m: Of the target along the way; in two dimensions its diameter.
        axes: 1: the cursor moves on a line. 2: targets lie on a circle and are taken across it.
        targets: How many lie on that circle (two dimensions).
        cursor_m: Diameter of the cursor, which must be inside the target as a whole.
        selection: `first_entry`: inside once. `dwell`: inside for `dwell_s`. `click`: when the
            person presses a button; a press outside the target is an error.
        dwell_s: How long it must stay inside.
        cue: `known`: where the next target will be is known, so one sets off as soon as one
            sees it. `unexpected`: one acts a reaction time after the first frame is on the screen.
            Who drives a vehicle always does.
        timed_from: When the movement time begins: with the `target`, or the first `movement`.
    """

    kind: Literal["pointing"] = "pointing"
    amplitude_m: Values = 0.1
    width_m: Values = 0.01
    axes: Literal[1, 2] = 1
    targets: Annotated[int, Field(ge=3, le=99)] = 15
    cursor_m: NonNegative = 0.0
    selection: Literal["first_entry", "dwell", "click"] = "first_entry"
    dwell_s: NonNegative = 0.5
    cue: Literal["known", "unexpected"] = "known"
    timed_from: Literal["target", "movement"] = "target"

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Amplitude and width [m] of each condition."""
        yield from itertools.product(values_of(self.amplitude_m), values_of(self.width_m))

    @model_validator(mode="after")
    def _cursor_fits(self) -> Pointing:
        if self.cursor_m >= min(values_of(self.width_m)):
            raise ValueError(
                f"cursor_m {self.cursor_m:g} should be below the smallest width_m "
                f"{min(values_of(self.width_m)):g}, or no target can be entered"
            )
        return self


class Tunnel(Config):
    """Steer a cursor through a tunnel without touching its walls.

    Attributes:
        shape: A straight tunnel, or once around a circle.
        length_m: Along its middle.
        width_m: From wall to wall.
        on_error: What becomes of a trial in which a wall is crossed: it is `counted` and goes
            on, or it is `over`.
    """

    kind: Literal["tunnel"] = "tunnel"
    shape: Literal["straight", "circular"] = "straight"
    length_m: Values = 0.2
    width_m: Values = 0.01
    on_error: Literal["counted", "over"] = "counted"

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Length and width [m] of each condition."""
        yield from itertools.product(values_of(self.length_m), values_of(self.width_m))

    @model_validator(mode="after")
    def _goes_around(self) -> Tunnel:
        for length, width in self.conditions():
            if self.shape == "circular" and width * math.pi >= length:
                raise ValueError(
                    f"width_m {width:g} leaves no middle of a circle of length_m {length:g}; it "
                    "should be below its diameter"
                )
        return self


class Tracking(Config):
    """Follow a target that moves as a sum of sines, on a line.

    Attributes:
        record_s: What is measured; sines are rounded to whole periods in it.
        warm_up_s: Before that, not measured.
        frequencies_rad_s: Of the sines.
        amplitudes_m: Of the sines.
    """

    kind: Literal["tracking"] = "tracking"
    record_s: Annotated[float, Field(ge=10, le=1000)] = 120.0
    warm_up_s: NonNegative = 10.0
    frequencies_rad_s: Several = (0.2, 0.5, 1.0, 2.0, 4.0)
    amplitudes_m: Several = (0.02, 0.02, 0.02, 0.002, 0.002)

    def conditions(self) -> Iterator[tuple[float, float]]:
        """One: the largest excursion and the highest frequency."""
        yield sum(self.amplitudes_m), max(self.frequencies_rad_s)

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Of the sines, whole numbers of which fill the record [rad/s]."""
        base = 2.0 * math.pi / self.record_s
        return tuple(base * max(1, round(w / base)) for w in self.frequencies_rad_s)

    @model_validator(mode="after")
    def _sines_differ(self) -> Tracking:
        if len(self.amplitudes_m) != len(self.frequencies_rad_s):
            raise ValueError("amplitudes_m and frequencies_rad_s should be equally many")
        if list(self.frequencies) != sorted(set(self.frequencies)):
            raise ValueError(
                "frequencies_rad_s should rise, by more than one period in record_s each"
            )
        return self


class Corner(Config):
    """Drive around a right-angled corner of a corridor.

    Attributes:
        leg_m: Before the corner, and after it, along the middle.
        width_m: Of the corridor.
    """

    kind: Literal["corner"] = "corner"
    leg_m: Values = 4.0
    width_m: Values = 1.5

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Length and width [m] of each condition."""
        for leg, width in itertools.product(values_of(self.leg_m), values_of(self.width_m)):
            yield 2.0 * leg, width


class Slalom(Config):
    """Drive around cones in a row, to their left and right by turns.

    Attributes:
        cones: How many.
        spacing_m: Between neighbours.
        swing_m: How far beside the row the middle of the way passes a cone.
        width_m: Of the way: who is farther off its middle touches something.
    """

    kind: Literal["slalom"] = "slalom"
    cones: Annotated[int, Field(ge=1, le=100)] = 6
    spacing_m: Values = 4.0
    swing_m: Length = 1.0
    width_m: Values = 1.5

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Spacing and width [m] of each condition."""
        yield from itertools.product(values_of(self.spacing_m), values_of(self.width_m))

    @model_validator(mode="after")
    def _cones_stand_beside(self) -> Slalom:
        widest = max(values_of(self.width_m))
        if widest > 2.0 * self.swing_m:
            raise ValueError(
                f"width_m {widest:g} is above twice swing_m {self.swing_m:g}: the cones would "
                "stand in the way"
            )
        return self


class Course(Config):
    """Drive along a course to its end.

    Attributes:
        points_m: Its corners, `[x, y]` each.
        width_m: Of the way.
    """

    kind: Literal["course"] = "course"
    points_m: Annotated[tuple[tuple[float, float], ...], Field(min_length=2, max_length=500)]
    width_m: Values = 1.5

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Length and width [m] of each condition."""
        steps = itertools.pairwise(self.points_m)
        length = sum(math.dist(a, b) for a, b in steps)
        for width in values_of(self.width_m):
            yield length, width

    @model_validator(mode="after")
    def _leads_somewhere(self) -> Course:
        for number, (a, b) in enumerate(itertools.pairwise(self.points_m)):
            if a == b:
                raise ValueError(f"points_m {number} and {number + 1} are the same place")
        return self


class Stop(Config):
    """Where the tip of the arm has to come to, and the work there.

    Attributes:
        swing_m: Along the arc of the swing at the arm's middle reach.
        reach_m: Outwards.
        work_s: What the work there takes, whoever commands it (digging, emptying).
    """

    swing_m: float
    reach_m: float
    work_s: NonNegative = 0.0


class ReachTask(Config):
    """Bring the tip of a slow arm from place to place, as an excavator loads a truck.

    Attributes:
        stops: Where to, in this order.
        tolerance_m: How near is near enough, either way.
        settle_s: How long it must stay so near before the work begins.
    """

    kind: Literal["reach"] = "reach"
    stops: Annotated[tuple[Stop, ...], Field(min_length=1, max_length=50)]
    tolerance_m: Values = 0.2
    settle_s: NonNegative = 0.3

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Whole way and width of a target [m] of each condition."""
        places = [(0.0, 0.0), *((stop.swing_m, stop.reach_m) for stop in self.stops)]
        way = sum(math.dist(a, b) for a, b in itertools.pairwise(places))
        for tolerance in values_of(self.tolerance_m):
            yield way, 2.0 * tolerance


Task = Annotated[
    Pointing | Tunnel | Tracking | Corner | Slalom | Course | ReachTask, Field(discriminator="kind")
]
VEHICLES = (Corner, Slalom, Course)


T = TypeVar("T")
Positive = Annotated[float, Field(gt=0)]
FASTEST_LINE = 1e12  # [bit/s]: what is sent here is a few numbers, so its length costs no time


class OneWayDelay(Config):
    """One direction of the link between the hand and what it moves.

    Attributes:
        delay_s: One way.
        jitter_s: Half-width of a uniform law around the delay; nothing overtakes.
        loss: Probability that what is sent is lost.
    """

    delay_s: Annotated[float, Field(ge=0, le=30)] = 0.0
    jitter_s: Annotated[float, Field(ge=0, le=30)] = 0.0
    loss: Annotated[float, Field(ge=0, le=0.9)] = 0.0

    @model_validator(mode="after")
    def _causal(self) -> OneWayDelay:
        if self.jitter_s > self.delay_s:
            raise ValueError(f"jitter_s {self.jitter_s:g} is above delay_s {self.delay_s:g}")
        return self

    def link(self) -> LinkConfig:
        """The same as a link of the network."""
        return LinkConfig(
            delay_s=self.delay_s, jitter_s=self.jitter_s, loss=self.loss, rate_bps=FASTEST_LINE
        )


class Ways(Config):
    """Both directions: commands go up, frames come down."""

    up: Annotated[OneWayDelay, Key(inner={"delay_s": Key("delay of commands", zero=True)})] = (
        OneWayDelay()
    )
    down: Annotated[OneWayDelay, Key(inner={"delay_s": Key("delay of frames", zero=True)})] = (
        OneWayDelay()
    )


class FramesConfig(Config):
    """How what happens is shown.

    Attributes:
        rate_hz: Frames per second.
        extra_s: From taking a frame to sending it, such as encoding.
    """

    rate_hz: Annotated[float, Field(gt=0, le=1000), Key("frame rate")] = 60.0
    extra_s: Annotated[float, Field(ge=0, le=10)] = 0.0


class DeviceConfig(Config):
    """What is in the hand.

    Attributes:
        kind: `mouse`: the hand's place is the cursor's. `tilt_position`, `tilt_velocity`: the
            tilt is the cursor's place, or its velocity. `joystick`: the deflection is the
            velocity.
        gain: Of the cursor, per unit of the hand: [m/m] of a mouse, [m/rad] and [m/s per rad]
            of a tilt, [m/s] at full deflection of a joystick. Vehicles and arms have their top
            speed at full deflection, and need none.
        rate_hz: How often it is read and its reading sent. A tilt device has the rate of its
            accelerometer if that is lower.
        limit_deg: No hand tilts farther (tilt devices).
        accelerometer: By name (tilt devices).
        filter: On what the accelerometer measures, by name (tilt devices).
        filter_options: Of the filter.
    """

    kind: Annotated[
        Literal["mouse", "tilt_position", "tilt_velocity", "joystick"], Key("device")
    ] = "mouse"
    gain: Annotated[Positive, Key("gain of the device", stated=False)] = 1.0
    rate_hz: Annotated[float, Field(gt=0, le=1000)] = 125.0
    limit_deg: Annotated[float, Field(gt=0, le=80)] = 45.0
    accelerometer: str = "adxl345"
    filter: str = "none"
    filter_options: dict[str, Any] = Field(default_factory=dict)


class PlantConfig(Config):
    """What is moved.

    Attributes:
        lag_s: Time constant with which it follows its command.
        speed_mps: Its top speed, of an arm along each axis; left out, a cursor has none.
        turn_rate_deg_s: Of a vehicle, at most.
        width_m: Of a vehicle's body.
    """

    lag_s: NonNegative = 0.0
    speed_mps: Positive | None = None
    turn_rate_deg_s: Positive = 30.0
    width_m: NonNegative = 0.0


class TaskScenario(Config):
    """A task, and everything else that a run of it needs but its seed.

    Attributes:
        model: Tells this kind of scenario from the others.
        operator: Who does it, as in a full scenario; there is one, with one thing in hand.
        automation: Share of the correction that the machine makes itself: the part of the
            command that removes the error (towards the target, the middle of the tunnel or
            of the road) is (1 - share) of what the person asks for and share of what a
            proportional controller at the machine, which knows the error without delay, asks
            for. How fast a tunnel or a road is gone through stays the person's. 0 is direct
            control; 1 leaves the person nothing to correct.
        trials: Of each condition that the task crosses.
        practice: Trials before them that are not kept, in which the person learns the delay.
        horizon_s: A trial that is not done by then is given up.
    """

    model: Literal["task"]
    description: str = ""
    task: Annotated[Task, Key(inner={"kind": Key("task")})]
    operator: OperatorConfig = OperatorConfig()
    device: DeviceConfig = DeviceConfig()
    link: Ways = Ways()
    frames: FramesConfig = FramesConfig()
    plant: PlantConfig = PlantConfig()
    automation: Annotated[
        float, Field(ge=0, le=1), Key("share of the correction that the machine makes")
    ] = 0.0
    trials: Annotated[int, Field(ge=1, le=1000)] = 1
    practice: Annotated[int, Field(ge=0, le=100)] = 3
    horizon_s: Annotated[float, Field(gt=0, le=7200), Key("longest time of a run")] = 30.0

    @property
    def is_driven(self) -> bool:
        """Whether a vehicle is driven, rather than a cursor or an arm moved."""
        return isinstance(self.task, VEHICLES)

    @model_validator(mode="after")
    def _fits_together(self) -> TaskScenario:
        if (self.is_driven or isinstance(self.task, ReachTask)) and self.device.kind != "joystick":
            raise ValueError(
                f"a {self.task.kind} needs device.kind joystick, not {self.device.kind!r}"
            )
        if (self.is_driven or isinstance(self.task, ReachTask)) and self.plant.speed_mps is None:
            raise ValueError(f"what is driven in a {self.task.kind} needs plant.speed_mps")
        return self

    @model_validator(mode="after")
    def _there_is_room(self) -> TaskScenario:
        task, body = self.task, self.plant.width_m
        if isinstance(task, VEHICLES) and body >= min(w for _, w in task.conditions()):
            raise ValueError(f"plant.width_m {body:g} should be below the smallest width_m")
        return self

    @model_validator(mode="after")
    def _there_is_time(self) -> TaskScenario:
        task, needed = self.task, 0.0
        if isinstance(task, Pointing) and task.selection == "dwell":
            needed = task.dwell_s
        elif isinstance(task, Tracking):
            needed = task.warm_up_s + task.record_s
        elif isinstance(task, ReachTask):
            needed = sum(stop.work_s + task.settle_s for stop in task.stops)
        if needed >= self.horizon_s:
            raise ValueError(
                f"horizon_s {self.horizon_s:g} should be above the {needed:g} s that the task "
                "alone takes"
            )
        return self


def build(
    source: Document | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> TaskScenario:
    """A task from a file or plain data, with some keys changed.

    Args:
        source: A document (mistakes are told with their place) or plain data.
        changes: New values by dotted key, such as `{"link.down.delay_s": 0.225}`.

    Raises:
        ConfigError: an unknown key or name, a wrong type, a value out of range.
    """
    return config_overrides.build(TaskScenario, source, changes, _complete)


def _complete(scenario: TaskScenario, error: Fail) -> TaskScenario:
    """Refuse what is named and does not exist."""
    operator, device = scenario.operator, scenario.device
    check_strategy(operator.strategy, operator.options, error)
    traits: KeyPath = ("operator", "traits" if operator.traits else "population")
    _try(lambda: population(operator), error, traits)
    if device.kind.startswith("tilt"):
        _try(lambda: load_part(device.accelerometer), error, ("device", "accelerometer"))
        name, options = device.filter, device.filter_options
        make = _try(lambda: load_filter(name, options), error, ("device", "filter"))
        _try(lambda: make(0.01), error, ("device", "filter_options"))
    return scenario


def _try(get: Callable[[], T], error: Fail, path: KeyPath) -> T:
    """What `get` gives; its mistake is told at a key of the scenario."""
    try:
        return get()
    except ConfigError as problem:
        if problem.file is not None:
            raise
        raise error(problem.problem, path) from None
