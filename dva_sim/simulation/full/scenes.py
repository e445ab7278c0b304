"""Covariates of a run that are known before it begins.

The driver and the distance to the event decide much of what a run measures, and no treatment
changes them. A study that adjusts for them needs fewer runs; see `statistics.control_variates`.
"""

from __future__ import annotations

import math

from dva_sim.agents.population import draw_person
from dva_sim.kernel.streams import Streams, derive_seed
from dva_sim.simulation.full.hazards import draw_beginning
from dva_sim.simulation.full.stage import planner_of
from dva_sim.simulation.scenario import Scenario, population, robot_profiles, site_of
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import Site, load_site

SCENES = 5000
"""Beginnings over which the average is taken: about a second of CPU time, once in a process."""


def trait_off(scenario: Scenario, trait: str) -> float:
    """Return the deviation of the first operator from the population's median in a trait.

    In standard deviations of the trait's logarithm, so that the mean over all persons is zero; zero
    where persons do not differ.
    """
    operator = scenario.operator
    people = population(operator)
    person = draw_person(people, operator.population_seed, operator.person)
    law = people.traits[trait]
    value = dict(zip(people.traits, vars(person).values(), strict=False))[trait]
    return math.log(value / law.median) / law.spread if law.spread else 0.0


def way_off(scenario: Scenario, seed: int) -> float | None:
    """Return how much longer than usual the way to the first event is [m].

    As it is planned, a metre near a wall counting more. None where the way is not left to chance
    in this manner: without events or robots, where the way is given, and where bases are chosen
    for each run, as on a bare map or for more robots than a plan has bases.
    """
    is_drawn = scenario.events and scenario.robot.count and scenario.robot.way_m is None
    if not is_drawn or scenario.site.map is not None:
        return None
    site = site_of(scenario, seed)
    if site is not load_site(scenario.site.name, scenario.site.options):
        return None
    planner = planner_of(site, robot_profiles(scenario)[0].drive_spec().radius)
    event = scenario.events[0].model_dump_json()
    usual = site.kept(("usual way", planner, event), lambda: _usual_way(scenario, site, planner))
    off = _way(scenario, seed, site, planner) - usual
    return off if math.isfinite(off) else None


def _usual_way(scenario: Scenario, site: Site, planner: Planner) -> float:
    """Return the mean over many starts."""
    seeds = (derive_seed("usual way", number) for number in range(SCENES))
    return math.fsum(_way(scenario, seed, site, planner) for seed in seeds) / SCENES


def _way(scenario: Scenario, seed: int, site: Site, planner: Planner) -> float:
    base = site.robot_bases[0]
    _, place = draw_beginning(scenario.events[0], site, Streams(seed), 1)
    return planner.cost((base.x, base.y), place)
