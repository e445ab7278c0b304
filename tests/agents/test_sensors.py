"""Sensor models: lag, noise, range, resolution and failures."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from helpers.worlds.robot_fleet import EMPTY, Fleet

from dva_sim.agents.robot.sensors import (
    BLOCK,
    KINDS,
    FaultConfig,
    RobotSensor,
    SensorConfig,
    Values,
    make_ports,
    sources_of,
)
from dva_sim.kernel.streams import Streams
from dva_sim.worlds.hazards import Conditions
from dva_sim.worlds.lidar import Lidar


def sensor(source: Callable[[float], Values], seed: int = 1, **config: object) -> RobotSensor:
    """A thermometer without noise or lag, but for what is said."""
    plain = {"name": "temperature", "noise": 0.0, "lag_s": 0.0, "resolution": 0.001}
    return RobotSensor(
        SensorConfig.model_validate(plain | config), source, lambda what: Streams(seed).fresh(what)
    )


def readings(made: RobotSensor, times: list[float]) -> list[Values]:
    return [made.read(time) for time in times]


def grid(rate: float, seconds: float) -> list[float]:
    return [n / rate for n in range(round(seconds * rate))]


def test_without_noise_it_shows_what_is_there_at_its_resolution_and_within_its_range():
    made = sensor(lambda now: (20.0 + now, -500.0), resolution=0.5, low=-40.0)
    assert made.read(0.0) == (20.0, -40.0)
    assert made.read(0.3) == (20.5, -40.0)
    assert made.read(1e4) == (1000.0, -40.0)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("lidar", 0.0, 99.999),
        ("temperature", -40.0, 1000.0),
        ("smoke", 0.0, 20.0),
        ("gas", 0.0, 1.0),
        ("heat_flux", 0.0, 200.0),
        ("water", 0.0, 10.0),
        ("battery", 0.0, 1.0),
    ],
)
def test_each_kind_shows_no_more_than_its_range(name, low, high):
    config = SensorConfig(name=name)
    for shown, there in ((low, -1e6), (high, 1e6)):
        made = RobotSensor(config, lambda now, there=there: (there,), Streams(1).fresh)
        assert made.read(0.0) == (shown,)


@pytest.mark.parametrize("resolution", [1.0, 0.5, 0.1, 0.001, 0.0025])
def test_values_are_spelt_with_no_more_digits_than_the_resolution_has(resolution):
    made = sensor(lambda now: (20.0 + now / 7,), resolution=resolution)
    for time in grid(10.0, 5.0):
        (value,) = made.read(time)
        assert len(repr(value).partition(".")[2]) <= max(1, math.ceil(-math.log10(resolution)))


def test_noise_has_its_standard_deviation_and_no_bias():
    made = sensor(lambda now: (20.0,), noise=0.3, rate_hz=20.0)
    shown = np.array(readings(made, grid(20.0, 300.0)))
    assert shown.mean() == pytest.approx(20.0, abs=4 * 0.3 / math.sqrt(6000))
    assert shown.std() == pytest.approx(0.3, rel=0.05)
    later = np.corrcoef(shown[:-1, 0], shown[1:, 0])[0, 1]
    assert abs(later) < 4 / math.sqrt(6000)


def test_a_lag_is_a_first_order_step_response():
    made = sensor(lambda now: (20.0 if now < 10.0 else 120.0,), lag_s=5.0)
    shown = dict(zip(grid(10.0, 40.0), readings(made, grid(10.0, 40.0)), strict=True))
    assert shown[9.9] == (20.0,)
    for after in (2.0, 5.0, 15.0):
        expected = 120.0 - 100.0 * math.exp(-(after + 0.1) / 5.0)  # a sample holds 0.1 s
        assert shown[10.0 + after][0] == pytest.approx(expected, abs=0.01)


def test_between_its_samples_it_shows_the_last_one():
    made = sensor(lambda now: (now,), rate_hz=2.0, low=0.0)
    shown = [value for (value,) in readings(made, [0.0, 0.2, 0.45, 0.5, 0.9, 1.0])]
    assert shown == [0.0, 0.0, 0.0, 0.5, 0.5, 1.0]


def test_the_noise_of_a_sample_hangs_neither_on_how_often_it_is_read_nor_on_other_sensors():
    often = sensor(lambda now: (20.0,), noise=0.3, rate_hz=10.0)
    seldom = sensor(lambda now: (20.0,), noise=0.3, rate_hz=10.0)
    each = dict(zip(grid(10.0, 60.0), readings(often, grid(10.0, 60.0)), strict=True))
    for time in (0.0, 0.7, 12.3, 59.9):
        assert seldom.read(time) == each[time]
    assert len(each) > 2 * BLOCK
    streams = Streams(7)
    pair = [SensorConfig(name=name) for name in ("temperature", "smoke")]
    sources = {name: (lambda now: (1.0,)) for name in ("temperature", "smoke")}
    alone = make_ports(pair[:1], sources, streams.fresh)["temperature"]
    both = make_ports(pair, sources, streams.fresh)
    for time in grid(10.0, 20.0):
        both["smoke"].read(time)
        assert both["temperature"].read(time) == alone.read(time)


def test_two_sensors_of_one_robot_have_random_numbers_of_their_own():
    names = ("smoke", "water")
    configs = [SensorConfig(name=name, noise=1.0, low=-9.0) for name in names]
    ports = make_ports(configs, {n: (lambda now: (0.0,)) for n in names}, Streams(7).fresh)
    assert ports["smoke"].read(0.0) != ports["water"].read(0.0)


def test_a_lost_sensor_gives_nothing_from_then_on():
    made = sensor(lambda now: (20.0,), faults=[{"kind": "lost", "at_s": 3.0}])
    assert readings(made, [2.9, 3.0, 100.0]) == [(20.0,), (), ()]


def test_a_stuck_sensor_gives_its_last_values_for_ever():
    made = sensor(lambda now: (now,), noise=0.1, low=0.0, faults=[{"kind": "stuck", "at_s": 3.0}])
    last = readings(made, grid(10.0, 3.0))[-1]
    assert set(readings(made, [3.0, 5.0, 500.0])) == {last}


def test_a_sensor_that_was_stuck_before_anybody_read_it_is_stuck_at_its_first_value():
    made = sensor(lambda now: (now,), faults=[{"kind": "stuck", "at_s": 3.0}])
    assert readings(made, [10.0, 20.0]) == [(10.0,), (10.0,)]


def test_faults_by_chance_come_after_their_mean_time_on_average():
    def is_lost(seed: int, time: float) -> bool:
        faults = [{"kind": "lost", "mean_time_s": 50.0}]
        return sensor(lambda now: (1.0,), seed, faults=faults).read(time) == ()

    for time in (10.0, 50.0, 100.0):
        share = np.mean([is_lost(seed, time) for seed in range(400)])
        assert share == pytest.approx(1 - math.exp(-time / 50.0), abs=2 / math.sqrt(400))


def test_a_fault_is_either_scheduled_or_drawn():
    stream = Streams(1).fresh("x")
    assert FaultConfig(kind="lost", at_s=0.0).time(stream) == 0.0
    assert FaultConfig(kind="lost", mean_time_s=10.0).time(stream) > 0.0


class Burning:
    """It is hot east of x = 10 m from 5 s on."""

    def at(self, x: float, y: float, time: float) -> Conditions:
        hot = x > 10.0 and time >= 5.0
        return Conditions(80.0, 2.5, 0.7, 100.0, 0.01, 0.2) if hot else Conditions()


def test_each_kind_measures_what_it_is_called_by_where_the_robot_is():
    fleet = Fleet()
    robot = fleet.robot(1, (12.0, 12.0, 0.0), EMPTY)
    lidar = Lidar(fleet.world)
    sources = sources_of(fleet.world, robot.body, Burning(), lidar, lambda: 0.75)
    assert set(sources) == set(KINDS)
    assert sources["temperature"](1.0) == (20.0,)
    shown = {name: source(6.0) for name, source in sources.items()}
    ranges = shown.pop("lidar")
    assert shown == {
        "temperature": (80.0,),
        "heat_flux": (2.5,),
        "smoke": (0.7,),
        "gas": (0.01,),
        "water": (0.2,),
        "battery": (0.75,),
    }
    assert len(ranges) == 36
    assert ranges[0] == 8.0  # ahead the corridor goes on
    assert ranges[9] == pytest.approx(1.2, abs=0.001) or ranges[9] > 1.2  # a wall or a corridor
    assert ranges[27] == pytest.approx(1.2, abs=0.001) or ranges[27] > 1.2


def test_a_lidar_sees_a_person_at_the_side_of_the_first_quarter_turn():
    """Rays go counter-clockwise from the heading on: the tenth looks to the left."""
    fleet = Fleet()
    robot = fleet.robot(1, (8.0, 12.0, 0.0), EMPTY)
    fleet.person(8.0, 12.9)
    source = sources_of(fleet.world, robot.body, Burning(), Lidar(fleet.world), lambda: 1.0)
    ranges = source["lidar"](0.0)
    assert ranges[9] == pytest.approx(0.9 - 0.25, abs=0.001)
    assert ranges[27] == pytest.approx(1.2, abs=0.001)
