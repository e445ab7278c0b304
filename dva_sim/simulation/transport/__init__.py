"""The model `transports`: a session on a congested link, and a drive over what it delivers."""

from dva_sim.simulation.transport.run import SessionRecording, rehearse, simulate_session, tables
from dva_sim.simulation.transport.scenario import TransportScenario, build

__all__ = [
    "SessionRecording",
    "TransportScenario",
    "build",
    "rehearse",
    "simulate_session",
    "tables",
]
