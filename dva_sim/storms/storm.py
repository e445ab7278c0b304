"""Storm: a run in virtual time, its faults, and the verdicts of the checkers."""

from __future__ import annotations

import hashlib
import random
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from typing_extensions import override

from dva_sim.agents.robot.command_queue import PER_CONNECTION
from dva_sim.kernel.recorder import Accepted
from dva_sim.simulation.full.observations import RobotMotion, motion_of
from dva_sim.simulation.full.physical_world import PHYSICS_TICK
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.storms.checkers import (
    AnswerWatch,
    RefusedDrivers,
    count_waiting,
    is_waiting,
    oversized,
)
from dva_sim.storms.faults import FAULTS
from dva_sim.storms.interference import PassingMessage
from dva_sim.storms.outcome import StormOutcome
from dva_sim.storms.plan import Fault, StormPlan
from dva_sim.storms.recovery import RecoveryProbes
from dva_sim.storms.regional_storm import RegionalStorm
from dva_sim.storms.scene import StormScene

LOOK_AT_BOUNDS = 30.0  # interval at which all containers are counted [s]
HEARTBEAT = b"<HBMsg>"
QUIET = HEARTBEAT, b"<RobotStatus>"  # messages that only show that a device is present
SILENCED = frozenset(
    {"robot-hangs", "robot-without-power", "robot-restarts", "replies-lost", "vanishes"}
    | {"dva-silent", "messages-lost", "partition", "frozen"}
)
"""Faults after which requests may stay unanswered."""


class Storm(StormScene):
    """A run that a plan's faults strike.

    Args:
        plan: The storm.
        folder: Folder of the DVA's memory.

    Attributes:
        begun: Number of faults that have struck, by kind.
    """

    def __init__(self, plan: StormPlan, folder: Path) -> None:
        super().__init__(plan, folder)
        run = self.run
        clock = self.run.clock
        labels = run.stage.labels
        people = *self.guards, *self.operators
        nodes = {node: labels[node] for node in (DVA, *(r.id for r in self.robots), *people)}
        self._refused = RefusedDrivers(self.recorder, labels, frozenset(self.operators))
        self._answers = AnswerWatch(
            self.recorder, lambda: clock.now, nodes, self.answered, self._waits
        )
        run.network.taps |= {node: self._answers.tap(node) for node in nodes}
        self._nodes = frozenset(nodes)
        self._recovery = RecoveryProbes(
            run.stage, self.recorder, self._motion, plan.calm_s, self.releaser
        )
        self._digest = hashlib.blake2b(digest_size=12)
        self.begun: Counter[str] = Counter()
        run.observe(_Witness(self))
        clock.every(PHYSICS_TICK, run.show_motions)
        clock.every(1.0, self._answers.look)
        clock.every(LOOK_AT_BOUNDS, self._look_at_bounds)
        clock.every(1.0, self._look_at_queues)
        for fault in plan.faults:
            clock.call_at(fault.at_s, self._await, fault)
        robots = [robot.id for robot in self.robots]
        others = (*self.guards, *self.operators)
        self._recovery.begin(robots, others, self.free_place(_chance(plan)))

    def play(self, enough: Callable[[], bool] = lambda: False) -> StormOutcome:
        """Let the storm pass, and judge it.

        Args:
            enough: Function that returns True once a broken rule ends the storm.
        """
        began = time.process_time()
        now = 0.0
        end = self.plan.horizon_s
        while now < end and not (self.recorder.broken and enough()):
            now = min(now + 1.0, end)
            self.dva.survive(now)
            if now == end:
                end = self._recovery.due()
        if now == end:
            self._recovery.end()
        self._look_at_bounds()
        return StormOutcome(
            seed=self.plan.seed,
            breaches=list(self.recorder.broken.values()),
            faults=self.begun,
            messages=self.interference.counts,
            simulated_s=self.run.clock.now,
            cpu_s=time.process_time() - began,
            digest=self._digest.hexdigest(),
        )

    # --- faults ------------------------------------------------------------------------------

    def _await(self, fault: Fault) -> None:
        if not fault.on:
            self._begin(fault)
            return
        # A message that never comes is awaited no longer than the storm lasts.
        waits = [True]
        kind = fault.target.partition("-*")[0]
        is_any = fault.target.endswith("-*")
        to = id_of(kind, 1)[: len("02:00:00:01")] if is_any else self.id_of(fault.target)

        def begin(node: str) -> None:
            if waits[0] and self.now + fault.for_s <= self.plan.calm_s:
                target = self.run.stage.labels[node] if is_any else fault.target
                self._begin(replace(fault, target=target))

        self.interference.await_message(fault.on, to, begin)
        self.run.clock.call_at(self.plan.calm_s, waits.__setitem__, 0, False)

    def _begin(self, fault: Fault) -> None:
        self.begun[fault.kind] += 1
        what = f"{fault.kind} {fault.source and fault.source + ' to '}{fault.target}"
        self.recorder.tell(self.now, "storm", what, "fault")
        node = self.id_of(fault.target)
        is_silenced = fault.kind in SILENCED
        if is_silenced:
            self._excuse(node, True)
        ends = FAULTS[fault.kind].begin(self, fault, _chance(self.plan, fault))
        if ends is not None:
            # Containers are counted right before the end, when they are fullest.
            self.run.clock.call_after(fault.for_s, self._look_at_bounds)
            self.run.clock.call_after(fault.for_s, ends)
        if is_silenced:
            # A second later: what was under way when the fault ended may be lost with it.
            self.run.clock.call_after(fault.for_s + 1.0, self._excuse, node, False)

    def _excuse(self, node: str, excused: bool) -> None:
        for each in (node,) if node else self._nodes:
            self._answers.excuse(each, excused)

    # --- what is seen --------------------------------------------------------------------------

    @override
    def arrives(self, passing: PassingMessage) -> None:
        self._refused.arrives(self.now, passing)
        self._answers.watch(passing)
        if passing.to != DVA:
            return
        if HEARTBEAT in passing.payload:
            self._recovery.beats(self.now, passing.source)
        if not any(quiet in passing.payload for quiet in QUIET):
            self.run.show_page()

    @override
    def dva_is_down(self, is_down: bool) -> None:
        self._excuse(DVA, is_down)
        self.run.audit.kept_nothing_for(self.dva.lost)

    def _motion(self, robot: str) -> Any:
        return motion_of(self.run.field.robots[robot])

    def _look_at_bounds(self) -> None:
        robots = [robot.agent for robot in self.robots]
        team = {*self.guards, *self.operators}
        devices = self.run.stage.devices
        devices_of_team = [device for device in devices if device.id_tag in team]
        ours = {DVA, *(robot.id for robot in self.robots), *team}
        left_out = [device for device in devices if device.id_tag not in ours]
        events = self.run.dva.core.events.total
        for name, size, bound in oversized(
            [self.run.dva, *robots, *devices_of_team], events, left_out
        ):
            what = f"{name} holds {size}, more than {bound}"
            self.recorder.violated("S10", self.now, "dva" if "Dva" in name else "robots", what)

    def _waits(self, node: str, data: bytes) -> bool:
        inboxes = (robot.agent.inbox for robot in self.robots if robot.id == node)
        return any(is_waiting(inbox, data) for inbox in inboxes)

    def _look_at_queues(self) -> None:
        stranger = self.flooder.device.id_tag
        for robot in self.robots:
            waits = count_waiting(robot.agent.inbox, stranger)
            if waits > PER_CONNECTION:
                what = f"lets {waits} messages of a stranger wait, more than {PER_CONNECTION}"
                self.recorder.violated("S10", self.now, robot.agent.device.label, what)

    def sent(self, now: float, source: str, to: str, payload: Any) -> None:
        """Note what was sent."""
        if not isinstance(payload, bytes):
            return
        self._refused.sent(now, source, to, payload)
        self._digest.update(f"{now:.6f} {source} {to} ".encode() + payload)
        self.note_session(source, to, payload)

    def accepted(self, command: Accepted) -> None:
        """Note that a robot obeys."""
        self._recovery.accepted(command)

    def moves(self, now: float, motions: Mapping[str, RobotMotion]) -> None:
        """Note which robots go somewhere."""
        self._recovery.moves(now, motions)


