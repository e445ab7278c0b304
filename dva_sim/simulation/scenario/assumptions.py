"""Every assumed number of the program: which key sets it, its band, and why it is that one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from dva_sim.agents.people.profiles import BystanderProfile, GuardProfile
from dva_sim.agents.population import Population
from dva_sim.kernel.assumed import Assumption, assumptions_in
from dva_sim.kernel.config import Config
from dva_sim.simulation.scenario.scenario import Scenario

_PROFILES: dict[str, type[Config]] = {
    "operator": Population,
    "guard": GuardProfile,
    "bystander": BystanderProfile,
}
"""Profiles by the part of a scenario that changes their medians."""


def all_assumptions() -> list[Assumption]:
    """Return traits of operators first, then all habits and parts, in the order of a scenario."""
    of_persons = [
        each
        for whose, model in _PROFILES.items()
        for each in assumptions_in(model, f"{whose}.traits.", depth=1)
    ]
    return of_persons + list(assumptions_in(Scenario))


def as_json() -> list[dict[str, object]]:
    """Return the list for other programs."""
    return [{**vars(each), "unit": each.unit} for each in all_assumptions()]


def lines() -> Iterator[str]:
    """Yield the list for people, one line for each number."""
    for group, members in groupby(all_assumptions(), lambda each: each.key.rpartition(".")[0]):
        yield group
        for each in members:
            name = each.key.rpartition(".")[2]
            unit = f" {each.unit}" if each.unit else ""
            value = f"{each.default:g}{unit}  [{each.low:g}, {each.high:g}]"
            yield f"  {name:<22} {value:<32} {each.why}".rstrip()
