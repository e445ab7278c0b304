"""Mode and emergency of a robot, as every page shows them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from dva_sim.console.wire.rows import EmergencyShown
from dva_sim.protocol import messages as m

EMERGENCY: Final = "Emergency"
MANUAL: Final = "Manual"
BUTTON: Final = "its own button"
EMERGENCY_LAPSES: Final = 3.5  # a robot that is heard and no longer reports one has none [s]


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
