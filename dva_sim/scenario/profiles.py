"""The site and the profiles that a scenario names."""

from __future__ import annotations

from functools import cache

from dva_sim import resources
from dva_sim.agents.operator.person import Population
from dva_sim.agents.people import BystanderProfile, GuardProfile
from dva_sim.agents.profile import RobotProfile, load_robot
from dva_sim.agents.tilt.phone import PhoneProfile
from dva_sim.config import Config, M, load_yaml, validate
from dva_sim.scenario.scenario import Scenario
from dva_sim.worlds.site import Site, load_site, map_site


def site_of(scenario: Scenario, seed: int) -> Site:
    """The site a scenario plays on; a bare map places its bases by `seed`."""
    if scenario.site.map is None:
        return load_site(scenario.site.name, scenario.site.options)
    team = max(1, scenario.robot.count), max(1, scenario.guard.count)
    return map_site(scenario.site.map, seed, robots=team[0], guards=team[1])


def robot_profiles(scenario: Scenario) -> list[RobotProfile]:
    """What the scenario's robots are, one after the other."""
    named = scenario.robot.profile
    names = (named,) if isinstance(named, str) else named
    kinds = [load_robot(name) for name in names]
    return [kinds[number % len(kinds)] for number in range(scenario.robot.count)]


def phone_profile(scenario: Scenario) -> PhoneProfile:
    """The tilt phone the operators hold."""
    return _profile(PhoneProfile, scenario.profile, "agents/phones")


def guard_profile(scenario: Scenario) -> GuardProfile:
    """How the scenario's guards are drawn."""
    return _profile(GuardProfile, scenario.guard.profile, "agents/people")


def bystander_profile(scenario: Scenario) -> BystanderProfile:
    """How the scenario's bystanders are drawn."""
    return _profile(BystanderProfile, scenario.bystander.profile, "agents/people")


def population(scenario: Scenario) -> Population:
    """The population that the scenario's operators are drawn from."""
    return _profile(Population, scenario.operator.population, "agents/people")


def _profile(model: type[M], name: str, folder: str) -> M:
    profile = _read_profile(model, name, folder)
    assert isinstance(profile, model)
    return profile


@cache
def _read_profile(model: type[Config], name: str, folder: str) -> Config:
    """A profile, read once per process: reading costs more than a short run."""
    document = load_yaml(resources.find(name, folder))
    return validate(model, document.data, document.error)
