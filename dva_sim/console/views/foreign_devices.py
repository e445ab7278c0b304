"""Robots and guards from outside the scenario: they have joined by themselves, or are fakes.

Pages show what they publish, as of any device that a console knows by its messages alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

from dva_sim.agents.device import AgentDevice
from dva_sim.console.views.feed import Feed
from dva_sim.console.views.published_rows import (
    emergency_of,
    positions,
    robot_row,
)
from dva_sim.console.views.system_state import DeviceState, SystemState
from dva_sim.console.views.things import UNKNOWN_PERSON, UNKNOWN_ROBOT
from dva_sim.console.wire.rows import RobotRow
from dva_sim.kernel.labels import distinct
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import GUARD, ROBOT
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import kind_of

MOST: Final = 64


class ForeignDevices:
    """Those of a run.

    Args:
        run: The run.
        feed: Numbers of everybody.
        device: Device that listens to them.
    """

    def __init__(self, run: Run, feed: Feed, device: AgentDevice) -> None:
        self._run = run
        self._feed = feed
        self._state = SystemState(device, {}, lambda: None)
        self._listed = 0.0  # time of the newest list [s]

    @property
    def is_anybody(self) -> bool:
        """Return True if somebody from outside is known."""
        return bool(self._state.devices)

    def take_list(self, devices: Iterable[m.Device]) -> bool:
        """Take the DVA's list of devices; True if somebody is new, who has a number then."""
        self._listed = self._run.clock.now
        known = self._state.devices.keys()
        named = [self._named(device) for device in devices if self._is_foreign(device)]
        there = [one for one in named if one.id_tag in known]
        new = [one for one in named if one.id_tag not in known][: MOST - len(known)]
        self._state.list((*there, *new))
        for device in new:
            self._meet(device)
        return bool(new)

    def _is_foreign(self, device: m.Device) -> bool:
        is_ours = device.id_tag in self._feed.numbers or kind_of(device.id_tag)[0] == "phone"
        is_known = device.id_tag in self._state.devices
        return device.device_type in (ROBOT, GUARD) and (is_known or not is_ours)

    def _named(self, device: m.Device) -> m.Device:
        labels = self._run.stage.labels.items()
        others = [label for id_tag, label in labels if id_tag != device.id_tag]
        return replace(device, label=distinct(device.label, device.id_tag, others))

    def _meet(self, device: m.Device) -> None:
        is_robot = device.device_type == ROBOT
        body = UNKNOWN_ROBOT if is_robot else {**UNKNOWN_PERSON, "person": True}
        self._run.stage.labels.setdefault(device.id_tag, device.label)
        if device.id_tag not in self._feed.numbers:
            kind = "robot" if is_robot else "guard"
            self._feed.things.add_foreign(device.id_tag, device.label, kind, body)

    def note_cameras(self, reply: m.Reply) -> None:
        """Note the addresses of pictures, and the sensors, that the DVA lists."""
        if isinstance(reply.content, m.SensorList):
            self._state.sensors(reply.content)

    # --- what is shown ---------------------------------------------------------------------

    def positions(self) -> list[list[int]]:
        """Return the positions of devices that have reported one."""
        return positions(dict(self._here()), self._feed.numbers, self._run.stage.site.frame)

    def robots(self) -> list[RobotRow]:
        """A row for each robot."""
        now = self._run.clock.now
        numbers = self._feed.numbers
        return [
            {
                **robot_row(entry, numbers[id_tag], now, self._run.stage.labels),
                "pattern": self._feed.pattern_of(id_tag),
            }
            for id_tag, entry in self._here()
            if entry.device.device_type == ROBOT
        ]

    def addresses(self) -> dict[str, str]:
        """Return where each robot takes requests, by id, whether it is heard or not."""
        return {
            id_tag: entry.device.address
            for id_tag, entry in self._state.devices.items()
            if entry.device.device_type == ROBOT
        }

    def stopped(self) -> list[str]:
        """Return the robots that an emergency holds, by id."""
        now = self._run.clock.now
        devices = self._state.devices.items()
        return [id_tag for id_tag, entry in devices if emergency_of(entry, now, {}) is not None]

    def _here(self) -> Iterator[tuple[str, DeviceState]]:
        """Yield the devices on the newest list of the DVA."""
        for id_tag, entry in self._state.devices.items():
            if entry.listed >= self._listed:
                yield id_tag, entry
