"""The tilt phone: hand, accelerometer, calibration, filter, mapping, and when a command is sent.

It knows persons, and neither robots nor networks: what it gives is a command, at a time. Begin with
`phone`; own filters and mappings derive from `Filter` and `Mapping`.
"""

from dva_sim.agents.tilt.accelerometer import Accelerometer, AccelerometerPart, load_part
from dva_sim.agents.tilt.app import TiltApp
from dva_sim.agents.tilt.calibration import Calibration
from dva_sim.agents.tilt.filters import Filter, known_filters, load_filter
from dva_sim.agents.tilt.given import GivenTilt
from dva_sim.agents.tilt.hand import Hand
from dva_sim.agents.tilt.mappings import Mapping, known_mappings, load_mapping
from dva_sim.agents.tilt.phone import Phone, PhoneProfile, TiltCommand, try_phone
from dva_sim.agents.tilt.phone_clock import PhoneClock
from dva_sim.agents.tilt.sources import TiltSources

__all__ = [
    "Accelerometer",
    "AccelerometerPart",
    "Calibration",
    "Filter",
    "GivenTilt",
    "Hand",
    "Mapping",
    "Phone",
    "PhoneClock",
    "PhoneProfile",
    "TiltApp",
    "TiltCommand",
    "TiltSources",
    "known_filters",
    "known_mappings",
    "load_filter",
    "load_mapping",
    "load_part",
    "try_phone",
]
