import math

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.worlds.geo import GeoFrame

CAPARICA = GeoFrame(38.6612, -9.2058)


@pytest.mark.parametrize(
    "origin", [(38.6612, -9.2058), (-33.9, 151.2), (64.1, -21.9), (0.0, 179.99)]
)
def test_a_round_trip_within_three_kilometres_stays_within_a_millimetre(origin):
    frame = GeoFrame(*origin)
    for x, y in np.random.default_rng(1).uniform(-3000, 3000, (200, 2)):
        assert math.dist(frame.to_xy(*frame.to_latlon(x, y)), (x, y)) < 1e-3


@given(
    st.floats(-75, 75),
    st.floats(-179, 179),
    st.floats(0, 3000),
    st.floats(-math.pi, math.pi),
)
def test_both_ways_agree_with_an_independent_library_within_three_kilometres(
    latitude, longitude, far, direction
):
    x, y = far * math.cos(direction), far * math.sin(direction)
    there = GeoFrame(latitude, longitude).to_latlon(x, y)
    east, north, _ = pymap3d.geodetic2enu(*there, 0, latitude, longitude, 0)
    assert math.dist((east, north), (x, y)) < 1e-3
    assert GeoFrame(latitude, longitude).to_xy(*there) == pytest.approx((east, north), abs=1e-4)


def test_x_points_east_and_y_points_north():
    latitude, longitude = CAPARICA.to_latlon(100.0, 0.0)
    assert longitude > CAPARICA.longitude
    assert latitude == pytest.approx(CAPARICA.latitude, abs=1e-6)
    assert CAPARICA.to_latlon(0.0, 100.0)[0] > CAPARICA.latitude
