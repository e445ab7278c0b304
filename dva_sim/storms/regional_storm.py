"""Storm of several DVAs: kills, partitions and bad links between them, and the verdict.

It is smaller than a storm of one team: it strikes messages among DVAs and to their devices. S1 to
S7 and S12 to S15 are judged as in any run, and S8 at the end.
"""

from __future__ import annotations

import hashlib
import random
import time
from collections import Counter
from collections.abc import Callable
from typing import Any, Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol import messages as m
from dva_sim.protocol.exchange import NOON
from dva_sim.simulation.full.observations import page_of
from dva_sim.simulation.full.run import Run, Watched
from dva_sim.simulation.full.stage import id_of
from dva_sim.storms.faults import FAULTS
from dva_sim.storms.interference import Interference, PassingMessage
from dva_sim.storms.outcome import StormOutcome
from dva_sim.storms.plan import Fault, StormPlan

CALM: Final = 240.0  # end of the last fault [s]
LASTS: Final = 120.0  # time from then to the end of the storm [s]
FIRST: Final = 10.0  # earliest start of a fault [s]
KILLED: Final = "region-killed"
ASKS_AFTER: Final = 3.0  # time from the supervisor's registration to its request [s]
REGION_ALONE: Final = "region-alone"  # a DVA reaches detectors and nobody else
RETURNED: Final = "region-given-back"  # a supervisor requests it
KINDS: Final = (
    KILLED,
    REGION_ALONE,
    "partition",
    "messages-lost",
    "messages-late",
    "messages-doubled",
)
_WEIGHTS: Final = (3.0, 2.0, 2.0, 1.0, 1.5, 1.0)
_BACKBONES: Final = (None, {"delay_s": 0.05}, {"delay_s": 0.3, "jitter_s": 0.1, "loss": 0.05})
_HALL: Final = (60.0, 40.0)  # extent of the site [m]


def draw_regions(seed: int) -> StormPlan:
    """Draw a storm of a hall with two to four regions."""
    chance = random.Random(f"regional storm {seed}")
    count = chance.choice((2, 2, 3, 4))
    width, depth = _HALL
    regions: dict[str, Any] = {}
    for number in range(count):
        west = width * number / count
        east = width * (number + 1) / count
        corners = [[west, 0.0], [east, 0.0], [east, depth], [west, depth]]
        regions[f"part-{number + 1}"] = {"polygon": corners}
    robots = chance.choice((0, 2, 4))
    scenario: dict[str, Any] = {
        "site": {"name": "hall"},
        "robot": {"count": robots},
        "guard": {"count": 2, "mobilisation_s": chance.choice((15.0, 60.0))},
        "operator": {"count": min(robots, chance.choice((1, 2, 3)))},
        "control": chance.choice(("direct", "supervisory")),
        "link": {"delay_s": chance.choice((0.005, 0.05, 0.2))},
        "dva": {
            "regions": regions,
            "backbone": chance.choice(_BACKBONES),
            "control_rooms": {"control-room-1": "supervise"},
        },
        "events": [_event(chance) for _ in range(chance.randint(2, 8))],
    }
    labels = [f"dva-{name}" for name in regions]
    devices = ["guard-1", "guard-2", *(f"robot-{n + 1}" for n in range(robots))]
    faults = [_fault(chance, labels, devices) for _ in range(chance.randint(1, 8))]
    faults += [_return(chance, fault) for fault in faults if fault.kind == KILLED]
    return StormPlan(seed, scenario, tuple(sorted(faults, key=lambda f: f.at_s)), CALM)


def _event(chance: random.Random) -> dict[str, Any]:
    x = round(chance.uniform(4.0, _HALL[0] - 4.0), 1)
    y = round(chance.uniform(4.0, _HALL[1] - 4.0), 1)
    return {
        "kind": chance.choice(("fire", "gas_leak", "flood")),
        "position": [x, y],
        "at_s": round(chance.uniform(2.0, CALM - 20.0), 1),
        "reported": True,
        "false_alarm": chance.random() < 0.2,
    }


def _return(chance: random.Random, killed: Fault) -> Fault:
    """Draw a moment at which the region of a DVA that was killed is given back."""
    back_s = killed.at_s + killed.value + chance.uniform(1.0, 60.0)
    return Fault(RETURNED, round(min(back_s, CALM), 3), target=killed.target)


def _fault(chance: random.Random, dvas: list[str], devices: list[str]) -> Fault:
    (kind,) = chance.choices(KINDS, _WEIGHTS)
    target = chance.choice(dvas)
    at_s = round(chance.uniform(FIRST, CALM - 60.0), 3)
    if kind == KILLED:
        return Fault(kind, at_s, target=target, value=round(chance.uniform(2.0, 55.0), 3))
    if kind == REGION_ALONE:
        return Fault(kind, at_s, for_s=round(chance.uniform(12.0, 55.0), 3), target=target)
    source = chance.choice([*(dva for dva in dvas if dva != target), *devices])
    if chance.random() < 0.5:
        source, target = target, source
    value = round(chance.uniform(*FAULTS[kind].value), 3)
    lasts = round(chance.uniform(3.0, 55.0), 3)
    return Fault(kind, at_s, for_s=lasts, target=target, source=source, value=value)


