"""Promises of every hazard, and the course of a fire in the open."""

import math

import numpy as np
import pytest

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.hazards import GROWTH_S, KINDS, Fire, Flood, make_hazard

HOURS = range(0, 7200, 10)  # two hours [s]


@pytest.mark.parametrize("kind", KINDS)
def test_before_it_starts_a_hazard_harms_nobody(kind):
    hazard = make_hazard(kind, (1, 2), 50.0)
    assert hazard.radius(49.0) == hazard.danger_radius(49.0) == hazard.severity(49.0) == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_no_hazard_is_dangerous_beyond_7_m_or_less_than_a_metre(kind):
    radii = [make_hazard(kind, (1, 2), 0.0).danger_radius(t) for t in HOURS]
    assert 1.0 <= min(radii) <= max(radii) < 7.0


@pytest.mark.parametrize("kind", KINDS)
def test_severity_lies_between_0_and_1(kind):
    severities = [make_hazard(kind, (1, 2), 0.0).severity(t) for t in HOURS]
    assert min(severities) == 0.0
    assert max(severities) == 1.0


# --- fire ------------------------------------------------------------------------------


@pytest.mark.parametrize(("growth", "seconds"), GROWTH_S.items())
def test_a_fire_releases_1055_kilowatts_when_its_class_says(growth, seconds):
    fire = Fire((0, 0), 10.0, growth=growth)
    assert fire.heat_release(10.0 + seconds) == pytest.approx(1055)
    assert fire.heat_release(10.0 + seconds / 2) == pytest.approx(1055 / 4)


@pytest.mark.parametrize("growth", GROWTH_S)
def test_a_fire_burns_all_its_fuel_and_no_more(growth):
    """5 MW burn on 10 m2 of floor, each with 420 MJ of fuel."""
    times = np.arange(0.0, 4000.0)
    heat = [Fire((0, 0), 0.0, growth=growth).heat_release(t) for t in times]
    assert max(heat) == 5000.0
    assert heat[-1] == 0.0
    assert np.trapezoid(heat, times) == pytest.approx(10 * 420e3, rel=1e-3)


@pytest.mark.parametrize(("growth", "most"), [("slow", 18_600.0), ("medium", 74_400.0)])
def test_a_fire_that_has_burnt_its_fuel_before_its_peak_is_refused(growth, most):
    """Each m2 holds 840 s of burning at 500 kW, and growing burns a third of that."""
    times = np.arange(0.0, 8000.0)
    fire = make_hazard("fire", (0, 0), 0.0, growth=growth, peak=most)
    assert isinstance(fire, Fire)
    burnt = np.trapezoid([fire.heat_release(t) for t in times], times)
    assert burnt == pytest.approx(most / 500.0 * 420e3, rel=0.01)
    with pytest.raises(ConfigError, match=f"{growth} fire"):
        make_hazard("fire", (0, 0), 0.0, growth=growth, peak=1.01 * most)


def test_a_fire_dies_down_once_70_percent_of_its_fuel_is_burnt():
    times = np.arange(0.0, 4000.0)
    heat = np.array([Fire((0, 0), 0.0).heat_release(t) for t in times])
    until = np.flatnonzero(heat == 5000.0).max()
    assert np.trapezoid(heat[:until], times[:until]) == pytest.approx(0.7 * 4.2e6, rel=0.01)


def test_a_fire_burns_500_kilowatts_per_square_metre():
    fire = Fire((0, 0), 0.0)
    assert math.pi * fire.radius(200.0) ** 2 * 500 == pytest.approx(fire.heat_release(200.0))


def test_the_heat_of_a_fire_falls_with_the_square_of_the_distance():
    """30 % of 1055 kW, spread over a sphere of 10 m: 0.252 kW/m2."""
    fire = Fire((0.0, 0.0), 0.0)
    assert fire.heat_flux(300.0, (10.0, 0.0)) == pytest.approx(0.252, abs=0.001)
    near, far = fire.heat_flux(300.0, (5.0, 0.0)), fire.heat_flux(300.0, (10.0, 0.0))
    assert near / far == pytest.approx(4.0)
    assert fire.heat_flux(-1.0, (5.0, 0.0)) == 0.0
    assert fire.heat_flux(300.0, (0.0, 0.0)) == pytest.approx(0.3 * 500 / 4)  # at the flames


def test_the_danger_of_a_fire_ends_where_2_5_kilowatts_per_square_metre_arrive():
    fire = Fire((0.0, 0.0), 0.0)
    for time in (250.0, 400.0, 900.0):
        radius = fire.danger_radius(time)
        assert fire.heat_flux(time, (radius, 0.0)) == pytest.approx(2.5)
    assert fire.danger_radius(10.0) == 2.0


# --- leaks and floods ------------------------------------------------------------------


def test_what_can_be_seen_of_a_leak_grows_with_the_square_root_of_time():
    leak = make_hazard("gas_leak", (0, 0), 0.0)
    assert leak.radius(20.0) == pytest.approx(2 * leak.radius(5.0))


def test_a_leak_is_dangerous_so_far_as_the_leaky_aquifer_says():
    """Long after its start a line source q stands at q / (2 pi D h) K0(r sqrt(loss / D))."""
    from scipy.special import k0

    leak = make_hazard("gas_leak", (0, 0), 0.0)
    radius, steepness = leak.danger_radius(1e5), math.sqrt(2.0 / 3600.0 / 0.05)
    share = 0.010 / (2.0 * math.pi * 0.05 * 3.0) * k0(radius * steepness)
    assert share == pytest.approx(0.2 * 0.044, rel=0.03)


def test_a_flood_is_dangerous_where_it_stands_a_tenth_of_a_metre_deep():
    """2 L/s leave by the door 1 cm above its threshold; 100 L/s stand 0.13 m deep."""
    drip, torrent = Flood((0.0, 0.0), 0.0), Flood((0.0, 0.0), 0.0, inflow=0.1)
    assert drip.danger_radius(3600.0) == 1.0
    assert torrent.danger_radius(49.0) == 1.0
    assert torrent.danger_radius(51.0) == pytest.approx(math.sqrt(50.0 / math.pi))
