"""Detectors and their thresholds: smoke, heat, gas, carbon monoxide or water.

References:
    EN 50291-1:2018: alarm times of carbon monoxide alarms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple

from dva_sim.worlds.hazards.conditions import Conditions

LATEST = 3600.0  # detectors notice a hazard within this time or not at all [s]

DETECTORS: Final = ("smoke", "heat", "co", "gas", "water")

# Smoke: an optical density of 0.14 per metre, the usual value for modelling; measured alarms
# scatter widely around it (J. A. Geiman and D. T. Gottuk, Fire Safety Science 7 (2003) 197).
SMOKE_ALARM = 0.14 * math.log(10.0)  # extinction at which smoke detectors alarm [1/m]
SMOKE_LAYER = 0.1  # thickness of a layer that reaches into a detector [m]; assumed

HEAT_ALARM = 58.0  # rated temperature of a heat detector [deg C]
GAS_ALARM = 0.1  # usual setting of fixed detectors, as a share of the lower explosive limit
WATER_ALARM = 5e-3  # depth of water at which a detector alarms [m]

# --- carbon monoxide -------------------------------------------------------------------

# The standard gives four conditions: no alarm within 120 min at 30 ppm, alarms after 60 to 90
# min at 50 ppm, 10 to 40 min at 100 ppm, and within 3 min at 300 ppm. A dose rule
# (c - HARMLESS)^POWER dt with an alarm at DOSE has three parameters:
HARMLESS = 30.0  # concentration at which the dose does not grow [ppm]
_AT_50 = math.sqrt(60.0 * 90.0)  # time to alarm at 50 ppm: geometric mean of the band [min]
# 100 ppm sound within 40 min and 300 ppm within 3 min above the first power, and 100 ppm not
# before 10 min below the second; the middle of the two is taken.
POWER = 0.5 * (
    max(
        math.log(_AT_50 / 40.0) / math.log(70.0 / 20.0),
        math.log(_AT_50 / 3.0) / math.log(270.0 / 20.0),
    )
    + math.log(_AT_50 / 10.0) / math.log(70.0 / 20.0)
)
DOSE = 60.0 * _AT_50 * (50.0 - HARMLESS) ** POWER  # dose at the alarm [ppm^POWER s]


class CoAlarm:
    """A domestic carbon monoxide alarm: it sums up exposure above 30 ppm, and forgets it below.

    Its three parameters follow from the alarm times that EN 50291 prescribes: it keeps them by
    construction. How fast it forgets is assumed: as fast as it learns.
    """

    def __init__(self) -> None:
        self._dose = 0.0

    def add(self, ppm: float, dt: float) -> bool:
        """Take in the air of the last `dt` [s]; whether it sounds."""
        excess = ppm - HARMLESS
        rate = math.copysign(abs(excess) ** POWER, excess)
        self._dose = max(0.0, self._dose + rate * dt)
        return bool(self._dose >= DOSE)


# --- any detector ----------------------------------------------------------------------
class DetectorAlarm(NamedTuple):
    """Response of a detector to a hazard that begins at 0.

    Attributes:
        sounds: Predicate of an age [s], and the time since the last query [s]: True if it sounds.
            Ages ascend.
        reached: Before this age it does not sound, whatever `sounds` says [s].
        at_latest: At this age it sounds, whatever `sounds` says [s].
    """

    sounds: Callable[[float, float], bool]
    reached: float = 0.0
    at_latest: float = math.inf


def alarm_in(detector: str, air: Callable[[float], Conditions]) -> DetectorAlarm:
    """Return a kind of detector that knows the air around it at each age [s], and the floor."""
    carbon_monoxide = CoAlarm()
    sounds: dict[str, Callable[[float, float], bool]] = {
        "smoke": lambda age, dt: air(age).extinction >= SMOKE_ALARM,
        "heat": lambda age, dt: air(age).temperature >= HEAT_ALARM,
        "co": lambda age, dt: carbon_monoxide.add(air(age).co, dt),
        "gas": lambda age, dt: air(age).explosive >= GAS_ALARM,
        "water": lambda age, dt: air(age).water >= WATER_ALARM,
    }
    return DetectorAlarm(sounds[detector])
