"""The tilt phone: accelerometer, calibration, filter, mapping, and when a command is sent."""

from dva_sim.agents.tilt.filters import FILTERS, Filter
from dva_sim.agents.tilt.phone import Phone, PhoneProfile, TiltCommand

__all__ = ["FILTERS", "Filter", "Phone", "PhoneProfile", "TiltCommand"]
