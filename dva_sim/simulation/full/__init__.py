"""From a scenario and a seed to what happened."""

from dva_sim.simulation.full.recording import Ending, Playback, Recording
from dva_sim.simulation.full.run import rehearse, simulate

__all__ = ["Ending", "Playback", "Recording", "rehearse", "simulate"]
