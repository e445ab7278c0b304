"""Sensors of robots in hand that their drivers read: chosen by name, as often as they like."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from dva_sim.agents.operator.held_robot import HeldRobot
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.driving.drive_actions import Driving
from dva_sim.console.system.sensing import SensorWatch
from dva_sim.console.wire.arguments import SensorsChosen
from dva_sim.console.wire.seats import SensedShown
from dva_sim.protocol import messages as m

Values = dict[str, tuple[m.SensorValue, float]]


class SeatSensors:
    """Subscriptions of drivers, each until its robot is out of their hands.

    Args:
        alarm_at: Function that returns the value from which on a sensor gives the alarm, by its
            name; None: it gives none, or nobody here knows.
    """

    def __init__(self, alarm_at: Callable[[str], float | None]) -> None:
        self._alarm_at = alarm_at
        self._watches: dict[HeldRobot, tuple[SensorWatch, float, Values]] = {}

    def choose(
        self, held: HeldRobot, names: Sequence[str], rate_hz: float, on_result: OnResult
    ) -> None:
        """Read these sensors of a robot in hand from now on, and no others.

        Args:
            held: The robot.
            names: Names of the sensors.
            rate_hz: Desired rate of values [Hz].
            on_result: Callback for the result.
        """
        self._end(held)
        if not names:
            on_result(True, "no sensor is read")
            return
        device = held.device
        values: Values = {}

        def heard(value: m.SensorValue) -> None:
            values[value.sensor] = value, device.clock.now

        watch = SensorWatch(device, held.robot, names, rate_hz, heard=heard, told=on_result)
        self._watches[held] = watch, rate_hz, values

    def _end(self, held: HeldRobot) -> None:
        watch, _, _ = self._watches.pop(held, (None, 0.0, {}))
        if watch is not None:
            watch.end()

    def tidy(self) -> None:
        """End what is read of robots that are out of hand."""
        for held in [held for held in self._watches if held.phase == "gone"]:
            self._end(held)

    def lines(self, held: HeldRobot) -> list[SensedShown]:
        """Return the sensors that a robot offers, with values of those that are read."""
        watch, rate_hz, values = self._watches.get(held, (None, 0.0, {}))
        now = held.device.clock.now
        lines: list[SensedShown] = []
        for sensor in held.offered:
            value, at = values.get(sensor.name, (None, now))
            line: SensedShown = {
                "name": sensor.name,
                "unit": sensor.unit,
                "rate_hz": rate_hz if watch is not None and sensor.name in watch.names else None,
                "age_s": None if value is None else round(now - at, 1),
                "alarm_at": self._alarm_at(sensor.name),
            }
            if value is not None and len(value.values) > 3:
                line["least"] = min(value.values)
            elif value is not None:
                line["values"] = list(value.values)
            lines.append(line)
        return lines


class SensorActions:
    """Does what drivers ask for about sensors.

    Args:
        sensors: Their subscriptions.
        driving: Seats, and what their people hold.
    """

    def __init__(self, sensors: SeatSensors, driving: Driving) -> None:
        self._sensors = sensors
        self._driving = driving

    @does("sense")
    def _sense(self, client: str, line: SensorsChosen, on_result: OnResult) -> None:
        held = self._driving.held(client, line)
        self._sensors.choose(held, line["sensors"], line["rate_hz"], on_result)
