"""Sensor subscriptions: how often, for whom, how long."""

from __future__ import annotations

import pytest

from dva_sim import scenario as scenarios
from dva_sim.agents.sensing import LEASE, MOST, SensorDesk, SensorPort, topic_of_sensor
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.simulation.names import id_of
from dva_sim.simulation.run import Run

ROBOT, READER, OTHER = id_of("robot", 1), id_of("operator", 1), "02:00:00:03:00:77"


class Bench:
    """A robot with a clock for a sensor, and a reader who has subscribed to its topic."""

    def __init__(self) -> None:
        quiet = {"events": [{"kind": "fire", "at_s": 500}]}
        self.run = Run(scenarios.build(scenarios.load("drive-to-event"), quiet), 1)
        device = self.run.field.robots[ROBOT].device
        self.clock = device.clock
        port = SensorPort("s", lambda now: (now,))
        self.desk = SensorDesk(device, {"time": port}, lambda now: round(now * 1000))
        self.got: list[tuple[float, m.SensorValue]] = []
        topic = topic_of_sensor("time", READER)
        self.run.network.subscribe(READER, ROBOT, topic, self._hear)
        self.clock.run(1.0)

    def _hear(self, data: bytes) -> None:
        body = decode(data).body
        assert isinstance(body, m.SensorValue)
        self.got.append((self.clock.now, body))

    def subscribe(self, frequency: float, who: str = READER) -> int:
        return self.desk.subscribe(who, m.DevSub("time", frequency))[0]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_values_come_as_often_as_asked_for(bench: Bench) -> None:
    assert bench.subscribe(4.0) == m.OK
    bench.clock.run(11.0)
    assert len(bench.got) == pytest.approx(41, abs=1)
    arrived, value = bench.got[0]
    assert (value.sensor, value.unit, value.tick) == ("time", "s", round(value.values[0] * 1000))
    assert 0.0 <= arrived - value.values[0] < 0.1


def test_another_frequency_takes_the_place_of_the_first(bench: Bench) -> None:
    bench.subscribe(10.0)
    bench.clock.run(2.0)
    bench.subscribe(1.0)
    bench.clock.run(3.0)
    before = len(bench.got)
    bench.clock.run(13.0)
    assert len(bench.got) - before == 10


def test_frequency_zero_ends_it(bench: Bench) -> None:
    bench.subscribe(10.0)
    bench.clock.run(2.0)
    assert bench.subscribe(0.0) == m.OK
    bench.clock.run(2.5)
    before = len(bench.got)
    bench.clock.run(10.0)
    assert len(bench.got) == before


def test_a_subscriber_that_vanishes_is_forgotten_after_a_minute(bench: Bench) -> None:
    bench.subscribe(1.0)
    bench.clock.run(1.0 + LEASE + 30.0)
    assert len(bench.got) == pytest.approx(LEASE, abs=1)


def test_a_subscription_that_is_renewed_goes_on(bench: Bench) -> None:
    bench.subscribe(1.0)
    bench.clock.run(50.0)
    bench.subscribe(1.0)
    bench.clock.run(100.0)
    assert len(bench.got) == pytest.approx(99, abs=2)


def test_values_for_one_subscriber_do_not_reach_another(bench: Bench) -> None:
    assert bench.subscribe(10.0, who=OTHER) == m.OK
    bench.clock.run(5.0)
    assert bench.got == []


def test_a_robot_serves_so_many_and_no_more(bench: Bench) -> None:
    for number in range(MOST):
        assert bench.subscribe(0.1, who=f"02:00:00:03:01:{number:02X}") == m.OK
    assert bench.subscribe(0.1, who=OTHER) == m.BUSY
