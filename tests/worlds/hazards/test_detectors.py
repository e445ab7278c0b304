"""Detectors: when each sounds, and which sounds first."""

import math

import numpy as np
import pytest

from dva_sim.worlds.hazards import Fire, detection_time, first_detection, make_hazard
from dva_sim.worlds.hazards.detectors import CoAlarm
from dva_sim.worlds.hazards.fire import (
    heat_in_jet,
    jet_lag,
    jet_smoke,
    jet_speed,
    jet_warmth,
    smoke_in_jet,
)
from dva_sim.worlds.site import load_site
from dva_sim.worlds.site_parts import Detector

BANDS = {30.0: (120.0, math.inf), 50.0: (60.0, 90.0), 100.0: (10.0, 40.0), 300.0: (0.0, 3.0)}


def minutes_to_alarm(ppm: float) -> float:
    """In steady air, up to ten hours."""
    alarm = CoAlarm()
    return next((s / 60.0 for s in range(1, 36_000) if alarm.add(ppm, 1.0)), math.inf)


# --- carbon monoxide -------------------------------------------------------------------


@pytest.mark.parametrize(("ppm", "band"), BANDS.items())
def test_a_carbon_monoxide_alarm_sounds_when_en_50291_wants_it(ppm, band):
    assert band[0] <= minutes_to_alarm(ppm) <= band[1]


def test_the_more_the_sooner_and_clean_air_makes_it_forget():
    times = [minutes_to_alarm(ppm) for ppm in (40.0, 50.0, 70.0, 100.0, 200.0, 300.0, 600.0)]
    assert times == sorted(times, reverse=True)
    alarm = CoAlarm()
    assert not any(alarm.add(100.0, 1.0) for _ in range(600))
    assert not any(alarm.add(0.0, 1.0) for _ in range(3600))
    assert not any(alarm.add(100.0, 1.0) for _ in range(600))


# --- ceiling jets ----------------------------------------------------------------------


def test_a_ceiling_jet_is_as_warm_and_fast_as_alpert_measured():
    """1 MW under 3 m: 271 K and 6.7 m/s above the fire, 86 K and 1.35 m/s at 3 m from its axis."""
    heat = np.array([1000.0])
    assert jet_warmth(heat, 0.0, 3.0)[0] == pytest.approx(16.9 * 100.0 / 3.0 ** (5 / 3))
    assert jet_warmth(heat, 3.0, 3.0)[0] == pytest.approx(86.2, abs=0.1)
    assert jet_speed(heat, 0.0, 3.0)[0] == pytest.approx(6.66, abs=0.01)
    assert jet_speed(heat, 3.0, 3.0)[0] == pytest.approx(1.352, abs=0.001)


def test_smoke_is_under_way_as_long_as_the_speeds_of_the_jet_say():
    radii = np.linspace(0.45, 5.0, 4000)
    speeds = [jet_speed(np.array([50.0]), r, 3.0)[0] for r in radii]
    first = 3.45 / jet_speed(np.array([50.0]), 0.0, 3.0)[0]  # up, and the first 0.15 H
    along = first + np.trapezoid(1.0 / np.array(speeds), radii)
    assert jet_lag(np.array([50.0]), 5.0, 3.0)[0] == pytest.approx(along, rel=1e-3)


def test_smoke_is_thinned_as_heat_is():
    """0.05 kg soot for 20 MJ, of which 70 % rise: 8.7 K make 0.32 per metre."""
    soot_per_warmth = 0.05 / 20e3 / 0.7 * 1.204 * 1.005  # [kg/m3/K]
    assert jet_smoke(np.array([10.0]))[0] == pytest.approx(8700 * soot_per_warmth * 10, rel=1e-3)


def test_a_farther_detector_sounds_later_and_a_heat_detector_later_still():
    fire = Fire((0.0, 0.0), 0.0)
    smoke = [smoke_in_jet(fire, r, 3.0) for r in (0.5, 2.0, 4.0, 8.0)]
    heat = [heat_in_jet(fire, r, 3.0) for r in (0.5, 2.0, 4.0, 8.0)]
    for series in ([a for a, _ in smoke], [s for _, s in smoke], heat):
        assert series == sorted(series)
    for (arrives, sounds), hot in zip(smoke, heat, strict=True):
        assert 0.0 < arrives < sounds < hot


