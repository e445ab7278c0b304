import cmath

import pytest

from dva_sim.console.world.tour import FAR, LEAST, tour_of
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.scenario import build, load


@pytest.mark.parametrize("seed", range(1, 6))
def test_both_goals_of_the_tour_lie_alike_and_are_free(seed):
    run = Run(build(load("hands-on")), seed)
    tour = tour_of(run, dict(zip(run.field.robots, range(2), strict=True)))
    seen = []
    for robot, (x, y) in zip(run.field.robots.values(), tour["goals_m"], strict=True):
        pose = robot.body.pose()
        assert run.stage.site.is_free(x, y, robot.body.radius)
        seen.append(complex(x - pose.x, y - pose.y) * cmath.exp(-1j * pose.heading))
    assert abs(seen[0] - seen[1]) < 0.05
    assert LEAST <= abs(seen[0]) <= FAR + 0.1
    assert seen[0] == pytest.approx(cmath.rect(tour["length_m"], tour["side_rad"]), abs=0.05)


def test_one_robot_has_no_tour():
    run = Run(build(load("drive-to-event")), 1)
    assert tour_of(run, dict.fromkeys(run.field.robots, 0)) is None
