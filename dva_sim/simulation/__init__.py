"""From a scenario and a seed to what happened."""

from dva_sim.simulation.run import Recording, rehearse, simulate

__all__ = ["Recording", "rehearse", "simulate"]