class _Witness:
    """Observer that passes messages, commands and motion on to the storm; see `Observer`."""

    def __init__(self, storm: Storm) -> None:
        self.sent = storm.sent
        self.accepted = storm.accepted
        self.moves = storm.moves

    def _nothing(self, *_: object) -> None:
        """Ignore the observation."""

    delivered = by_hand = shows = deafened = slowed = _nothing


def _chance(plan: StormPlan, fault: Fault | None = None) -> random.Random:
    """Return the random numbers of one fault, the same whatever other faults there are."""
    return random.Random(f"{plan.seed} {fault!r}")


def play(
    plan: StormPlan,
    before: Callable[[Any], object] = lambda _: None,
    enough: Callable[[], bool] = lambda: False,
) -> StormOutcome:
    """Play a storm of one team, or of several DVAs, to its end, whatever happens.

    Args:
        plan: The storm.
        before: Callback with the storm before it begins.
        enough: See `Storm.play`.
    """
    with tempfile.TemporaryDirectory(prefix="dva-storm-") as folder:
        several = bool(plan.scenario.get("dva", {}).get("regions"))
        storm = RegionalStorm(plan) if several else Storm(plan, Path(folder))
        before(storm)
        try:
            return storm.play(enough)
        except MemoryError:
            raise  # this machine is at fault, not the storm
        except Exception:
            return StormOutcome(
                plan.seed,
                list(storm.recorder.broken.values()),
                traceback.format_exc(),
                storm.begun,
                storm.interference.counts,
                storm.now,
            )
