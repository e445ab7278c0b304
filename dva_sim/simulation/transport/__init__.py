"""The model `transports`: a session on a congested link, and a drive over what it delivers."""

from dva_sim.simulation.transport.run import rehearse, simulate_transports
from dva_sim.simulation.transport.scenario import TransportScenario, build

__all__ = ["TransportScenario", "build", "rehearse", "simulate_transports"]
