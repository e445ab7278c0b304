"""The fixed list of what is counted.

Each case is prepared once, done once to warm up, and then measured. What it imports is imported
when it is prepared: a version that does not have it yet lacks this case alone.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.message_cases import called, hop, published, stored

Work = Callable[[], float]
"""Does it, and returns how many units it has done."""

ADVISERS = ("min_eta", "batch_optimal")
PATTERNS = ("req-rep", "pipelined", "pub-sub", "latest-wins")
FAR = {"link.delay_s": 0.25}
MAIN = "drive-to-event, latest-wins"
LOOP = "a fixed loop"
SECOND, RUN, MESSAGE = "simulated s", "run", "message"


@dataclass(frozen=True)
class Case:
    """Benchmark case.

    Attributes:
        per: Unit in which its work is reported.
        prepare: Makes everything ready; returns the work.
        takes_long: Under callgrind, minutes: it is counted there only if it is named.
        optional: It measures another program, which may not be there.
    """

    per: str
    prepare: Callable[[], Work]
    takes_long: bool = False
    optional: bool = False


# --- the loop that budgets are ratios to ---------------------------------------------------------


class Particle:
    """Point that a spring pulls to the origin."""

    def __init__(self, place: float) -> None:
        self.place, self.speed = place, 0.0

    def move(self, dt: float) -> float:
        """Advance by a time step [s]; returns the energy."""
        self.speed -= self.place * dt
        self.place += self.speed * dt
        return 0.5 * (self.place * self.place + self.speed * self.speed)


def fixed_loop() -> Work:
    """Plain Python that never changes: calls, attributes, floats, lists, dictionaries and text."""

    def loop() -> float:
        particles = [Particle(0.1 * number) for number in range(20)]
        largest: dict[str, float] = {}
        for step in range(400):
            energies = [particle.move(0.01) for particle in particles]
            name = f"step {step % 7}"
            largest[name] = max(largest.get(name, 0.0), *sorted(energies)[-5:])
        return len([largest])

    return loop


# --- runs --------------------------------------------------------------------------------------


def built(scenario: str, changes: dict[str, Any]) -> Any:
    from dva_sim.simulation import scenario as scenarios

    return scenarios.build(scenarios.load(scenario), changes)


def run(scenario: str, **changes: Any) -> Work:
    """A run of the scenario whose site, files and plans are known already."""
    from dva_sim.simulation.full import simulate

    made = built(scenario, changes)
    return lambda: simulate(made, 1).duration


def new_seed(scenario: str, **changes: Any) -> Work:
    """Runs of which each has a seed of its own, so that each has to plan."""
    from dva_sim.simulation.full import simulate

    made, seeds = built(scenario, changes), iter(range(1, 1000))
    return lambda: simulate(made, next(seeds)).duration


def replayed() -> Work:
    """Repeat an operator's messages at the same moments, without looking."""
    from helpers.network.replaying_operator import replay, taped

    made = built("drive-to-event", {"pattern": "latest-wins", **FAR})
    tape, _ = taped(made, 1)
    return lambda: replay(made, 1, tape).duration


def physics_and_control() -> Work:
    """Run the same world with path pursuit ten times a second, and nothing else."""
    from dva_sim.agents.observation import Observation
    from dva_sim.agents.operator.strategies import Pursuit, Reach, View
    from dva_sim.agents.population import Population, draw_person
    from dva_sim.agents.route_following import Route
    from dva_sim.simulation.full.physical_world import PHYSICS_TICK
    from dva_sim.simulation.full.stage import planner_of
    from dva_sim.worlds.drives import DriveSpec
    from dva_sim.worlds.physics import World
    from dva_sim.worlds.site import load_site

    site, spec, goal = load_site("caparica"), DriveSpec(), (37.3, 22.5)
    person = draw_person(Population(), 1, 0)

    def drive() -> float:
        world, now = World(site, PHYSICS_TICK), 0.0
        robot = world.add_robot("robot", spec, site.robot_bases[0])
        points = planner_of(site, spec.radius).path(robot.pose()[:2], goal)
        assert points is not None
        route = Route(points)
        driver = Pursuit(person, Reach(spec.max_speed, spec.max_turn_rate))
        while math.dist(robot.pose()[:2], goal) > 1.5:
            world.advance_to(now)
            seen = Observation(0, *robot.pose(), robot.speed, robot.turn_rate, ())
            intent = driver.drive(route, View(now, seen, 0.1), 1.2)
            robot.drive(intent.speed, intent.turn_rate, now + 1.0)
            now += 0.1
        return now

    return drive


def patrols(robots: int) -> Work:
    """Robots on their rounds in a bare hall of 90 m by 90 m, and who else there is."""
    import numpy as np
    from PIL import Image

    folder = Path(tempfile.mkdtemp(prefix="hall-"))
    floor = np.full((600, 600), 254, np.uint8)
    floor[:5] = floor[-5:] = floor[:, :5] = floor[:, -5:] = 0
    Image.fromarray(floor).save(folder / "hall.pgm")
    keys = "image: hall.pgm\nresolution: 0.15\norigin: [0, 0, 0]\nnegate: 0\n"
    (folder / "hall.yaml").write_text(keys + "occupied_thresh: 0.65\nfree_thresh: 0.196\n")
    places = [(5.0 + 80 * ((7 * i) % 10) / 9, 5.0 + 80 * ((3 * i) % 10) / 9) for i in range(10)]
    rounds = [
        {"robot": f"robot-{i + 1}", "places": [places[i % 10], places[(i + 3) % 10]]}
        for i in range(robots)
    ]
    changes = {"site.map": str(folder / "hall.yaml"), "robot.count": robots, "patrols": rounds}
    changes |= {
        "events": [{"kind": "fire", "at_s": 9.0}],
        "control": "supervisory",
        "operator.count": 1,
        "horizon_s": 10.0,
    }
    return run("drive-to-event", **changes)


