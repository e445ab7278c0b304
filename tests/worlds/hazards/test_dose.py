"""Effects of heat, smoke, gas and water on people, by the numbers of the standards."""

import math

import pytest

from dva_sim.worlds.hazards import CLEAR, Conditions, Dose, pace_in_smoke, pace_in_water


def seconds_to_collapse(conditions: Conditions) -> float:
    dose = Dose()
    for step in range(1, 400_000):
        dose.add(conditions, 0.1)
        if dose.incapacitated:
            return step * 0.1
    return math.inf


@pytest.mark.parametrize(("flux", "seconds"), [(2.5, math.inf), (5.0, 11.8), (10.0, 3.2)])
def test_radiant_heat_is_borne_for_4_2_over_its_power_of_1_9_minutes(flux, seconds):
    """ISO 13571; up to 2.5 kW/m2 it is borne for long."""
    assert seconds_to_collapse(Conditions(heat_flux=flux)) == pytest.approx(seconds, abs=0.1)


@pytest.mark.parametrize(("celsius", "minutes"), [(80.0, 16.9), (100.0, 7.92), (150.0, 2.00)])
def test_hot_air_is_borne_for_5e7_over_its_power_of_3_4_minutes(celsius, minutes):
    found = seconds_to_collapse(Conditions(temperature=celsius)) / 60.0
    assert found == pytest.approx(minutes, rel=0.01)


def test_carbon_monoxide_of_1000_ppm_is_borne_for_28_minutes():
    """Purser: 30 % over 3.317e-5 x 1000^1.036 x 25 L/min; twice as much for not quite half."""
    one, two = (seconds_to_collapse(Conditions(co=ppm)) / 60.0 for ppm in (1000.0, 2000.0))
    assert one == pytest.approx(28.2, abs=0.1)
    assert one / two == pytest.approx(2.0**1.036, rel=0.01)


def test_gas_that_drives_out_half_of_the_oxygen_stuns_within_two_minutes():
    """Purser: exp(8.13 - 0.54 x 10.45) minutes at 10.45 % of oxygen less."""
    found = seconds_to_collapse(Conditions(gas=0.5)) / 60.0
    assert found == pytest.approx(math.exp(8.13 - 0.54 * 10.45), rel=0.01)


def test_time_in_air_that_could_explode_is_counted():
    dose = Dose()
    for share in (0.0, 0.99, 1.0, 3.0):
        dose.add(Conditions(explosive=share), 10.0)
    assert dose.explosive == 20.0


def test_clean_air_does_no_harm():
    dose = Dose()
    dose.add(CLEAR, 86_400.0)
    assert (dose.heat, dose.toxic, dose.explosive) == (0.0, 0.0, 0.0)
    assert not dose.incapacitated


def test_doses_add_up():
    dose = Dose()
    for _ in range(2):
        dose.add(Conditions(temperature=100.0, co=1000.0), 60.0)
    assert dose.heat == pytest.approx(2.0 / 7.92, rel=0.01)
    assert dose.toxic == pytest.approx(2.0 / 28.2, rel=0.01)


def test_smoke_slows_people():
    """Frantzich and Nilsson: 0.706 - 0.057 K m/s, of 0.706."""
    assert pace_in_smoke(0.0) == 1.0
    assert 0.706 * pace_in_smoke(5.0) == pytest.approx(0.706 - 0.057 * 5.0)
    assert pace_in_smoke(100.0) == 0.1


def test_water_slows_people():
    paces = [pace_in_water(depth) for depth in (0.0, 0.1, 0.3, 0.5, 1.0)]
    assert paces == pytest.approx([1.0, 0.9, 0.7, 0.5, 0.3])
