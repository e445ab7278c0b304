"""Storms of several DVAs: honest ones break no rule, and each planted bug is found."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from dva_sim.core.regions.division import Division
from dva_sim.core.regions.regional_dva import RegionalDva
from dva_sim.core.regions.strays import Strays
from dva_sim.core.regions.takeover import Deputy
from dva_sim.core.sessions import DvaAnswer
from dva_sim.simulation.full.regional_agent import RegionalDvaAgent
from dva_sim.storms.campaign import REGIONS, drawn
from dva_sim.storms.plan import load_plan
from dva_sim.storms.regional_storm import KILLED, LASTS, draw_regions
from dva_sim.storms.storm import play

Patch = pytest.MonkeyPatch


def test_the_same_seed_gives_the_same_storm_of_several_dvas():
    plan = draw_regions(3)
    assert draw_regions(3) == plan
    assert drawn(3, REGIONS) == plan
    briefly = replace(plan, calm_s=25.0 - LASTS)
    one, other = play(briefly), play(briefly)
    assert one.digest == other.digest
    assert one.is_clean, one.breaches


def test_a_plan_of_several_dvas_is_read_from_its_file(tmp_path):
    plan = next(p for p in map(draw_regions, range(1, 20)) if p.faults[0].kind == KILLED)
    file = tmp_path / "plan.yaml"
    file.write_text(plan.text())
    assert load_plan(file) == plan


# --- planted bugs ----------------------------------------------------------------------------


def keeps_no_copy(patch: Patch) -> None:
    patch.setattr(Deputy, "keep", lambda *_: DvaAnswer())


def returns_no_copy(patch: Patch) -> None:
    patch.setattr(Deputy, "return_copies", lambda *_: [])


def says_copied_without_a_copy(patch: Patch) -> None:
    patch.setattr(RegionalDvaAgent, "_held_back", lambda self, request, message, reply: reply)
    patch.setattr(RegionalDva, "replica_of", lambda *_: None)


def strays_go_untold(patch: Patch) -> None:
    honest = Strays.pass_on

    def pass_on(self: Strays, now: float) -> Any:
        return [send for one in honest(self, now) for send in self.taken(one, now)]

    patch.setattr(Strays, "pass_on", pass_on)


def hears_of_no_epoch(patch: Patch) -> None:
    honest = Division.learn

    def learn(self: Division, region: str, claim: Any) -> bool:
        return claim.dva == self.own and honest(self, region, claim)

    patch.setattr(Division, "learn", learn)


def never_takes_over(patch: Patch) -> None:
    patch.setattr(Deputy, "_has_come", lambda *_: False)


BUGS: tuple[Callable[[Patch], None], ...] = (
    *(keeps_no_copy, returns_no_copy, says_copied_without_a_copy),
    *(strays_go_untold, hears_of_no_epoch, never_takes_over),
)


@pytest.mark.soak
@pytest.mark.parametrize("bug", BUGS)
def test_a_planted_bug_is_found_within_thirty_storms(bug, monkeypatch):
    bug(monkeypatch)
    outcomes = (play(draw_regions(seed), enough=lambda: True) for seed in range(1, 31))
    assert any(not outcome.is_clean for outcome in outcomes)
