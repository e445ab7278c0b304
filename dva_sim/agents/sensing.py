"""Sensors of a robot, and who has subscribed to them how often."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from dva_sim.agents.device import Device
from dva_sim.protocol import messages as m
from dva_sim.protocol.errors import ProtocolError

LEASE = 60.0  # a subscription that is not renewed ends by itself after this [s]
MOST = 64  # subscriptions at one robot
FASTEST, SLOWEST = 20.0, 0.02  # values that a robot gives [Hz]


@dataclass(frozen=True)
class SensorPort:
    """A sensor.

    Attributes:
        unit: Of its values.
        read: Its values at a time [s]: 1 to 360, or none if it is lost.
        fastest: How often it gives values at most [Hz].
        lags: Whether a value depends on those before: then it samples while anybody listens,
            however seldom.
    """

    unit: str
    read: Callable[[float], tuple[float, ...]]
    fastest: float = FASTEST
    lags: bool = False


def topic_of_sensor(sensor: str, subscriber: str) -> str:
    """Topic of the values of a sensor for one subscriber."""
    return f"sensor/{sensor}/{subscriber}|"


@dataclass
class _Subscribed:
    """One subscription: how often [s], until when [s], and when the next value is due [s]."""

    period: float
    until: float
    due: float


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
        self._device, self._sensors, self._tick_of = device, sensors, tick
        self._subscribed: dict[tuple[str, str], _Subscribed] = {}
        self._ticking = False

    def subscribe(self, subscriber: str, wish: m.DevSub) -> tuple[int, str]:
        """Begin, renew, change or end a subscription: reply code, and why."""
        key = wish.sensor, subscriber
        now = self._device.clock.now
        if wish.frequency == 0.0:
            self._subscribed.pop(key, None)
            return m.OK, ""
        fastest = min(self._sensors[wish.sensor].fastest, FASTEST)
        if not SLOWEST <= wish.frequency <= fastest:
            return m.NOT_SUPPORTED, f"a value is given {SLOWEST:g} to {fastest:g} times a second"
        self._forget_who_vanished(now)
        known = self._subscribed.get(key)
        if known is None and len(self._subscribed) >= MOST:
            return m.BUSY, f"{MOST} subscriptions are all that this robot serves"
        period = 1.0 / wish.frequency
        due = now if known is None else min(known.due, now + period)
        self._subscribed[key] = _Subscribed(period, now + LEASE, due)
        if not self._ticking:
            self._ticking = True
            self._device.clock.every(1.0 / FASTEST, self._tick)
        return m.OK, ""

    def end(self, subscriber: str) -> None:
        """End all subscriptions of one device."""
        for key in [key for key in self._subscribed if key[1] == subscriber]:
            del self._subscribed[key]

    def _forget_who_vanished(self, now: float) -> None:
        for key in [key for key, held in self._subscribed.items() if held.until < now]:
            del self._subscribed[key]

    def _tick(self) -> bool:
        """Publish what is due. One timer for all: nobody can fill the clock with wishes."""
        now = self._device.clock.now
        self._forget_who_vanished(now)
        for sensor in dict.fromkeys(sensor for sensor, _ in self._subscribed):
            if self._sensors[sensor].lags:
                self._sensors[sensor].read(now)
        for (sensor, subscriber), held in self._subscribed.items():
            if now >= held.due - 1e-9:
                held.due = max(held.due + held.period, now)
                self._publish(sensor, subscriber, now)
        self._ticking = bool(self._subscribed)
        return self._ticking

    def _publish(self, sensor: str, subscriber: str, now: float) -> None:
        port = self._sensors[sensor]
        values = port.read(now)
        if not values:
            return
        body = m.SensorValue(sensor, values, port.unit, self._tick_of(now))
        try:
            self._device.publish(topic_of_sensor(sensor, subscriber), body)
        except ProtocolError:
            self._device.recorder.counters["sensor values that no message holds"] += 1
