"""Water that fills rooms and finds the doors."""

import math

import numpy as np
import pytest

from dva_sim.worlds.hazards.building import Spaces
from dva_sim.worlds.hazards.flood import Filling, over_weir
from dva_sim.worlds.hazards.hazard import March


def rooms(areas: list[float], doors: list[tuple[int, int, float]]) -> Spaces:
    """Rooms 3 m high; doors of 2.1 m by the rooms they join and their width."""
    a, b, width = zip(*doors, strict=True) if doors else ((), (), ())
    return Spaces(
        np.array(areas),
        np.full(len(areas), 3.0),
        np.array(a, np.int64),
        np.array(b, np.int64),
        np.array(width, float),
        np.full(len(doors), 2.1),
    )


def test_a_closed_room_is_as_deep_as_inflow_times_time_over_area():
    """2 L/s on 40 m2 for ten minutes: 30 mm."""
    filling = Filling(rooms([40.0], []), 0, 2e-3)
    water = March(filling.dry(), filling.step).at(600.0)
    assert water[0] / 40.0 == pytest.approx(0.030, rel=1e-9)


def test_water_is_in_the_rooms_or_has_run_out():
    doors = [(0, 1, 1.0), (1, 2, 1.2), (2, 3, 0.9), (0, 3, 1.0)]  # 3 is outdoors
    filling = Filling(rooms([30.0, 60.0, 20.0], doors), 1, 0.05)
    march = March(filling.dry(), filling.step)
    for time in (10.0, 120.0, 600.0, 1800.0):
        water = march.at(time)
        assert water.sum() == pytest.approx(0.05 * time, rel=1e-9)
        assert water.min() >= 0.0
    assert march.at(1800.0)[3] > 10.0


def test_two_rooms_come_to_one_level():
    """3 m3 in a room of 30 m2; behind a level door lie 60 m2: both end 33 mm deep."""
    filling = Filling(rooms([30.0, 60.0], [(0, 1, 1.0)]), 0, 0.0, sill=0.0)
    march = March(np.array([3.0, 0.0, 0.0]), filling.step)
    depths = [march.at(t)[:2] / [30.0, 60.0] for t in (0.0, 60.0, 600.0, 3600.0)]
    gaps = [a - b for a, b in depths]
    assert gaps == sorted(gaps, reverse=True)
    assert depths[-1] == pytest.approx([1 / 30, 1 / 30], rel=1e-3)


def test_a_sill_keeps_water_back_until_it_is_full():
    """10 mm on 40 m2 are 0.4 m3: the other room stays dry for 200 s at 2 L/s."""
    filling = Filling(rooms([40.0, 40.0], [(0, 1, 1.0)]), 0, 2e-3, sill=0.01)
    march = March(filling.dry(), filling.step)
    assert march.at(199.0)[1] == 0.0
    assert march.at(240.0)[1] > 0.0


def test_a_weir_lets_through_1_7_times_width_times_head_to_one_and_a_half():
    """(2/3)^1.5 sqrt(g) = 1.705: 0.1 m over 1.2 m are 65 L/s, none if it is as deep behind."""
    head, width = np.array([0.1, 0.1, 0.0, 0.1]), np.full(4, 1.2)
    flow = over_weir(head, np.array([-1.0, 0.1, -0.1, 0.05]), width)
    assert flow[0] == pytest.approx(0.0647, abs=1e-4)
    assert flow[1] == flow[2] == 0.0
    assert flow[3] / flow[0] == pytest.approx((1 - 0.5**1.5) ** 0.385)


def test_in_the_end_a_door_lets_out_as_much_as_comes():
    filling = Filling(rooms([30.0], [(0, 1, 1.0)]), 0, 0.01, sill=0.02)
    depth = March(filling.dry(), filling.step).at(7200.0)[0] / 30.0
    assert depth == pytest.approx(0.02 + (0.01 / 1.705) ** (2 / 3), rel=1e-3)
    assert not math.isnan(depth)
