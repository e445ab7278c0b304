"""Runs kept as MCAP files: written, read back, measured for a time-lapse, taken to ROS 2."""

from dva_sim.recordings.reading import Opened, read_recording
from dva_sim.recordings.writing import write_recording

__all__ = ["Opened", "read_recording", "write_recording"]
