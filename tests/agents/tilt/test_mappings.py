"""Mappings: what a tilt means, and what a practised hand tilts to."""

import math

import pytest

from dva_sim.agents.tilt.mappings import Mapping, known_mappings, load_mapping

DT = 1 / 34


def made(name: str, **options: object) -> Mapping:
    return load_mapping(name, options)()


def held(mapping: Mapping, turn: float, seconds: float, steps: int) -> float:
    """The turn rate after a reading has stood for so long."""
    for _ in range(steps):
        _, shown = mapping.command(0.0, turn, seconds / steps)
    return shown


def test_the_limits_are_ten_levels_and_thirty_degrees_and_there_is_no_reverse():
    for name in known_mappings():
        mapping = made(name)
        assert mapping.command(12.0, 0.0, DT)[0] == 10.0
        assert mapping.command(-3.0, 0.0, DT)[0] == 0.0
        assert held(mapping, 1000.0, 5.0, 50) == 30.0
        assert held(mapping, -1000.0, 5.0, 50) == -30.0


def test_differential_grows_with_time_and_tilt_and_keeps_what_it_has_when_level():
    mapping = made("differential", gain=0.5)
    assert held(mapping, 10.0, 2.0, 20) == pytest.approx(10.0)
    assert held(mapping, 20.0, 1.0, 10) == pytest.approx(20.0)
    assert held(mapping, 0.0, 60.0, 10) == pytest.approx(20.0)


def test_differential_does_not_wind_up_beyond_its_limit():
    mapping = made("differential", gain=1.0)
    held(mapping, 30.0, 100.0, 100)
    assert held(mapping, -10.0, 1.0, 10) == pytest.approx(20.0)


def test_leaky_goes_back_to_zero_in_its_time_constant():
    mapping = made("leaky", gain=1.0, leak_s=2.0)
    assert held(mapping, 10.0, 100.0, 100) == pytest.approx(20.0)  # gain x reading x leak
    assert held(mapping, 0.0, 2.0, 7) == pytest.approx(20.0 / math.e)


def test_slew_goes_towards_what_the_tilt_means_by_so_much_a_second_and_stops_there():
    """A large tilt takes the turn rate farther, not faster; level, it goes back as fast."""
    mapping = made("slew", slew_deg_s2=20.0)
    assert held(mapping, 25.0, 0.5, 5) == pytest.approx(10.0)
    assert held(mapping, 25.0, 5.0, 50) == pytest.approx(25.0)
    assert held(mapping, 0.0, 1.0, 10) == pytest.approx(5.0)
    assert held(mapping, -25.0, 0.5, 10) == pytest.approx(-5.0)
    assert held(mapping, 0.0, 1.0, 10) == pytest.approx(0.0)


@pytest.mark.parametrize("name", ["differential", "leaky", "slew"])
def test_integration_does_not_depend_on_the_length_of_its_steps(name):
    coarse, fine = held(made(name), 12.0, 1.5, 3), held(made(name), 12.0, 1.5, 51)
    assert coarse == pytest.approx(fine)


def test_within_the_dead_zone_nothing_happens_and_beyond_it_counts_from_its_edge():
    mapping = made("absolute", dead_zone=0.1)
    assert mapping.command(0.9, 2.9, DT) == (0.0, 0.0)
    assert mapping.command(3.0, -5.0, DT) == (2.0, -2.0)


@pytest.mark.parametrize("options", [{}, {"gain": 2.0}, {"speed_gain": 0.5, "dead_zone": 0.05}])
def test_absolute_tilts_to_the_reading_that_means_what_is_wanted(options):
    mapping = made("absolute", **options)
    for wanted in [(0.0, 0.0), (4.0, 12.0), (9.5, -29.0)]:
        reading = mapping.tilt_for(wanted, (1.0, 1.0), 0.5)
        assert mapping.command(*reading, DT) == pytest.approx(wanted)


@pytest.mark.parametrize("name", ["differential", "leaky"])
@pytest.mark.parametrize("options", [{"gain": 0.5}, {"gain": 4.0, "dead_zone": 0.1}])
def test_who_watches_the_display_closes_the_gap_as_fast_as_meant(name, options):
    """After the time constant of closing, 63 % of the gap are closed; later all of it."""
    mapping, shown, within = made(name, **options), (0.0, 0.0), 0.8
    for step in range(1, 5001):
        reading = mapping.tilt_for((5.0, 20.0), shown, within)
        shown = mapping.command(*reading, 0.001)
        if step == 800:
            assert shown[1] == pytest.approx(20.0 * (1 - 1 / math.e), rel=0.15)
    assert shown == pytest.approx((5.0, 20.0), rel=0.01)


def test_a_new_drive_forgets_what_was_integrated():
    for name in ("differential", "leaky", "slew"):
        mapping = made(name)
        held(mapping, 20.0, 1.0, 10)
        mapping.begin()
        assert mapping.command(0.0, 0.0, DT) == (0.0, 0.0)
