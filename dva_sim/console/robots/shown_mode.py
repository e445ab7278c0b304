"""Mode and emergency of a robot, as every page shows them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from dva_sim.agents.robot.controller import RobotController
from dva_sim.agents.robot.emergency_latch import EmergencyLatch
from dva_sim.console.wire.rows import EmergencyShown
from dva_sim.protocol import messages as m

EMERGENCY: Final = "Emergency"
MANUAL: Final = "Manual"
BUTTON: Final = "its own button"
EMERGENCY_LAPSES: Final = 3.5  # a robot that is heard and no longer reports one has none [s]


def shown_mode(controller: RobotController) -> str:
    """Name the mode of a robot of this process: an emergency until it is released."""
    if controller.latch.holds:
        return EMERGENCY
    return MANUAL if controller.by_hand is not None else controller.mode.value


def latch_shown(
    latch: EmergencyLatch, labels: Mapping[str, str], stopper: tuple[str, str] | None = None
) -> EmergencyShown | None:
    """Describe the emergency that holds a robot of this process; None if none does.

    Args:
        latch: The robot's latch.
        labels: Labels of devices, by id.
        stopper: Device and name of the person who last stopped it from a page.
    """
    if not latch.holds:
        return None
    by = BUTTON if latch.stopped_by is None else labels.get(latch.stopped_by, latch.stopped_by)
    if stopper is not None and stopper[0] == latch.stopped_by:
        by = stopper[1]
    return {"at_ms": round(1000 * latch.since), "by": by, "released_by": latch.released_by or ""}


def emergency_shown(
    emergency: m.RobotEmergency, heard: float, labels: Mapping[str, str]
) -> EmergencyShown | None:
    """Describe an emergency that a robot has reported; None once it is over.

    Args:
        emergency: As the robot published it.
        heard: Time of that [s].
        labels: Labels of devices, by id.
    """
    if emergency.released is not None:
        return None
    stopper = emergency.stopped_by
    by = BUTTON if stopper is None else labels.get(stopper, stopper)
    since = heard - emergency.stopped_for
    return {"at_ms": round(1000 * since), "by": by, "released_by": ""}
