"""A fault in what every run is made of turns verdicts that hold into misses."""

from collections.abc import Callable

import pytest

from dva_sim.agents.robot.command_queue import CommandQueue
from dva_sim.network.messaging import Requester
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.validation.network import comparison
from dva_sim.validation.network.comparison import NetworkSetting, compare
from dva_sim.validation.network.reference import load_plan, load_runs
from dva_sim.validation.network.verdicts import grouped

ASKS, ASKS_SLOW = "req10_d100_j0_l0_r0_p5_T2500", "req10_d0_j0_l0_r0_p3000_T2500"
PUBLISHES = "pub50_d100_j0_l0_r0_p100"
KEEPS_ASKING = "dealer20_d150_j0_l0_r0_p20"
LOSES = "req10_d100_j0_l10_r0_p5_T1000"
LABELS = ASKS, ASKS_SLOW, PUBLISHES, KEEPS_ASKING


def connects_for_each_request(patch: pytest.MonkeyPatch) -> None:
    fill = Requester._fill

    def anew(self: Requester) -> None:
        self._disconnect()
        fill(self)

    patch.setattr(Requester, "_fill", anew)


def waits_twice_as_long(patch: pytest.MonkeyPatch) -> None:
    make = Requester.__init__

    def patient(self: Requester, network, node, peer, timeout, *more, **named) -> None:
        make(self, network, node, peer, 2 * timeout, *more, **named)

    patch.setattr(Requester, "__init__", patient)


def gives_up_after_one_attempt(patch: pytest.MonkeyPatch) -> None:
    make = Requester.__init__

    def hasty(self: Requester, network, node, peer, timeout, *_, window=1, **__) -> None:
        make(self, network, node, peer, timeout, 1, window)

    patch.setattr(Requester, "__init__", hasty)


def works_twice_as_fast(patch: pytest.MonkeyPatch) -> None:
    begin = CommandQueue._begin

    def half(self: CommandQueue, letters) -> bool:
        whole = self.service
        self.service = lambda: 0.5 * whole()
        try:
            return begin(self, letters)
        finally:
            self.service = whole

    patch.setattr(CommandQueue, "_begin", half)


def publishes_twice(patch: pytest.MonkeyPatch) -> None:
    publish = VirtualNetwork.publish

    def doubled(self: VirtualNetwork, *given) -> None:
        publish(self, *given)
        publish(self, *given)

    patch.setattr(VirtualNetwork, "publish", doubled)


FAULTS: list[tuple[Callable[[pytest.MonkeyPatch], None], tuple[str, ...]]] = [
    (connects_for_each_request, (ASKS, KEEPS_ASKING)),
    (waits_twice_as_long, (ASKS_SLOW,)),
    (gives_up_after_one_attempt, (ASKS_SLOW,)),
    (works_twice_as_fast, (ASKS_SLOW, PUBLISHES, KEEPS_ASKING)),
    (publishes_twice, (PUBLISHES,)),
]


def misses() -> dict[str, int]:
    """Values outside their bands, by condition, of four that nothing random decides."""
    runs = [r for r in load_runs(load_plan().sources) if r.condition.label in LABELS]
    found = compare(grouped(runs), NetworkSetting(quick=True))
    known = {group.condition.label for group in found.groups}
    assert known == set(LABELS)
    return {
        label: sum(
            v.word == "outside" for v in found.verdicts if v.cell.group.condition.label == label
        )
        for label in LABELS
    }


def test_without_a_fault_all_lie_inside():
    assert misses() == dict.fromkeys(LABELS, 0)


@pytest.mark.parametrize(("plant", "where"), FAULTS, ids=lambda one: getattr(one, "__name__", ""))
def test_a_planted_fault_is_found_where_it_acts(plant, where, monkeypatch):
    plant(monkeypatch)
    found = misses()
    assert [label for label in LABELS if found[label]] == list(where)


def test_a_requester_that_never_retries_misses_what_was_measured_under_loss(monkeypatch):
    """One packet in ten is lost, and a second's patience is five round trips."""
    monkeypatch.setattr(comparison, "QUICK_RUNS", 12)
    monkeypatch.setattr(comparison, "QUICK_CONTROL_RUNS", 2)
    runs = [r for r in load_runs(load_plan().sources) if r.condition.label == LOSES]

    def significant() -> set[str]:
        found = compare(grouped(runs), NetworkSetting(quick=True))
        return {scored.cell.measure.name for scored in found.pooled.significant}

    assert significant() == set()
    gives_up_after_one_attempt(monkeypatch)
    assert significant() >= {"alerts", "delivered"}