def shift() -> Work:
    """Alarms and three guards who look, without bodies, cameras and bytes: ten seeds."""
    import dva_sim

    return lambda: len([dva_sim.episode("small-shift", seed=seed) for seed in range(1, 11)])


def pointing() -> Work:
    """Three trials of pointing by tilt, 45 targets in all."""
    import dva_sim

    return lambda: len([dva_sim.episode("tasks/fitts-tilt", set={"trials": 3})])


def decision(policy: str) -> Work:
    """Assign 60 responders to 120 events by one of the policies."""
    import numpy as np
    from helpers.dva.dispatch_situations import situation

    from dva_sim.core.dispatch import load_policy

    rng, chosen = np.random.default_rng(1), load_policy(policy)
    seen = situation("gr" * 30, rng.uniform(5.0, 300.0, (120, 60)))
    return lambda: len([chosen.advise(seen, rng)])


def picture() -> Work:
    """Camera picture of a corridor with people in it."""
    from dva_sim.worlds.camera import Camera, Figure
    from dva_sim.worlds.geo import Pose
    from dva_sim.worlds.site import load_site

    camera, pose = Camera(load_site("caparica")), Pose(35.0, 16.0, 2.5)
    people = [Figure("guard", 33.4, 17.6), Figure("bystander", 32.0, 16.0)]
    return lambda: len([camera.picture(pose, people)])


def report() -> Work:
    """The main study's report, of 432 synthetic runs."""
    from helpers.studies import synthetic_results as synthetic

    from dva_sim.experiments.report.report import write_report

    runs = synthetic.drive_rows(12, 1)
    tables = {
        "runs": runs,
        "events": synthetic.story_rows(12),
        "tracks": synthetic.track_rows(),
    }
    folder = Path(tempfile.mkdtemp(prefix="report-"))
    results = synthetic.write(folder, tables, synthetic.manifest(12, 1))
    return lambda: len([write_report(results)])


# --- beside others -----------------------------------------------------------------------------


def circling(ours: bool) -> Work:
    """Ten robots that drive circles between the walls of caparica, here or in ir-sim."""
    from benchmarks import circling

    from dva_sim.worlds.site import load_site

    site = load_site("caparica")
    starts = circling.circles(site, 10)
    if ours:
        advance = circling.ours(site, starts)
    else:
        advance = circling.theirs(site, starts, Path(tempfile.mkdtemp(prefix="ir-sim-")))
    return lambda: advance(1.0) or 1.0


CASES = {
    **{
        f"drive-to-event, {pattern}": Case(
            SECOND, partial(run, "drive-to-event", pattern=pattern, **FAR)
        )
        for pattern in PATTERNS
    },
    "a drive's messages, repeated": Case(SECOND, replayed),
    "physics and control alone": Case(SECOND, physics_and_control),
    "drive-to-event, a new seed": Case(
        SECOND, partial(new_seed, "drive-to-event", pattern="latest-wins", **FAR)
    ),
    "fire-drill": Case(SECOND, partial(run, "fire-drill", horizon_s=120.0)),
    "campus-patrol": Case(SECOND, partial(run, "campus-patrol", horizon_s=30.0)),
    "evacuation": Case(SECOND, partial(run, "evacuation", horizon_s=40.0)),
    **{f"{robots} robots": Case(SECOND, partial(patrols, robots)) for robots in (10, 40, 200)},
    "a shift": Case(RUN, shift),
    "a task": Case(RUN, pointing),
    **{f"a decision, {p}": Case("decision", partial(decision, p)) for p in ADVISERS},
    "a picture": Case("picture", picture),
    LOOP: Case("loop", fixed_loop),
    "a message through the network": Case(MESSAGE, published),
    "a call at a later moment": Case(MESSAGE, called),
    "a Store's put and get": Case(MESSAGE, stored),
    "a hop of SetTeleOp": Case(MESSAGE, partial(hop, "SetTeleOp")),
    "a hop of SetTeleOp, by the parser": Case(MESSAGE, partial(hop, "SetTeleOp", False)),
    "a hop of RobotStatus": Case(MESSAGE, partial(hop, "RobotStatus")),
    "a hop of Heartbeat": Case(MESSAGE, partial(hop, "Heartbeat")),
    "10 circling robots": Case(SECOND, partial(circling, True)),
    "10 circling robots of ir-sim": Case(SECOND, partial(circling, False), optional=True),
    "the main study's report": Case(RUN, report, takes_long=True),
}

RATIOS = {
    "an episode over its physics and control": (MAIN, "physics and control alone"),
    "an episode over the same without its operator": (MAIN, "a drive's messages, repeated"),
    "a new seed over a known one": ("drive-to-event, a new seed", MAIN),
    "a message over a Store's put and get": (
        "a message through the network",
        "a Store's put and get",
    ),
    "ir-sim over ours": ("10 circling robots of ir-sim", "10 circling robots"),
}


def warm() -> None:
    """Load everything that drives need: site, planner and modules."""
    run("drive-to-event", pattern="latest-wins", **FAR)()
