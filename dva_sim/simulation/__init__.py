"""From a scenario and a seed to what happened."""

from dva_sim.simulation.run import Recording, simulate

__all__ = ["Recording", "simulate"]
