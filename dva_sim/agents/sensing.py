"""Sensors of a robot, and who has subscribed to them how often."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from dva_sim.agents.device import Device
from dva_sim.protocol import messages as m

LEASE = 60.0  # a subscription that is not renewed ends by itself after this [s]
MOST = 64  # subscriptions at one robot


@dataclass(frozen=True)
class SensorPort:
    """A sensor: the unit of its values, and how it is read at a time [s]."""

    unit: str
    read: Callable[[float], float]


def topic_of_sensor(sensor: str, subscriber: str) -> str:
    """Topic of the values of a sensor for one subscriber."""
    return f"sensor/{sensor}/{subscriber}|"


@dataclass
class _Subscribed:
    """One subscription: how often [s], until when [s]; the number tells it from earlier ones."""

    period: float
    until: float
    number: int


class SensorDesk:
    """Publishes the values of a robot's sensors to those who subscribed.

    Args:
        device: The robot.
        sensors: What it has, by name.
        tick: The robot's own clock [ms], at a time [s].
    """

    def __init__(
        self, device: Device, sensors: Mapping[str, SensorPort], tick: Callable[[float], int]
    ) -> None:
        self._device, self._sensors, self._tick = device, sensors, tick
        self._subscribed: dict[tuple[str, str], _Subscribed] = {}
        self._number = 0

    def subscribe(self, subscriber: str, wish: m.DevSub) -> tuple[int, str]:
        """Begin, renew, change or end a subscription: reply code, and why."""
        key = wish.sensor, subscriber
        now = self._device.clock.now
        if wish.frequency == 0.0:
            self._subscribed.pop(key, None)
            return m.OK, ""
        known = self._subscribed.get(key)
        if known is not None and known.period == 1.0 / wish.frequency:
            known.until = now + LEASE
            return m.OK, ""
        if known is None and len(self._subscribed) >= MOST:
            return m.BUSY, f"{MOST} subscriptions are all that this robot serves"
        self._number += 1
        period = 1.0 / wish.frequency
        begun = self._subscribed[key] = _Subscribed(period, now + LEASE, self._number)
        self._device.clock.every(period, lambda: self._publish(key, begun))
        return m.OK, ""

    def end(self, subscriber: str) -> None:
        """End all subscriptions of one device."""
        for key in [key for key in self._subscribed if key[1] == subscriber]:
            del self._subscribed[key]

    def _publish(self, key: tuple[str, str], begun: _Subscribed) -> bool:
        """One value; False when the subscription has ended or another took its place."""
        current, now = self._subscribed.get(key), self._device.clock.now
        if current is None or current.number != begun.number:
            return False
        if now > current.until:
            del self._subscribed[key]
            return False
        sensor, subscriber = key
        port = self._sensors[sensor]
        body = m.SensorValue(sensor, port.read(now), port.unit, self._tick(now))
        self._device.publish(topic_of_sensor(sensor, subscriber), body)
        return True
