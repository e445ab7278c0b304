"""Simulation of full scenarios: from a scenario and a seed to a recording."""

from dva_sim.simulation.full.recording import Ending, Playback, Recording
from dva_sim.simulation.full.run import rehearse, simulate

__all__ = ["Ending", "Playback", "Recording", "rehearse", "simulate"]
