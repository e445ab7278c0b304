"""Position along a route, for any spacing of points and any rate of updates."""

import math

import numpy as np
import pytest

from dva_sim.agents.route_following import Route


def waves(piece: float) -> Route:
    """Two waves of 4 m and 1 m to either side, cut into pieces of so much along x [m]."""
    x = np.linspace(0.0, 16.0, round(16.0 / piece) + 1)
    return Route(np.stack([x, np.sin(0.25 * math.pi * x)], 1))


def around(wall: float) -> Route:
    """Out for 10 m on one side of a wall of some thickness [m], and back on the other."""
    return Route(np.array([(0.0, 0.0), (10.0, 0.0), (10.0, wall), (0.0, wall)]))


@pytest.mark.parametrize("piece", [0.4, 0.1, 0.02])
@pytest.mark.parametrize("between", [0.05, 1.0, 3.0])
def test_one_who_looks_seldom_knows_its_place_on_a_finely_cut_route(piece, between):
    route = waves(piece)
    for along in np.arange(0.0, route.length, between).tolist():
        ahead = route.ahead(*route.point_at(along), 0.0, 0.0)
        assert ahead.offset == pytest.approx(0.0, abs=1e-6)
        assert route.length - ahead.remaining == pytest.approx(along, abs=1e-6)


@pytest.mark.parametrize("wall", [0.1, 0.3])
@pytest.mark.parametrize("between", [0.05, 0.5, 2.0])
def test_one_does_not_take_the_other_side_of_a_thin_wall_for_ones_own(wall, between):
    """One goes so close to the wall that the way back is nearer than the way out."""
    route = around(wall)
    for x in np.arange(0.0, 8.6, between).tolist():
        ahead = route.ahead(x, 0.8 * wall, 0.0, 0.5)
        assert ahead.remaining == pytest.approx(20.0 + wall - x)
        assert ahead.offset == pytest.approx(0.8 * wall)
        assert ahead.distance == pytest.approx(math.hypot(0.5, 0.8 * wall))


def test_who_cuts_a_corner_is_soon_past_it():
    """Within the 2 m that one looks ahead: half of that on either side of the corner."""
    route = Route(np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]))
    for x in np.arange(0.0, 9.1, 0.1).tolist():
        before = route.ahead(x, 0.0, 0.0, 0.5)
    assert before.remaining == pytest.approx(11.0)
    for aside in np.arange(0.0, 1.05, 0.1).tolist():
        after = route.ahead(9.05 + aside, aside, 0.0, 0.5)
    assert after.remaining == pytest.approx(9.0)


def test_who_begins_far_along_a_route_finds_its_place_at_the_first_look():
    route = Route(np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]))
    assert route.ahead(10.0, 6.0, 0.0, 0.0).remaining == pytest.approx(4.0)


def test_laps_that_lie_on_each_other_are_gone_one_by_one():
    """Also by one who slips back a little: the next lap begins behind it."""
    angles = np.linspace(0.0, 6.0 * math.pi, 181)
    route = Route(np.stack([np.cos(angles), np.sin(angles)], 1), reach=0.5 * math.pi)
    for angle in np.arange(0.0, 6.0 * math.pi, 0.2).tolist():
        for at in (angle, angle - 0.1):
            left = route.ahead(math.cos(at), math.sin(at), 0.0, 0.0).remaining
            assert route.length - left == pytest.approx(at, abs=0.15)
