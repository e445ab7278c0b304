"""Robots and guards from outside the scenario: they have joined by themselves, or are fakes.

Pages show only what the DVA knows of them: presence, place and mode.
"""

from __future__ import annotations

from typing import Final

from dva_sim.console.robots.shown_mode import EMERGENCY, emergency_shown
from dva_sim.console.views.feed import Feed
from dva_sim.console.views.things import UNKNOWN_PERSON, UNKNOWN_ROBOT
from dva_sim.console.wire.rows import EmergencyShown, RobotRow
from dva_sim.core.registry import GUARD, ROBOT, DeviceEntry
from dva_sim.kernel.labels import distinct
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import kind_of

MOST: Final = 64


def foreign_robot_row(number: int, mode: str, emergency: EmergencyShown | None = None) -> RobotRow:
    """A robot of which little is known; what is not is null."""
    return {
        "i": number,
        "mode": mode if emergency is None else EMERGENCY,
        "emergency": emergency,
        "stop_reason": "",
        "pattern": None,
        "battery": None,
        "holder": None,
        "holder_label": None,
        "session_age_s": None,
        "watchdog_left_s": None,
        "set_speed_mps": None,
        "set_turn_rate_radps": None,
        "queue": None,
        "lost": None,
        "commands_hz": None,
        "refused": None,
        "timeouts": None,
        "camera": None,
    }


class ForeignDevices:
    """Those of a run.

    Args:
        feed: Gives numbers.
    """

    def __init__(self, run: Run, feed: Feed) -> None:
        self._run = run
        self._feed = feed
        self._version = -1
        self._known: dict[str, str] = {}  # kinds, by id
        self._cameras: dict[str, str | None] = {}

    @property
    def is_anybody(self) -> bool:
        """Return True if somebody from outside has ever come."""
        return bool(self._known)

    def come(self) -> bool:
        """Return True if a device is new since the last call; each has a number from then on."""
        registry = self._run.dva.core.registry
        if registry.version == self._version:
            return False
        self._version = registry.version
        new = [e for i, e in registry.entries.items() if self._is_new(i, e)]
        for entry in new[: MOST - len(self._known)]:
            self._meet(entry)
        return bool(new)

    def _is_new(self, id_tag: str, entry: DeviceEntry) -> bool:
        is_shown = id_tag in self._feed.numbers or kind_of(id_tag)[0] == "phone"
        return entry.kind in (ROBOT, GUARD) and not is_shown and len(self._known) < MOST

    def _meet(self, entry: DeviceEntry) -> None:
        device = entry.device
        is_robot = entry.kind == ROBOT
        self._known[device.id_tag] = "robot" if is_robot else "guard"
        body = UNKNOWN_ROBOT if is_robot else {**UNKNOWN_PERSON, "person": True}
        label = distinct(device.label, device.id_tag, self._run.stage.labels.values())
        self._run.stage.labels.setdefault(device.id_tag, label)
        self._feed.things.add_foreign(device.id_tag, label, self._known[device.id_tag], body)

    def positions(self) -> list[list[int]]:
        """Return the positions of devices that have reported one."""
        frame = self._run.stage.site.frame
        rows = []
        for id_tag, entry in self._here():
            if entry.position is not None:
                x, y = frame.to_xy(entry.position.latitude, entry.position.longitude)
                rows.append([self._feed.numbers[id_tag], round(100 * x), round(100 * y), 0, 0])
        return rows

    def robots(self) -> list[RobotRow]:
        """A row for each robot."""
        labels = self._run.stage.labels
        core = self._run.dva.core
        stopped = {
            robot: emergency_shown(stop.message(self._run.clock.now), self._run.clock.now, labels)
            for robot, stop in core.emergencies.stopped().items()
        }
        return [
            {
                **foreign_robot_row(self._feed.numbers[id_tag], entry.mode, stopped.get(id_tag)),
                "pattern": self._feed.pattern_of(id_tag),
                "camera": self._cameras.get(id_tag),
            }
            for id_tag, entry in self._here()
            if self._known[id_tag] == "robot"
        ]

    def note_cameras(self, reply: m.Reply) -> None:
        """Note the addresses of pictures that the DVA lists."""
        if isinstance(reply.content, m.SensorList):
            self._cameras = {one.device: one.camera_url for one in reply.content.devices}

    def addresses(self) -> dict[str, str]:
        """Return where each robot that is here takes requests, by id."""
        return {
            id_tag: entry.device.address
            for id_tag, entry in self._here()
            if self._known[id_tag] == "robot"
        }

    def _here(self) -> list[tuple[str, DeviceEntry]]:
        entries = self._run.dva.core.registry.entries
        known = ((i, entries.get(i)) for i in self._known)
        return [(i, entry) for i, entry in known if entry is not None and not entry.silent]
