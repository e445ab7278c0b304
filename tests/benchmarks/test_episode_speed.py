"""What a whole episode costs, against its physics and control alone in the same run."""

from __future__ import annotations

import math
import time
from typing import Any

import pytest

from dva_sim import scenario as scenarios
from dva_sim.agents.camera import Observation
from dva_sim.agents.operator.person import Population, draw_person
from dva_sim.agents.operator.strategies import Pursuit, Reach
from dva_sim.agents.steering import Route
from dva_sim.simulation import simulate
from dva_sim.simulation.field import PHYSICS_TICK
from dva_sim.simulation.stage import planner_of
from dva_sim.worlds.physics import DriveSpec, World
from dva_sim.worlds.site import load_site

GOAL = (37.3, 22.5)  # in the server room, the farthest corner


def bare_drive() -> float:
    """Physics and pursuit at 10 Hz, nothing else; returns the simulated seconds."""
    site, spec = load_site("caparica"), DriveSpec()
    world = World(site, PHYSICS_TICK)
    robot = world.add_robot("robot", spec, site.robot_bases[0])
    points = planner_of(site, spec.radius).path(robot.pose()[:2], GOAL)
    assert points is not None
    route, now = Route(points), 0.0
    driver = Pursuit(draw_person(Population(), 1, 0), Reach(spec.max_speed, spec.max_turn_rate))
    while math.dist(robot.pose()[:2], GOAL) > 1.5:
        world.advance_to(now)
        pose = robot.pose()
        seen = Observation(0, *pose, robot.speed, robot.turn_rate, ())
        intent = driver.drive(route, seen, 0.1, 1.2)
        robot.drive(intent.speed, intent.turn_rate, now + 1.0)
        now += 0.1
    return now


def cpu_per_second(run: Any) -> float:
    """CPU seconds per simulated second, the best of five."""
    best = math.inf
    for _ in range(5):
        started = time.process_time()
        simulated = run()
        best = min(best, (time.process_time() - started) / simulated)
    return best


@pytest.mark.parametrize("pattern", ["req-rep", "latest-wins"])
def test_a_one_robot_episode_against_its_physics_and_control(benchmark: Any, pattern: str) -> None:
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"pattern": pattern})
    simulate(scenario, 1)

    whole = cpu_per_second(lambda: simulate(scenario, 1).duration)
    bare = cpu_per_second(bare_drive)
    benchmark.extra_info["episode_over_physics_and_control"] = round(whole / bare, 2)
    benchmark.extra_info["simulated_s_per_cpu_s"] = round(1 / whole)
    print(f"\n{pattern}: {1 / whole:.0f} simulated s per CPU s; episode / bare {whole / bare:.1f}")
    benchmark(lambda: simulate(scenario, 1))