def test_a_heat_detector_lags_behind_the_air_by_its_response_time():
    """A slow fire is a steady jet to it: it sounds when the air is little above 58 degrees."""
    slow, quick = (Fire((0, 0), 0.0, growth=growth) for growth in ("slow", "ultrafast"))
    over = []
    for fire in (slow, quick):
        heat = np.array([fire.heat_release(heat_in_jet(fire, 2.0, 3.0))])
        over.append(jet_warmth(heat, 2.0, 3.0)[0] - 38.0)
    assert 0.0 < over[0] < 10.0 < over[1]


# --- on a site -------------------------------------------------------------------------


def detector(kind: str, x: float, y: float) -> Detector:
    return Detector(f"{kind} at {x:g}, {y:g}", kind, x, y)


def test_smoke_is_noticed_in_its_own_room_first_then_along_the_corridor():
    """A fire in the chemistry lab: its door opens on the north corridor, that on the main one."""
    site = load_site("caparica")
    fire = make_hazard("fire", (19.0, 22.5), 100.0)
    places = [(19.0, 19.0), (13.1, 18.6), (20.0, 12.0), (19.0, 15.6)]  # lab, corridors, office
    times = [detection_time(fire, detector("smoke", *place), site) for place in places]
    assert times == sorted(times)
    assert 130.0 < times[0] < 190.0
    assert times[-1] < 700.0
    found, when = first_detection(fire, site)
    assert found is not None
    assert (found.name, when) == ("Chemistry lab smoke", times[0])


def test_a_hazard_that_starts_later_is_noticed_as_much_later():
    site = load_site("caparica")
    for kind, place in (("fire", (5, 16)), ("gas_leak", (5, 16)), ("flood", (35.0, 19.0))):
        early, late = (make_hazard(kind, place, start) for start in (0.0, 1234.0))
        assert first_detection(late, site)[1] == first_detection(early, site)[1] + 1234.0


def test_gas_is_noticed_where_a_tenth_of_the_explosive_limit_arrives():
    """The detector's input is the value of `Surroundings` at its place."""
    from dva_sim.worlds.hazards import Surroundings

    site = load_site("caparica")
    leak = make_hazard("gas_leak", (19.0, 22.5), 0.0)
    when = detection_time(leak, detector("gas", 16.0, 19.0), site)
    air = Surroundings(site, [leak])
    assert air.at(16.0, 19.0, when).gas == pytest.approx(0.0044, rel=0.05)
    assert air.at(16.0, 19.0, when - 10.0).gas < 0.0044


def test_carbon_monoxide_is_noticed_by_its_own_detectors_only():
    site = load_site("caparica")
    leak = make_hazard("gas_leak", (5.0, 3.5), 0.0, gas="carbon_monoxide")
    assert detection_time(leak, detector("gas", 5.2, 3.6), site) == math.inf
    assert 60.0 < detection_time(leak, detector("co", 5.2, 6.0), site) < 3600.0
    assert first_detection(leak, site) == (None, math.inf)


def test_water_is_noticed_when_its_film_arrives_or_the_room_is_5_mm_deep():
    """2 L/s spread 5 mm deep: 1 m off after 7.9 s. Behind a door it takes longer."""
    site = load_site("caparica")
    flood = make_hazard("flood", (35.0, 19.0), 0.0)
    near = detection_time(flood, detector("water", 36.0, 19.0), site)
    assert near == pytest.approx(math.pi * 5e-3 / 2e-3, abs=1.0)
    beyond = detection_time(flood, detector("water", 33.0, 17.0), site)
    assert 200.0 < beyond < 2000.0


def test_a_heat_detector_notices_a_fire_later_than_a_smoke_detector_at_its_place():
    site = load_site("caparica")
    fire = make_hazard("fire", (19.0, 22.5), 0.0)
    smoke, heat = (detection_time(fire, detector(k, 19.0, 19.0), site) for k in ("smoke", "heat"))
    assert smoke < heat < 400.0
