"""A task with everything else that a run of it needs: by whom, with what, how late."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
from dva_sim.simulation.task.tasks import VEHICLES, NonNegative, Pointing, ReachTask, Task, Tracking

T = TypeVar("T")
Positive = Annotated[float, Field(gt=0)]
FASTEST_LINE = 1e12  # rate of a line on which the size of a message costs no time [bit/s]


class OneWayDelay(Config):
    """One direction of the link between the hand and what it moves.

    Attributes:
        delay_s: One-way delay.
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
        """Return the delays as a link of the network."""
        return LinkConfig(
            delay_s=self.delay_s, jitter_s=self.jitter_s, loss=self.loss, rate_bps=FASTEST_LINE
        )


class Ways(Config):
    """Both directions: commands go up, frames come down."""

    up: Annotated[OneWayDelay, Key(inner={"delay_s": Key("delay of commands")})] = OneWayDelay()
    down: Annotated[OneWayDelay, Key(inner={"delay_s": Key("delay of frames")})] = OneWayDelay()


class FramesConfig(Config):
    """Frames that show what happens.

    Attributes:
        rate_hz: Frames per second.
        extra_s: Time from taking a frame to sending it, such as encoding.
    """

    rate_hz: Annotated[float, Field(gt=0, le=1000), Key("frame rate")] = 60.0
    extra_s: Annotated[float, Field(ge=0, le=10)] = 0.0


class DeviceConfig(Config):
    """Device in the hand.

    Attributes:
        kind: `mouse`: the hand's place is the cursor's. `tilt_position`, `tilt_velocity`: the
            tilt is the cursor's place, or its velocity. `joystick`: the deflection is the
            velocity.
        gain: Gain of the cursor per unit of the hand: [m/m] of a mouse, [m/rad] and [m/s per rad]
            of a tilt, [m/s] at full deflection of a joystick. Vehicles and arms have their top
            speed at full deflection, and need none.
        rate_hz: Rate at which it is read and sent. A tilt device has the rate of its accelerometer
            if that is lower.
        limit_deg: No hand tilts farther (tilt devices).
        accelerometer: Name (tilt devices).
        filter: Filter of the accelerometer's samples, by name (tilt devices).
        filter_options: Options of the filter.
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
    """Machine that is moved.

    Attributes:
        lag_s: Time constant with which it follows its command.
        speed_mps: Its top speed, of an arm along each axis; left out, a cursor has none.
        turn_rate_deg_s: Largest turn rate of a vehicle.
        width_m: Width of a vehicle's body.
    """

    lag_s: NonNegative = 0.0
    speed_mps: Positive | None = None
    turn_rate_deg_s: Positive = 30.0
    width_m: NonNegative = 0.0


class TaskScenario(Config):
    """A task, and everything else that a run of it needs but its seed.

    Attributes:
        model: Name of this kind of scenario.
        operator: Person who does the task, as in a full scenario; there is one, with one task at a
            time.
        automation: Share of the correction that the machine makes itself: the part of the
            command that removes the error (towards the target, the middle of the tunnel or
            of the road) is (1 - share) of what the person asks for and share of what a
            proportional controller at the machine, which knows the error without delay, asks
            for. How fast a tunnel or a road is gone through stays the person's. 0 is direct
            control; 1 leaves the person nothing to correct.
        trials: Number of trials of each condition that the task crosses.
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
        """True if a vehicle is driven, rather than a cursor or an arm moved."""
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
        task = self.task
        body = self.plant.width_m
        if isinstance(task, VEHICLES) and body >= min(w for _, w in task.conditions()):
            raise ValueError(f"plant.width_m {body:g} should be below the smallest width_m")
        return self

    @model_validator(mode="after")
    def _there_is_time(self) -> TaskScenario:
        task = self.task
        needed = 0.0
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
    """Return a task from a file or plain data, with some keys changed.

    Args:
        source: Document, whose mistakes are reported with their place, or plain data.
        changes: New values by dotted key, such as `{"link.down.delay_s": 0.225}`.

    Raises:
        ConfigError: an unknown key or name, a wrong type, a value out of range.
    """
    return config_overrides.build(TaskScenario, source, changes, _complete)


def _complete(scenario: TaskScenario, error: Fail) -> TaskScenario:
    """Refuse what is named and does not exist."""
    operator = scenario.operator
    device = scenario.device
    check_strategy(operator.strategy, operator.options, error)
    traits: KeyPath = ("operator", "traits" if operator.traits else "population")
    _try(lambda: population(operator), error, traits)
    if device.kind.startswith("tilt"):
        _try(lambda: load_part(device.accelerometer), error, ("device", "accelerometer"))
        name = device.filter
        options = device.filter_options
        make = _try(lambda: load_filter(name, options), error, ("device", "filter"))
        _try(lambda: make(0.01), error, ("device", "filter_options"))
    return scenario


def _try(get: Callable[[], T], error: Fail, path: KeyPath) -> T:
    """Return what `get` returns; report its mistake at a key of the scenario."""
    try:
        return get()
    except ConfigError as problem:
        if problem.file is not None:
            raise
        raise error(problem.problem, path) from None
