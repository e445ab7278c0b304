"""`dva_sim/Dispatch-v0`: send responders to events, one order at a time.

A shift of the timed model runs until the DVA has to decide. Each action adds one piece of advice to
that decision or ends it; then time passes until the next one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from typing_extensions import override

from dva_sim.core.dispatch import (
    Advice,
    Announcement,
    Assignment,
    Policy,
    Relocation,
    Situation,
)
from dva_sim.core.events import Event
from dva_sim.envs.scenarios import scenario_of
from dva_sim.kernel.errors import ConfigError
from dva_sim.protocol.event_kinds import EVENT_KINDS
from dva_sim.simulation.models import model_for
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.timed.stepping import SteppedShift

Observations = dict[str, NDArray[Any]]
Info = dict[str, Any]

DONE: Final = 0  # the action that ends a decision
TASK_COLUMNS: Final = (
    *EVENT_KINDS,  # 1 for the kind of the event
    "contain",  # 1 if it is to be contained, 0 if it is to be confirmed
    "due",
    "severity",
    "confidence",
    "age_s",  # time since the first report
    "waiting_s",
    "engaged",  # 1 if a responder is on its way
)
UNIT_COLUMNS: Final = ("free", "robot", "engaged")  # may be sent; is a robot; is under way
MINUTE: Final = 60.0
NO_END: Final = -1.0  # stands for an infinite distance or time
BOUND: Final = 1e7  # bound of all observations


class DispatchEnv(gymnasium.Env[Observations, int]):
    """Dispatch decisions of a shift, one order at a time.

    Decisions without a choice other than waiting are skipped. Actions are numbers: 0 ends the
    decision and `1 + task * units + unit` sends a unit to a task; higher numbers announce tasks
    (with `auctions`) and send guards to wait at stations (with `relocates`).
    `info["action_mask"]`, also an observation, and `action_masks()` tell which are allowed; an
    action that is not allowed ends the decision, and `info["refused"]` is true. A value that is not
    an action raises `ValueError`.

    Observations (float32 except the mask; unused rows are 0):
        tasks: `(tasks, columns)` as in `TASK_COLUMNS`, longest reported first.
        units: `(units, columns)` as in `UNIT_COLUMNS`, guards and robots as the scenario has them.
        eta_s: `(tasks, units)`, expected time to arrival [s]; -1 for units that cannot go.
        distance_m: Path length [m], in the same form.
        bids_s: With `auctions`: bid of each unit [s]; -1 without a bid.
        cover_s: With `relocates`: `(units, stations)`, time to each station [s]; -1 if unreachable.
        bound_for: With `relocates`: `(units, stations)`, 1 for the station a guard is bound for.
        operators: `(1,)`, number of robots that can still be sent.
        time_s: `(1,)`, time since the shift began.
        action_mask: int8, 1 for each action that is allowed.

    The reward of a step is minus the minutes that events have waited during it, from the report
    until a responder arrived or the event was closed: the return of an episode is minus the sum of
    all response times. At the end `info["measures"]` has the measures of this shift in a study.

    Args:
        scenario: A scenario of the timed model by name or path.
        changes: New values by dotted key, such as `{"intensity": 6.9}`.
        tasks: Maximum number of tasks observed at a time; newer ones wait until there is room.
        preempts: True if units on their way may be sent elsewhere.
        auctions: True if tasks may be announced and bids are observed.
        relocates: True if guards may be sent to wait at stations.

    Raises:
        ConfigError: there is no such scenario, it is of another model, or not valid.
    """

    def __init__(
        self,
        scenario: str = "busy-shift",
        *,
        changes: Mapping[str, Any] | None = None,
        tasks: int = 32,
        preempts: bool = False,
        auctions: bool = False,
        relocates: bool = False,
    ) -> None:
        if tasks < 1:
            raise ConfigError(f"tasks is {tasks}; should be a whole number from 1")
        self.scenario = built = scenario_of(scenario, changes, TimedScenario, "timed")
        self._flags = {"preempts": preempts, "auctions": auctions, "relocates": relocates}
        self._tasks = tasks
        self._units = sum(group.count for group in built.responders)
        self._stations = len(built.dispatch.stations) if relocates else 0
        self._auctions = auctions
        self._announcements = 1 + tasks * self._units
        self._moves = self._announcements + (tasks if auctions else 0)
        self.action_space = cast(
            "spaces.Space[int]", spaces.Discrete(self._moves + self._units * self._stations)
        )
        self.observation_space = cast("spaces.Space[Observations]", self._space())
        self._shift: SteppedShift | None = None
        self._pieces: list[Advice] = []
        self._waiting: list[Event] = []
        self._since = 0.0

    @property
    def situation(self) -> Situation | None:
        """Situation that the DVA has to decide on, as policies see it; None between shifts."""
        return None if self._shift is None else self._shift.situation

    @property
    def policy_rng(self) -> np.random.Generator:
        """Random numbers of the shift, for policies that use them."""
        return self._running().rng

    # --- the interface of Gymnasium ------------------------------------------------------

    @override
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, Info]:
        """Begin a shift; with a seed, it is the shift of `dva-sim run` with that seed."""
        super().reset(seed=seed)
        self.close()
        shift_seed = int(self.np_random.integers(2**31)) if seed is None else seed
        self._shift = SteppedShift(self.scenario, shift_seed, **self._flags)
        self._waiting = []
        self._since = 0.0
        self._begin_decision()
        self._reward()
        return self._observe()

    @override
    def step(self, action: int) -> tuple[Observations, float, bool, bool, Info]:
        shift = self._running()
        number = self._number(action)
        piece = self._piece(number) if self._mask[number] else None
        if piece is not None:
            self._take(piece)
        if piece is None or not self._mask[1:].any():
            shift.advise(self._pieces)
            self._begin_decision()
        observations, info = self._observe()
        info["refused"] = piece is None and number != DONE
        over = shift.situation is None
        if over and shift.recording is not None:
            tables = model_for(self.scenario).rows(shift.recording)
            info["measures"] = tables["runs"][0]
        return observations, self._reward(), over, False, info

    @override
    def close(self) -> None:
        if self._shift is not None:
            self._shift.close()
            self._shift = None

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are allowed, shape `(n,)`; sb3-contrib calls this method."""
        self._running()
        return self._mask.astype(np.bool_)

    # --- actions -------------------------------------------------------------------------

    def actions_of(self, advice: Sequence[Advice]) -> list[int]:
        """Return the actions that give each piece of advice, followed by the end of the decision.

        Raises:
            ValueError: a piece has no action, such as a task beyond the observed ones.
        """
        return [*map(self._action, advice), DONE]

    def _number(self, action: object) -> int:
        """Parse an action, an integer of Python or NumPy.

        Raises:
            ValueError: it is not an action of this environment.
        """
        number = np.asarray(action)
        count = len(self._mask)
        is_whole = number.ndim == 0 and np.issubdtype(number.dtype, np.integer)
        if not is_whole or not 0 <= number < count:
            raise ValueError(f"an action is a whole number from 0 to {count - 1}, not {action!r}")
        return int(number)

    def _action(self, piece: Advice) -> int:
        if not isinstance(piece, Relocation) and piece.task >= self._tasks:
            raise ValueError(f"task {piece.task} is beyond the {self._tasks} that are seen")
        if isinstance(piece, Announcement):
            if not self._auctions:
                raise ValueError("tasks cannot be announced without auctions=True")
            return self._announcements + piece.task
        unit = self._unit_numbers[piece.responder]
        if isinstance(piece, Relocation):
            if not self._stations:
                raise ValueError("guards cannot be sent to stations without relocates=True")
            return self._moves + unit * self._stations + piece.station
        return 1 + piece.task * self._units + unit

    def _piece(self, action: int) -> Advice | None:
        """Return the advice that an action means; None ends the decision."""
        if action == DONE:
            return None
        if action < self._announcements:
            task, unit = divmod(action - 1, self._units)
            return Assignment(task, self._unit_numbers.index(unit))
        if action < self._moves:
            return Announcement(action - self._announcements)
        unit, station = divmod(action - self._moves, self._stations)
        return Relocation(self._unit_numbers.index(unit), station)

    def _take(self, piece: Advice) -> None:
        """Add a piece of advice; mask the actions that would use its unit or task again."""
        self._pieces.append(piece)
        situation = self.situation
        assert situation is not None
        if isinstance(piece, Announcement):
            self._mask[self._announcements + piece.task] = 0
            return
        responder = situation.responders[piece.responder]
        unit = self._unit_numbers[piece.responder]
        self._mask_unit(unit)
        if isinstance(piece, Assignment):
            self._mask[1 + piece.task * self._units :][: self._units] = 0  # the row of the task
            if responder.kind == "robot" and responder.engaged is None:
                self._operators -= 1
                if self._operators <= 0:
                    self._mask_idle_robots(situation)

    def _mask_unit(self, unit: int) -> None:
        """Disallow all actions of a unit: a column of the tasks' rows, and its row of stations."""
        self._mask[1 + unit : self._announcements : self._units] = 0
        first = self._moves + unit * self._stations
        self._mask[first : first + self._stations] = 0

    def _mask_idle_robots(self, situation: Situation) -> None:
        for index, responder in zip(self._unit_numbers, situation.responders, strict=True):
            if responder.kind == "robot" and responder.engaged is None:
                self._mask[1 + index : self._announcements : self._units] = 0

    # --- a decision ----------------------------------------------------------------------

    def _begin_decision(self) -> None:
        """Begin the next decision in which there is a choice."""
        self._read_situation()
        while self.situation is not None and not self._mask[1:].any():
            self._running().advise([])
            self._read_situation()

    def _read_situation(self) -> None:
        """Map the responders of the situation to units, and mark the allowed actions."""
        self._pieces = []
        situation = self.situation
        self._mask = np.zeros(self._moves + self._units * self._stations, dtype=np.int8)
        self._mask[DONE] = 1
        self._unit_numbers: list[int] = []
        self._operators = 0
        if situation is None:
            return
        # Responders are those that may be sent now; units keep their numbers all shift long.
        numbers = {device: n for n, device in enumerate(self._running().units)}
        self._unit_numbers = [numbers[responder.device] for responder in situation.responders]
        self._operators = situation.operators
        pairs = self._mask[1 : self._announcements].reshape(self._tasks, self._units)
        for row, task in enumerate(situation.tasks[: self._tasks]):
            if task.engaged is None:
                pairs[row, self._unit_numbers] = np.isfinite(situation.eta[row])
        if self._operators <= 0:
            self._mask_idle_robots(situation)
        if self._auctions:
            for row, task in enumerate(situation.tasks[: self._tasks]):
                free = task.stage == "confirm" and task.engaged is None and task.auction is None
                self._mask[self._announcements + row] = free
        if self._stations and situation.cover is not None:
            moves = self._mask[self._moves :].reshape(self._units, self._stations)
            moves[self._unit_numbers] = np.isfinite(situation.cover.eta)
            for index, bound in zip(self._unit_numbers, situation.cover.bound_for, strict=True):
                if bound is not None:
                    moves[index, bound] = 0

    def _running(self) -> SteppedShift:
        if self._shift is None:
            raise RuntimeError("no shift has begun: call reset first")
        return self._shift

    # --- observations and rewards ----------------------------------------------

    def _space(self) -> spaces.Dict:
        size = self._moves + self._units * self._stations
        shapes: dict[str, tuple[int, ...]] = {
            "tasks": (self._tasks, len(TASK_COLUMNS)),
            "units": (self._units, len(UNIT_COLUMNS)),
            "eta_s": (self._tasks, self._units),
            "distance_m": (self._tasks, self._units),
            "operators": (1,),
            "time_s": (1,),
        }
        if self._auctions:
            shapes["bids_s"] = shapes["eta_s"]
        if self._stations:
            shapes["cover_s"] = shapes["bound_for"] = (self._units, self._stations)
        boxes: dict[str, spaces.Space[Any]] = {
            name: spaces.Box(NO_END, BOUND, shape, np.float32) for name, shape in shapes.items()
        }
        return spaces.Dict({**boxes, "action_mask": spaces.MultiBinary(size)})

    def _observe(self) -> tuple[Observations, Info]:
        situation = self.situation
        observations: Observations = {
            name: np.zeros(box.shape or (), dtype=np.float32)
            for name, box in cast("spaces.Dict", self.observation_space).items()
            if name != "action_mask"
        }
        observations["action_mask"] = self._mask.copy()
        observations["time_s"][0] = self._running().now
        if situation is not None:
            self._fill(observations, situation)
        return observations, {"action_mask": observations["action_mask"]}

    def _fill(self, observations: Observations, situation: Situation) -> None:
        now = situation.now
        tasks = situation.tasks[: self._tasks]
        for row, task in enumerate(tasks):
            observations["tasks"][row] = (
                *(task.kind == kind for kind in EVENT_KINDS),
                task.stage == "contain",
                task.due,
                task.severity,
                task.confidence,
                now - task.detected,
                max(0.0, now - task.waiting_since),
                task.engaged is not None,
            )
        for index, responder in zip(self._unit_numbers, situation.responders, strict=True):
            observations["units"][index] = (
                1.0,
                responder.kind == "robot",
                responder.engaged is not None,
            )
        observations["operators"][0] = self._operators
        rows = slice(len(tasks))
        for name, values in (("eta_s", situation.eta), ("distance_m", situation.distance)):
            observations[name][:] = NO_END
            observations[name][rows, self._unit_numbers] = _bounded(values[rows])
        if self._auctions:
            observations["bids_s"][:] = NO_END
            observations["bids_s"][rows, self._unit_numbers] = _bounded(situation.bids[rows])
        if self._stations and situation.cover is not None:
            observations["cover_s"][:] = NO_END
            observations["cover_s"][self._unit_numbers] = _bounded(situation.cover.eta)
            for index, bound in zip(self._unit_numbers, situation.cover.bound_for, strict=True):
                if bound is not None:
                    observations["bound_for"][index, bound] = 1.0

    def _reward(self) -> float:
        """Return minus the minutes that events have waited since the last call."""
        shift = self._running()
        since = self._since
        waited = 0.0
        now = self._since = shift.now
        still_waiting = []
        for event in [*self._waiting, *shift.new_events()]:
            end = min(event.times.get(step, math.inf) for step in ("arrived", "closed"))
            waited += max(0.0, min(end, now) - max(since, event.times["detected"]))
            if end > now:
                still_waiting.append(event)
        self._waiting = still_waiting
        return -waited / MINUTE


def _bounded(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Replace infinity and nan by finite values."""
    return np.where(np.isfinite(values), np.minimum(values, BOUND), NO_END).astype(np.float32)


def play(env: gymnasium.Env[Observations, int], policy: Policy, seed: int) -> Info:
    """Let a policy decide a whole shift through an environment.

    Args:
        env: Environment with the options that the policy needs (`preempts`, `auctions`,
            `relocates`).
        policy: A shipped policy, or your own.

    Returns:
        The last `info`, with the measures, and `return`, the sum of all rewards.
    """
    inner = cast("DispatchEnv", env.unwrapped)
    _, info = env.reset(seed=seed)
    total = 0.0
    over = inner.situation is None
    while not over:
        assert inner.situation is not None
        advice = policy.advise(inner.situation, inner.policy_rng)
        situation = inner.situation
        actions = inner.actions_of(advice)
        for action in actions:
            if over or inner.situation is not situation:
                break  # the decision has ended early: nothing was left to decide
            _, reward, over, _, info = env.step(action)
            total += float(reward)
    return {**info, "return": total}
