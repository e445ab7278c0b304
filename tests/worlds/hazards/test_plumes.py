"""Gas outdoors: how wide puffs and plumes are, and that nothing of them is lost."""

import numpy as np
import pytest

from dva_sim.worlds.hazards.gas_plume import CLASSES, plume, sigma_y, sigma_z

AT_1_KM = {"A": 213.0, "B": 156.0, "C": 104.0, "D": 68.0, "E": 50.5, "F": 34.0}  # Martin [m]


@pytest.mark.parametrize(("stability", "metres"), AT_1_KM.items())
def test_a_kilometre_off_a_plume_is_as_wide_as_martin_says(stability, metres):
    assert sigma_y(stability, 1000.0) == pytest.approx(metres, rel=1e-9)
    assert sigma_y(stability, 2000.0) == pytest.approx(metres * 2.0**0.894)


@pytest.mark.parametrize("stability", CLASSES)
def test_both_halves_of_a_height_meet_at_a_kilometre(stability):
    near, far = sigma_z(stability, 1000.0), sigma_z(stability, 1000.001)
    assert near == pytest.approx(far, rel=0.03)


@pytest.mark.parametrize("stability", CLASSES)
def test_nearer_than_a_hundred_metres_the_height_of_a_plume_is_proportional_to_the_distance(
    stability,
):
    """The fit holds from 0.1 km on; below it is a straight line from the leak."""
    at_100 = sigma_z(stability, 100.0)
    assert sigma_z(stability, 100.001) == pytest.approx(at_100, rel=1e-4)
    assert sigma_z(stability, 1.0) == pytest.approx(at_100 / 100.0)
    assert sigma_z(stability, 0.0) == 0.0
    assert plume(0.01, 2.0, stability, 1e-3, 0.0, 0.0) == 1.0  # pure gas at the leak


def test_the_stabler_the_air_the_narrower_the_plume():
    for distance in (20.0, 100.0, 500.0, 3000.0):
        widths = [sigma_y(c, distance) for c in "ABCDEF"]
        assert widths == sorted(widths, reverse=True)
        assert min(sigma_z(c, distance) for c in "ABCDEF") > 0.0


def test_through_every_section_of_a_plume_goes_what_is_set_free():
    """0.01 m3/s in a wind of 2 m/s, class D, 200 m off."""
    across, up = sigma_y("D", 200.0), sigma_z("D", 200.0)
    ys, zs = np.linspace(-6 * across, 6 * across, 121), np.linspace(0.0, 6 * up, 121)
    shares = np.array([[plume(0.01, 2.0, "D", 200.0, y, z) for y in ys] for z in zs])
    through = 2.0 * np.trapezoid(np.trapezoid(shares, ys, axis=1), zs)
    assert through == pytest.approx(0.01, rel=1e-3)
    assert plume(0.01, 2.0, "D", -5.0, 0.0, 0.0) == 0.0
