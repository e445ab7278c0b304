"""Sensors of robots, and the events that the DVA infers from their values.

The DVA asks robots for their sensors once a device requests them. Sensors with an alarm it reads
like any other subscriber, by a permission of its own, and looks for values that are above a
threshold several times in a row.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from dva_sim.core.registry import Registry
from dva_sim.core.sessions import DvaAnswer, Send, Sessions
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ROBOT
from dva_sim.protocol.wire_size import LIST_BYTES, xml_size

RENEW = 20.0  # interval of renewals; a robot ends a subscription 60 s after the last one [s]
VALUES_IN_A_ROW = 3  # values above a threshold: one alone may be noise; assumed

LINE_BYTES, SENSOR_BYTES = 80, 55  # maximum size of the markup of a robot and of a sensor [B]
MAX_LISTED = 64  # maximum robots in one list


@dataclass(frozen=True)
class SensorAlarm:
    """Meaning of a high value of a sensor.

    Attributes:
        kind: Kind of event that it indicates: `fire`, `gas_leak` or `flood`.
        threshold: Lowest value that raises the alarm, in the unit of the sensor.
    """

    kind: str
    threshold: float


@dataclass
class Sensing:
    """Known sensors of the robots, and the values that the DVA uses.

    Attributes:
        alarms: Alarm levels by name of the sensor.
        rate_hz: Rate at which each value is requested [Hz].
        known: Sensors that robots have reported.
    """

    alarms: Mapping[str, SensorAlarm] = field(default_factory=dict)
    rate_hz: float = 1.0
    known: dict[str, m.SensorInfo] = field(default_factory=dict)
    _asked: set[str] = field(default_factory=set)
    _mute: set[str] = field(default_factory=set)
    _due: dict[str, float] = field(default_factory=dict)
    _above: dict[tuple[str, str], int] = field(default_factory=dict)
    _times: dict[tuple[str, str], deque[float]] = field(default_factory=dict)
    _wanted: bool = False

    # --- which sensors there are -------------------------------------------------------

    def met(self, robot: str) -> list[Send]:
        """Ask a robot that has registered for its sensors, if they are used or requested."""
        if not (self._wanted or self.alarms) or robot in self.known or robot in self._asked:
            return []
        self._asked.add(robot)
        return [Send(robot, m.GetSensorInfo())]

    def forget(self, robot: str) -> None:
        """Forget a robot that has left or restarted: its sensors may have changed."""
        self.known.pop(robot, None)
        self._due.pop(robot, None)
        self._asked.discard(robot)
        self._mute.discard(robot)
        for key in [key for key in self._above if key[0] == robot]:
            del self._above[key]
            del self._times[key]

    def on_reply(self, robot: str, content: object, now: float) -> None:
        """Take a robot's answer, or its lack; ignore a robot that is gone meanwhile."""
        if robot not in self._asked:
            return
        self._asked.remove(robot)
        if not isinstance(content, m.SensorInfo):
            self._mute.add(robot)
            return
        self._mute.discard(robot)
        self.known[robot] = content
        if self._heeded(robot):
            self._due[robot] = now

    def ask_all(self, registry: Registry, robot: str | None) -> list[Send]:
        """Ask one robot or all for their sensors; from now on every new robot is asked."""
        self._wanted = True
        self._mute.discard(robot or "")
        robots = (entry.device.id_tag for entry in registry.of_type(ROBOT))
        return [send for id_tag in robots if id_tag not in self._mute for send in self.met(id_tag)]

    def answer(self, registry: Registry, robot: str | None) -> DvaAnswer:
        """List the sensors of one or all robots; the robots are asked on the first request."""
        entry = registry.entries.get(robot or "")
        if robot and (entry is None or entry.device.device_type != ROBOT or entry.silent):
            return DvaAnswer(m.UNKNOWN_DEVICE, f"no robot {robot}")
        sends = self.ask_all(registry, robot)
        robots = (robot,) if robot else [entry.device.id_tag for entry in registry.of_type(ROBOT)]
        if not self._asked.isdisjoint(robots):
            return DvaAnswer(m.BUSY, "the robots are being asked; ask again", sends=sends)
        lines = list[m.DeviceSensors]()
        room = LIST_BYTES
        for id_tag in (id_tag for id_tag in robots if id_tag in self.known):
            line, taken = _line(id_tag, self.known[id_tag], room)
            if line is None or len(lines) == MAX_LISTED:
                break
            lines.append(line)
            room -= taken
        return DvaAnswer(content=m.SensorList(tuple(lines)), sends=sends)

    # --- reading them ------------------------------------------------------------------

    def renew(self, registry: Registry, sessions: Sessions, now: float) -> list[Send]:
        """Return the subscriptions to send so that the robots' values keep coming."""
        sends: list[Send] = []
        for robot in [robot for robot, due in self._due.items() if due <= now]:
            self._due[robot] = now + RENEW
            entry = registry.entries.get(robot)
            if entry is not None and not entry.silent:
                sensors = sessions.observes(robot)
                wishes = self._wishes(robot, sensors) if sensors else []
                sends += wishes or [sessions.observe(robot, self._heeded(robot))]
        return sends

    def permitted(self, send: Send) -> list[Send]:
        """Note that a robot has heard that the DVA may read its sensors."""
        return self._wishes(send.to, send.session) if send.to in self._due else []

    def next_due(self) -> float:
        """Return when `renew` has work next [s]."""
        return min(self._due.values(), default=math.inf)

    def crossed(self, robot: str, value: m.SensorValue) -> SensorAlarm | None:
        """Return the alarm that a value raises: once, until the value has been below it again."""
        alarm = self.alarms.get(value.sensor)
        if alarm is None:
            return None
        key = robot, value.sensor
        if max(value.values) < alarm.threshold:
            self._above.pop(key, None)
            self._times.pop(key, None)
            return None
        self._times.setdefault(key, deque(maxlen=VALUES_IN_A_ROW)).append(
            max(value.values) / alarm.threshold
        )
        self._above[key] = self._above.get(key, 0) + 1
        return alarm if self._above[key] == VALUES_IN_A_ROW else None

    def times_alarm(self, robot: str, sensor: str) -> float:
        """Return a sensor's recent value as a multiple of its alarm level; 0 if below."""
        times = self._times.get((robot, sensor), ())
        # The least of them, so that one noisy value cannot raise the severity.
        return min(times) if len(times) == VALUES_IN_A_ROW else 0.0

    def _heeded(self, robot: str) -> tuple[str, ...]:
        return tuple(s.name for s in self.known[robot].sensors if s.name in self.alarms)

    def _wishes(self, robot: str, session: int) -> list[Send]:
        names = self._heeded(robot)
        return [Send(robot, m.DevSub(name, self.rate_hz), session) for name in names]


def _line(robot: str, info: m.SensorInfo, room: int) -> tuple[m.DeviceSensors | None, int]:
    """Return a robot's sensors as far as there is room, and the room that takes [B]."""
    taken = LINE_BYTES + xml_size(info.camera_url)
    if taken > room:
        return None, 0
    sensors: list[m.Sensor] = []
    for sensor in info.sensors:
        taken += SENSOR_BYTES + xml_size(sensor.name) + xml_size(sensor.unit)
        if taken > room:
            break
        sensors.append(sensor)
    return m.DeviceSensors(robot, info.camera_url, tuple(sensors)), taken
