"""Sensor subscriptions: how often, for whom, how long."""

from collections.abc import Callable

import pytest
from helpers.wording import counted

from dva_sim.agents.robot.sensors import (
    FASTEST,
    LEASE,
    MAX_SUBSCRIPTIONS,
    SensorPort,
    SensorSubscriptions,
    sensor_topic,
)
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import id_of

ROBOT, READER, OTHER = id_of("robot", 1), id_of("operator", 1), "02:00:00:03:00:77"


class Bench:
    """A robot with a clock for a sensor, and a reader who has subscribed to its topic."""

    def __init__(self) -> None:
        quiet = {"events": [{"kind": "fire", "at_s": 500}]}
        self.run = Run(scenarios.build(scenarios.load("drive-to-event"), quiet), 1)
        device = self.run.field.robots[ROBOT].device
        self.clock = device.clock
        self.noted: list[float] = []
        self.read: Callable[[float], tuple[float, ...]] = lambda now: (now,)
        ports = {
            "time": SensorPort("s", lambda now: self.read(now)),
            "slow": SensorPort("s", lambda now: (now,), fastest=2.0),
            "lagging": SensorPort("s", self._note, lags=True),
        }
        self.over = set[str]()  # whose permission is
        self.sensing = SensorSubscriptions(
            device,
            ports,
            lambda now: round(now * 1000),
            lambda who, sensor: who not in self.over,
        )
        self.got: list[tuple[float, m.SensorValue]] = []
        topic = sensor_topic("time", READER)
        self.run.network.subscribe(READER, ROBOT, topic, self._hear)
        self.clock.run(1.0)

    def _note(self, now: float) -> tuple[float, ...]:
        self.noted.append(now)
        return (now,)

    def _hear(self, data: bytes) -> None:
        body = decode(data).body
        assert isinstance(body, m.SensorValue)
        self.got.append((self.clock.now, body))

    def subscribe(self, frequency: float, who: str = READER, sensor: str = "time") -> int:
        return self.sensing.subscribe(who, m.DevSub(sensor, frequency))[0]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_values_come_as_often_as_asked_for(bench):
    assert bench.subscribe(4.0) == m.OK
    bench.clock.run(11.0)
    assert len(bench.got) == pytest.approx(41, abs=1)
    arrived, value = bench.got[0]
    assert (value.sensor, value.unit, value.tick) == ("time", "s", round(value.values[0] * 1000))
    assert 0.0 <= arrived - value.values[0] < 0.1


def test_values_end_with_the_permission_however_that_has_ended(bench):
    bench.subscribe(4.0)
    bench.clock.run(3.0)
    bench.over.add(READER)
    bench.clock.run(4.0)  # one may have been on its way
    known = len(bench.got)
    bench.clock.run(20.0)
    assert len(bench.got) == known > 4
    bench.over.clear()
    bench.clock.run(25.0)
    assert len(bench.got) == known  # it has to subscribe again


def test_another_frequency_takes_the_place_of_the_first(bench):
    bench.subscribe(10.0)
    bench.clock.run(2.0)
    bench.subscribe(1.0)
    bench.clock.run(3.0)
    before = len(bench.got)
    bench.clock.run(13.0)
    assert len(bench.got) - before == 10


def test_frequency_zero_ends_it(bench):
    bench.subscribe(10.0)
    bench.clock.run(2.0)
    assert bench.subscribe(0.0) == m.OK
    bench.clock.run(2.5)
    before = len(bench.got)
    bench.clock.run(10.0)
    assert len(bench.got) == before


def test_a_subscriber_that_vanishes_is_forgotten_after_a_minute(bench):
    bench.subscribe(1.0)
    bench.clock.run(1.0 + LEASE + 30.0)
    assert len(bench.got) == pytest.approx(LEASE, abs=1)


def test_a_subscription_that_is_renewed_goes_on(bench):
    bench.subscribe(1.0)
    bench.clock.run(50.0)
    bench.subscribe(1.0)
    bench.clock.run(100.0)
    assert len(bench.got) == pytest.approx(99, abs=2)


def test_values_for_one_subscriber_do_not_reach_another(bench):
    assert bench.subscribe(10.0, who=OTHER) == m.OK
    bench.clock.run(5.0)
    assert bench.got == []


def test_a_robot_serves_so_many_and_no_more(bench):
    for number in range(MAX_SUBSCRIPTIONS):
        assert bench.subscribe(0.1, who=f"02:00:00:03:01:{number:02X}") == m.OK
    assert bench.subscribe(0.1, who=OTHER) == m.BUSY


def test_a_sensor_is_not_read_faster_than_it_samples(bench):
    assert bench.subscribe(2.5, sensor="slow") == m.NOT_SUPPORTED
    assert bench.subscribe(2.0, sensor="slow") == m.OK
    assert bench.subscribe(20.0) == m.OK


def test_a_sensor_is_read_for_subscribers_only(bench):
    """Casting the rays of a lidar costs more than all the rest of a robot."""
    asked: list[float] = []
    bench.read = lambda now: (asked.append(now), (now,))[1]  # type: ignore[func-returns-value]
    bench.clock.run(10.0)
    assert asked == []
    bench.subscribe(2.0)
    bench.clock.run(20.0)
    assert len(asked) == pytest.approx(20, abs=1)


def test_a_sensor_that_has_nothing_to_say_says_nothing_until_it_has_again(bench):
    bench.read = lambda now: () if now < 6.0 else (now,)
    bench.subscribe(10.0)
    bench.clock.run(5.9)
    assert bench.got == []
    bench.clock.run(7.0)
    assert len(bench.got) == pytest.approx(10, abs=1)


def test_a_whole_turn_of_ranges_arrives_as_it_was(bench):
    turn = tuple(round(0.5 + 0.02 * ray, 3) for ray in range(360))
    bench.read = lambda now: turn
    bench.subscribe(1.0)
    bench.clock.run(3.0)
    assert {value.values for _, value in bench.got} == {turn}


def test_values_that_no_message_can_hold_are_counted_and_stop_nothing(bench):
    bench.read = lambda now: tuple(now / 3.0 + ray / 7.0 for ray in range(361))
    bench.subscribe(1.0)
    bench.clock.run(4.0)
    assert bench.got == []
    assert counted(bench.run.recorder.counters, "sensor values") >= 3
    bench.read = lambda now: (now,)
    bench.clock.run(6.0)
    assert len(bench.got) >= 1


def test_a_sensor_with_a_lag_samples_at_its_own_pace_however_seldom_it_is_read(bench):
    assert bench.subscribe(0.1, sensor="lagging") == m.OK
    bench.clock.run(6.0)
    assert len(bench.noted) == pytest.approx(5 * FASTEST, abs=3)
    bench.subscribe(0.0, sensor="lagging")
    bench.clock.run(7.0)
    count = len(bench.noted)
    bench.clock.run(20.0)
    assert len(bench.noted) == count
