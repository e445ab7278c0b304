"""From a scenario and a seed to what happened."""

from dva_sim.simulation.recording import Playback, Recording
from dva_sim.simulation.run import rehearse, simulate

__all__ = ["Playback", "Recording", "rehearse", "simulate"]
