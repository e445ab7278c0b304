"""Robots and guards can begin a given way from the event, wherever it is."""

import math
from typing import Any

import pytest

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import simulate
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.measures import episodes
from dva_sim.simulation.scenario import Scenario
from dva_sim.worlds.site import load_site

GUARD_ALONE = {"robot": {"count": 0}, "operator": {"count": 0}}


def drill(**parts: Any) -> Scenario:
    """A reported fire somewhere in the institute."""
    fire = {"events": [{"kind": "fire", "reported": True}]}
    return scenarios.build({**fire, **parts}, {})


def way_of(run: Run, place: tuple[float, float]) -> float:
    """From a place to the event [m]."""
    return run.stage.planner.distance(place, run.field.incidents[0].hazard.position)


@pytest.mark.parametrize("seed", range(2))
def test_a_guard_begins_as_far_from_the_event_as_it_is_told(seed):
    guard = {"count": 1, "way_m": 12.0}
    run = Run(drill(guard=guard, **GUARD_ALONE), seed)
    assert way_of(run, run.field.guards[0].walking.place) == pytest.approx(12.0, abs=0.5)


def test_robots_begin_as_far_from_the_event_and_apart_from_each_other_and_the_guard():
    run = Run(drill(robot={"count": 3, "way_m": 9.0}, guard={"count": 1, "way_m": 9.0}), 4)
    bodies = [robot.body for robot in run.field.robots.values()]
    places = [(b.x, b.y) for b in bodies] + [run.field.guards[0].walking.place]
    assert [way_of(run, place) for place in places] == pytest.approx([9.0] * 4, abs=0.5)
    gaps = [math.dist(a, b) for n, a in enumerate(places) for b in places[:n]]
    assert min(gaps) >= 1.5


def test_a_longer_way_begins_elsewhere_with_the_same_event_and_the_same_person():
    near, far = (
        simulate(drill(guard={"count": 1, "way_m": way}, **GUARD_ALONE), 3) for way in (6.0, 24.0)
    )
    assert near.incidents[0].hazard.position == far.incidents[0].hazard.position
    times = [episodes.run_row(run)["response_mean_s"] for run in (near, far)]
    assert 18.0 / 2.2 < times[1] - times[0] < 18.0 / 0.6  # the same mobilisation, the same pace


def test_more_robots_and_guards_than_a_plan_has_places_begin_apart_wherever_it_is_free():
    run = Run(drill(robot={"count": 30}, guard={"count": 20}), 1)
    site, bases, posts = run.stage.site, run.stage.site.robot_bases, run.stage.site.guard_posts
    assert (len(bases), len(posts)) == (30, 20)
    drawn = load_site("caparica")
    assert bases[:3] == drawn.robot_bases
    assert posts[: len(drawn.guard_posts)] == drawn.guard_posts
    found = (*bases[3:], *posts[len(drawn.guard_posts) :])
    assert all(site.is_free(pose.x, pose.y, 0.5) for pose in found)
    for pose in found:
        gaps = (math.dist((pose.x, pose.y), (p.x, p.y)) for p in (*bases, *posts) if p != pose)
        assert min(gaps) >= 1.5


def test_a_robot_begins_at_the_same_place_however_many_more_there_are():
    few, many = (Run(drill(robot={"count": count}), 1).stage.site for count in (5, 12))
    assert many.robot_bases[:5] == few.robot_bases


def test_another_seed_has_other_places_for_robots_without_a_base_of_their_own():
    one, other = (Run(drill(robot={"count": 5}), seed).stage.site for seed in (1, 2))
    assert one.robot_bases[:3] == other.robot_bases[:3]
    assert one.robot_bases[3:] != other.robot_bases[3:]


def test_a_fire_breaks_out_as_far_from_everybody_as_can_be_where_robots_are_everywhere():
    run = Run(drill(robot={"count": 50}), 1)
    place = run.field.incidents[0].hazard.position
    assert min(math.dist(place, (b.x, b.y)) for b in run.stage.site.robot_bases) > 1.0


def test_guards_get_ready_in_the_time_the_scenario_says_with_the_spread_of_their_profile():
    at_once, late = (
        simulate(drill(guard={"count": 1, "mobilisation_s": m}, **GUARD_ALONE), 2)
        for m in (1.0, 90.0)
    )
    waits = [
        episodes.event_rows(run)[0]["t_departed_s"] - episodes.event_rows(run)[0]["t_assigned_s"]
        for run in (at_once, late)
    ]
    assert waits[1] - waits[0] == pytest.approx(89.0 * waits[1] / 90.0, rel=0.02)
    assert scenarios.guard_profile(late.scenario).mobilisation_s.spread == 0.45