class RegionalStorm:
    """Run of several DVAs that a plan's faults strike.

    Args:
        plan: The storm.

    Attributes:
        run: The run.
        recorder: Recorder of the run.
        interference: Control over the delivery of messages.
        begun: Number of faults that have struck, by kind.
    """

    def __init__(self, plan: StormPlan) -> None:
        self.plan = plan
        self.recorder = Recorder(False)
        clock = Clock()
        watched = Watched(clock, self.recorder, time_of_day=(NOON, True), keeps=False)
        self.run = Run(plan.built(), plan.seed, watched=watched)
        self.interference = Interference(clock, self._arrives)
        assert isinstance(self.run.network, VirtualNetwork)
        self.run.network.interference = self.interference
        supervisor = ControlRoomAgent(self.run.stage.device("control-room", 1))
        supervisor.start()
        self._supervisor = supervisor.device
        self.begun: Counter[str] = Counter()
        self._digest = hashlib.blake2b(digest_size=12)
        for fault in plan.faults:
            clock.call_at(fault.at_s, self._begin, fault)

    @property
    def now(self) -> float:
        """Time [s]."""
        return self.run.clock.now

    def id_of(self, label: str) -> str:
        """Return the id of a device by its label; an empty label has none."""
        labels = self.run.stage.labels
        return (
            next(id_tag for id_tag, device_label in labels.items() if device_label == label)
            if label
            else ""
        )

    def play(self, enough: Callable[[], bool] = lambda: False) -> StormOutcome:
        """Let the storm pass, and judge it.

        Args:
            enough: Function that returns True once a broken rule ends the storm.
        """
        began = time.process_time()
        end = self.plan.calm_s + LASTS
        while self.now < end and not (self.recorder.broken and enough()):
            self.run.clock.run(min(self.now + 1.0, end))
        if self.now >= end:
            self._judge_recovery()
        return StormOutcome(
            seed=self.plan.seed,
            breaches=list(self.recorder.broken.values()),
            faults=self.begun,
            messages=self.interference.counts,
            simulated_s=self.now,
            cpu_s=time.process_time() - began,
            digest=self._digest.hexdigest(),
        )

    def _arrives(self, passing: PassingMessage) -> None:
        passing.take(passing.payload)
        if isinstance(passing.payload, bytes):
            self._digest.update(f"{self.now:.6f} {passing.source} {passing.to} ".encode())
            self._digest.update(passing.payload)

    def _begin(self, fault: Fault) -> None:
        self.begun[fault.kind] += 1
        what = f"{fault.kind} {fault.source and fault.source + ' to '}{fault.target}"
        self.recorder.tell(self.now, "storm", what, "fault")
        clock = self.run.clock
        if fault.kind == KILLED:
            number = int(fault.target.rpartition("-")[2])
            if not self.run.dvas[id_of("dva", number)].is_gone:
                self.run.end_dva(number)
                clock.call_after(fault.value, self.run.start_region_again, number)
            return
        if fault.kind == REGION_ALONE:
            clock.call_after(fault.for_s, self._cut_off(self.id_of(fault.target)))
            return
        if fault.kind == RETURNED:
            self._give_back(fault.target.removeprefix("dva-"))
            return
        chance = random.Random(f"{self.plan.seed} {fault!r}")
        scene: Any = self  # faults of messages need its interference and its labels
        ends = FAULTS[fault.kind].begin(scene, fault, chance)
        if ends is not None:
            clock.call_after(fault.for_s, ends)

    def _give_back(self, region: str) -> None:
        """Let the supervisor register with the DVA that serves a region, and ask for its return."""
        supervisor = self._supervisor
        there = (dva for dva in self.run.dvas.values() if not dva.is_gone)
        serves = next((dva for dva in there if region in page_of(dva).served), None)
        if serves is not None:
            supervisor.turn_to(serves.device.id_tag)
            ask = m.GiveBack(region)
            self.run.clock.call_after(ASKS_AFTER, supervisor.ask, serves.device.id_tag, ask)

    def _cut_off(self, dva: str) -> Callable[[], object]:
        """Cut a DVA off from all but detectors, both ways; return a function that ends that."""
        detectors = id_of("detector", 1)[: len("02:00:00:04")]
        rules = self.interference.rules

        def meets(passing: PassingMessage) -> bool:
            ends = passing.source, passing.to
            lost = dva in ends and not any(end.startswith(detectors) for end in ends)
            self.interference.counts[REGION_ALONE] += lost
            return lost

        rules.append(meets)
        return lambda: rules.remove(meets)

    def _judge_recovery(self) -> None:
        """Report what has not recovered (S8): regions without one DVA, devices without any."""
        run = self.run
        served = [region for dva in run.dvas.values() for region in page_of(dva).served]
        for region in run.scenario.dva.regions:
            if served.count(region) != 1:
                what = f"{served.count(region)} DVAs serve {region}"
                self.recorder.violated("S8", self.now, region, what)
        field = run.field
        agents = [*field.robots.values(), *field.guards]
        for device in (agent.device for agent in agents):
            entry = run.dvas[device.dva].core.registry.entries.get(device.id_tag)
            if entry is None or entry.silent:
                what = f"does not hear {device.label}, which is registered with it"
                label = run.dvas[device.dva].device.label
                self.recorder.violated("S8", self.now, label, what)
