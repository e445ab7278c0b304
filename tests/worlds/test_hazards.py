import math

import pytest

from dva_sim.worlds.hazards import GROWTH_S, KINDS, Fire, make_hazard


@pytest.mark.parametrize("growth", GROWTH_S)
def test_a_fire_releases_1055_kilowatts_when_its_class_says(growth):
    fire = Fire((0, 0), 10.0, growth)
    assert fire.heat_release(10.0 + GROWTH_S[growth]) == pytest.approx(1055)
    assert fire.heat_release(10.0 + GROWTH_S[growth] / 2) == pytest.approx(1055 / 4)


def test_a_fire_burns_500_kilowatts_per_square_metre():
    fire = Fire((0, 0), 0.0)
    assert math.pi * fire.radius(200.0) ** 2 * 500 == pytest.approx(fire.heat_release(200.0))


@pytest.mark.parametrize("kind", KINDS)
def test_before_it_starts_a_hazard_harms_nobody(kind):
    hazard = make_hazard(kind, (1, 2), 50.0)
    assert hazard.radius(49.0) == hazard.danger_radius(49.0) == hazard.severity(49.0) == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_hazard_only_grows_and_is_bounded(kind):
    hazard = make_hazard(kind, (1, 2), 0.0)
    times = range(0, 5000, 10)
    for measure in (hazard.radius, hazard.danger_radius, hazard.severity):
        values = [measure(t) for t in times]
        assert values == sorted(values)
    assert hazard.severity(5000) <= 1.0
    assert all(hazard.danger_radius(t) > hazard.radius(t) for t in times)


@pytest.mark.parametrize("kind", KINDS)
def test_a_farther_detector_and_one_in_another_room_notice_later(kind):
    hazard = make_hazard(kind, (0, 0), 20.0)
    near, far = hazard.detection_time((1, 0), True), hazard.detection_time((6, 0), True)
    assert 20.0 < near < far < hazard.detection_time((6, 0), False)


def test_a_leak_spreads_with_the_square_root_of_time():
    leak = make_hazard("gas_leak", (0, 0), 0.0)
    assert leak.radius(20.0) == pytest.approx(2 * leak.radius(5.0))


def test_the_heat_of_a_fire_falls_with_the_square_of_the_distance():
    """30 % of 1055 kW, spread over a sphere of 10 m: 0.252 kW/m2."""
    fire = Fire((0.0, 0.0), 0.0)
    assert fire.heat_flux(300.0, (10.0, 0.0)) == pytest.approx(0.252, abs=0.001)
    near, far = fire.heat_flux(300.0, (5.0, 0.0)), fire.heat_flux(300.0, (10.0, 0.0))
    assert near / far == pytest.approx(4.0)
    assert fire.heat_flux(-1.0, (5.0, 0.0)) == 0.0
    assert fire.heat_flux(300.0, (0.0, 0.0)) == pytest.approx(0.3 * 500 / 4)  # at the flames
