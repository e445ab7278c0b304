"""Runs kept as MCAP files: written, read back, measured for a time-lapse, taken to ROS 2."""

from dva_sim.recordings.reading import Opened, read_recording
from dva_sim.recordings.writing import check_target, write_recording

__all__ = ["Opened", "check_target", "read_recording", "write_recording"]
