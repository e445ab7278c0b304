"""Facts for alarms from messages: lost robots, and responders that are available."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.attached.lines import SILENT_AFTER
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.wire.rows import RobotRow
from dva_sim.core.registry import GUARD, ROBOT
from dva_sim.protocol import messages as m


class RemoteAlarmFacts:
    """Alarm facts from messages alone; a robot's watchdog shows only as silence.

    Args:
        system: System to which the console is attached.
    """

    def __init__(self, system: AttachedSystem) -> None:
        self._system = system

    def lost(self, robots: Sequence[RobotRow]) -> Iterator[tuple[str, str]]:
        """Robots of which nothing is heard since they were driven."""
        for entry in self._system.state.devices.values():
            status = entry.status
            driven = isinstance(status, m.RobotStatus) and status.mode == Mode.TELEOPERATION.value
            if driven and entry.heard is not None and self._is_long_ago(entry.heard):
                yield entry.device.label, "nothing is heard of it"

    def broken(self) -> tuple[()]:
        """None is known: the rules are judged where robots and DVA are."""
        return ()

    def is_somebody_free(self) -> bool:
        """Return True if somebody is listed who is assigned to no open event."""
        events = self._system.agent.events.values()
        engaged = {status.responder for status in events if status.closed_for is None}
        return any(
            entry.device.device_type in (ROBOT, GUARD)
            and not self._is_long_ago(entry.listed)
            and id_tag not in engaged
            for id_tag, entry in self._system.state.devices.items()
        )

    def _is_long_ago(self, when: float) -> bool:
        return self._system.clock.now - when > SILENT_AFTER
