"""`dva_sim/Drive-v0`: drive a robot to an event by delayed pictures.

The robot is requested from the DVA, started, and sent commands by the scenario's messaging pattern
over its link, all in virtual time. Observations come from the newest picture that has arrived.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from typing_extensions import override

from dva_sim.agents.route_following import Route
from dva_sim.envs.scenarios import scenario_of
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.full.stepping import SteppedDrive
from dva_sim.simulation.scenario import Scenario

Vector = NDArray[np.float32]
Info = dict[str, Any]

COLUMNS: Final = (
    "way_left_m",  # remaining length of the planned route
    "offset_m",  # distance from the planned route
    "bearing_near_rad",  # to the point of the route NEAR_M ahead, positive to the left
    "bearing_far_rad",  # to the point FAR_M ahead
    "speed_mps",  # as the picture shows it
    "turn_rate_radps",
    "picture_age_s",  # time since it was taken
    "asked_speed",  # the last action, as shares of the limits
    "asked_turn",
)
NEAR_M = 0.8  # near look-ahead on the route [m]
FAR_M = 2.5  # far look-ahead on the route [m]
BOUND: Final = 1e4  # bound of all observations
ROUNDING: Final = 1e-6  # rounding error of a share at its limit in float32


class DriveEnv(gymnasium.Env[Vector, Vector]):
    """One drive of one robot to the first event of a scenario.

    Actions are two shares of the robot's limits, commanded until the next step: speed, 0 to 1, and
    turn rate, -1 to 1, positive to the left; any other value raises `ValueError`. Observations
    are those of `COLUMNS`, float32. The route is planned once, from the position in the first
    picture.

    The reward of a step is the time that its progress takes at top speed minus the duration of the
    step [s]: the return is minus the time lost compared with a drive without delay and curves. A
    drive terminates when the event is within 3 m in the picture (`info["outcome"]` is `arrived`) or
    when the robot is no longer driven (`lost`), and is truncated at the horizon.

    Args:
        scenario: A scenario of the full model by name or path.
        changes: New values by dotted key, such as `{"link.delay_s": 0.5}`.
        dt: Duration of a step [s].

    Raises:
        ConfigError: there is no such scenario, it is of another model, or not valid.
    """

    def __init__(
        self,
        scenario: str = "drive-to-event",
        *,
        changes: Mapping[str, Any] | None = None,
        dt: float = 0.2,
    ) -> None:
        if not 0.0 < dt <= 10.0:
            raise ConfigError(f"dt is {dt} s; should be above 0, up to 10")
        self.scenario = scenario_of(scenario, changes, Scenario, "full")
        self.dt = dt
        low = np.array([0, -1], np.float32)
        high = np.array([1, 1], np.float32)
        self.action_space = cast("spaces.Space[Vector]", spaces.Box(low, high))
        box = spaces.Box(-BOUND, BOUND, (len(COLUMNS),), np.float32)
        self.observation_space = cast("spaces.Space[Vector]", box)
        self.drive: SteppedDrive | None = None

    @override
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, Info]:
        """Begin a run, obtain permission for the robot, and start it.

        Raises:
            ConfigError: the robot is not obtained, for example because the link loses everything.
        """
        super().reset(seed=seed)
        run_seed = int(self.np_random.integers(2**31)) if seed is None else seed
        self.drive = SteppedDrive(self.scenario, run_seed)
        observation = self.drive.begin().observation
        points = self.drive.run.stage.planner.path((observation.x, observation.y), self.drive.goal)
        if points is None:
            raise ConfigError("there is no path from the robot to the event")
        self._route = Route(points)
        self._action = 0.0, 0.0
        self._remaining_m = self._route.length
        return self._observe(), {"outcome": ""}

    @override
    def step(self, action: Vector) -> tuple[Vector, float, bool, bool, Info]:
        drive = self.drive
        if drive is None:
            raise RuntimeError("no drive has begun: call reset first")
        self._action = _shares(action)
        outcome = drive.step(*self._action, self.dt)
        before = self._remaining_m
        observation = self._observe()
        # Both terms are times [s]: progress at top speed, and the step.
        reward = (before - self._remaining_m) / drive.limits[0] - self.dt
        cut = not outcome and drive.now >= self.scenario.horizon_s
        return observation, reward, bool(outcome), cut, {"outcome": outcome, "time_s": drive.now}

    def _observe(self) -> Vector:
        """Return the newest picture as an observation; the last one if the drive has ended."""
        drive = self.drive
        assert drive is not None
        if (frame := drive.frame) is not None:
            observation = frame.observation
            near = self._route.ahead(observation.x, observation.y, observation.heading, NEAR_M)
            far = self._route.ahead(observation.x, observation.y, observation.heading, FAR_M)
            self._remaining_m = far.remaining
            age = drive.now - frame.captured
            pose = (far.remaining, near.offset, near.bearing, far.bearing)
            self._picture = (*pose, observation.speed, observation.turn_rate, age)
        return np.clip(np.array([*self._picture, *self._action], np.float32), -BOUND, BOUND)


def _shares(action: object) -> tuple[float, float]:
    """Parse an action; clip rounding errors beyond a limit.

    Raises:
        ValueError: it is not two finite shares within the limits.
    """
    rule = "an action is two finite numbers, speed from 0 to 1 and turn rate from -1 to 1"
    try:
        speed, turn = np.asarray(action, dtype=np.float64).tolist()
        is_within = -ROUNDING <= speed <= 1 + ROUNDING and abs(turn) <= 1 + ROUNDING
    except (TypeError, ValueError):
        is_within = False
    if not is_within:
        raise ValueError(f"{rule}, not {action!r}")
    return min(max(speed, 0.0), 1.0), min(max(turn, -1.0), 1.0)
