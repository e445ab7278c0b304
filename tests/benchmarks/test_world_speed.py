"""What stepping the world costs: against ir-sim in the same run, and against real time.

CPU time, not wall time: others on the machine do not count.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.goals import goal

from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.lidar import Lidar
from dva_sim.worlds.physics import World, hall
from dva_sim.worlds.site import Site, load_site

DT = 0.04  # of a tick, as in every run [s]
SPEED, TURN_RATE = 0.4, 0.5  # each robot drives a circle of 0.8 m, and meets nothing
RADIUS = SPEED / TURN_RATE


def cpu_per_simulated_s(advance: Callable[[float], None], seconds: float, repeats: int) -> float:
    """CPU seconds for a simulated second, the best of a few times."""
    best = math.inf
    for _ in range(repeats):
        started = time.process_time()
        advance(seconds)
        best = min(best, (time.process_time() - started) / seconds)
    return best


# --- against ir-sim --------------------------------------------------------------------


def circles(site: Site, count: int) -> list[Pose]:
    """Where robots begin that drive circles which touch neither walls nor each other."""
    rng, middles = np.random.default_rng(1), []
    while len(middles) < count:
        x, y = site.sample_free(rng, RADIUS + 0.5)
        if all(math.dist((x, y), other) > 2 * RADIUS + 0.8 for other in middles):
            middles.append((x, y))
    return [Pose(x + RADIUS, y, math.pi / 2) for x, y in middles]


def ours(site: Site, starts: list[Pose]) -> tuple[Callable[[float], None], Callable[[], Any]]:
    """Our world, its robots told again before every tick."""
    world = World(site, DT)
    robots = [world.add_robot(f"robot-{i}", DriveSpec(), start) for i, start in enumerate(starts)]

    def advance(seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            for robot in robots:
                robot.drive(SPEED, TURN_RATE, math.inf)
            world.advance_to(world.time + DT)

    return advance, lambda: [(robot.x, robot.y) for robot in robots]


def theirs(
    site: Site, starts: list[Pose], collisions: str, folder: Path
) -> tuple[Callable[[float], None], Callable[[], Any]]:
    """The same in ir-sim: a line for each wall, discs of the same size, nothing drawn."""
    irsim = pytest.importorskip("irsim", reason="ir-sim is not installed: pip install '.[bench]'")
    xmin, ymin, xmax, ymax = site.extent
    spec, document = DriveSpec(), folder / f"{collisions}.yaml"
    lines = [f"world: {{width: {xmax - xmin + 2}, height: {ymax - ymin + 2}, step_time: {DT}, "]
    lines += [f"  sample_time: {DT}, offset: [{xmin - 1}, {ymin - 1}], "]
    lines += [f"  collision_mode: {collisions}, control_mode: auto}}", "robot:"]
    for x, y, heading in starts:
        lines += ["  - kinematics: {name: diff}", f"    state: [{x}, {y}, {heading}]"]
        lines += [
            f"    shape: {{name: circle, radius: {spec.radius}}}",
            "    goal: [1000, 1000, 0]",
        ]
        lines += [f"    mass: {spec.mass}", f"    vel_max: [{spec.max_speed}, 0.53]"]
        lines += [f"    acce: [{spec.max_acceleration}, {spec.max_turn_acceleration}]"]
    lines += ["obstacle:"]
    for x1, y1, x2, y2 in site.walls.tolist():
        vertices = f"[[{x1}, {y1}], [{x2}, {y2}]]"
        lines += [f"  - {{shape: {{name: linestring, vertices: {vertices}}}, state: [0, 0, 0]}}"]
    document.write_text("\n".join(lines))
    env = irsim.make(str(document), display=False, disable_all_plot=True, log_level="ERROR")
    robots = list(range(len(starts)))

    def advance(seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            env.step([np.array([[SPEED], [TURN_RATE]]) for _ in robots], robots)

    return advance, lambda: [tuple(robot.state[:2, 0]) for robot in env.robot_list]


@pytest.mark.filterwarnings("ignore")  # theirs
@pytest.mark.parametrize("collisions", ["stop", "contact"])
def test_ten_robots_against_ir_sim(benchmark, tmp_path, monkeypatch, collisions):
    """The same plan (the walls of caparica), the same circles, the same tick, asked every tick.

    ir-sim moves robots by velocity alone, and looks for collisions; in mode `stop` what collides
    halts, in mode `contact` it is pushed. Ours has forces, friction and contacts at all times.
    """
    monkeypatch.setenv("MPLBACKEND", "Agg")
    site = load_site("caparica")
    starts = circles(site, 10)
    their_advance, their_places = theirs(site, starts, collisions, tmp_path)
    our_advance, our_places = ours(site, starts)
    their_advance(1.0)
    our_advance(1.0)
    assert np.allclose(our_places(), their_places(), atol=0.1)  # they drive the same circles
    ratios = []
    for _ in range(5):
        their_cost = cpu_per_simulated_s(their_advance, 2.0, 3)
        ratios.append(their_cost / cpu_per_simulated_s(our_advance, 2.0, 3))
    ratio = float(np.median(ratios))
    benchmark.extra_info["ir_sim_over_ours"] = round(ratio, 1)
    print(f"\n10 robots, {len(site.walls)} walls: ir-sim ({collisions}) costs {ratio:.0f} times")
    goal("ir-sim over ours", ratio, least=25.0)
    benchmark(lambda: our_advance(1.0))


# --- against real time -----------------------------------------------------------------

ROOM, DOOR = 4.0, 1.2  # of an office [m]


def offices(across: int) -> Site:
    """A block of square offices, each with a door in the middle of every wall."""
    side, jamb, walls = across * ROOM, (ROOM - DOOR) / 2, []
    for line in range(1, across):
        at = line * ROOM
        for room in range(across):
            for low in (room * ROOM, room * ROOM + jamb + DOOR):
                walls += [(at, low, at, low + jamb), (low, at, low + jamb, at)]
    return hall(side, side, walls)


def crowd(site: Site, count: int) -> tuple[World, Callable[[float], None]]:
    """Robots that drive at top speed, and turn about somewhat else every second."""
    world, rng = World(site, DT), np.random.default_rng(1)
    while len(world.robots) < count:
        x, y = site.sample_free(rng, 0.35)
        if not world.neighbours(x, y, 0.65):
            pose = Pose(x, y, float(rng.uniform(-math.pi, math.pi)))
            world.add_robot(f"robot-{len(world.robots)}", DriveSpec(), pose)

    def advance(seconds: float) -> None:
        for _ in range(round(seconds)):
            for robot in world.robots:
                robot.drive(0.5, float(rng.uniform(-0.5, 0.5)), math.inf)
            world.advance_to(world.time + 1.0)

    return world, advance


def test_two_hundred_robots_with_lidar_in_an_office_block(benchmark):
    """36 rays at 10 Hz for each robot; CPU seconds for a simulated second."""
    world, _ = crowd(offices(20), 200)
    lidar = Lidar(world, rays=36, reach=8.0)

    def with_lidar(seconds: float) -> None:
        for _ in range(round(seconds)):
            for robot in world.robots:
                robot.drive(0.5, 0.3 * math.sin(world.time), math.inf)
            for number in range(25):  # each robot is asked at times of its own, as subscribed
                world.advance_to(world.time + DT)
                for place in range(number % 5, len(world.robots), 5):
                    lidar.read(world.robots[place])
                    lidar.read(world.robots[place - 2])

    with_lidar(2.0)
    cost = cpu_per_simulated_s(with_lidar, 3.0, 3)
    report(benchmark, "200 robots with lidar", world, cost)
    benchmark.pedantic(lambda: with_lidar(1.0), rounds=3)


@pytest.mark.parametrize("walls", ["office block", "open hall"])
def test_a_thousand_robots(benchmark, walls):
    """They move and meet; CPU seconds for a simulated second."""
    world, advance = crowd(offices(40) if walls == "office block" else hall(80.0, 80.0), 1000)
    advance(3.0)
    cost = cpu_per_simulated_s(advance, 3.0, 3)
    report(benchmark, f"1000 robots in an {walls}", world, cost)
    benchmark.pedantic(lambda: advance(1.0), rounds=3)


def report(benchmark: Any, what: str, world: World, cost: float) -> None:
    way = np.mean([robot.distance for robot in world.robots])
    met = sum(robot.contacts > 0 for robot in world.robots)
    benchmark.extra_info["times_real_time"] = round(1 / cost, 1)
    print(f"\n{what}, {len(world.site.walls)} walls: {1 / cost:.1f} times real time; ", end="")
    print(f"driven {way:.1f} m on average, {met} have met something")
    goal("CPU seconds for a simulated second", cost, most=1.0)
    assert way > 1.0
    assert met > 20
