"""The model `transports`: a session on a congested link, and a drive over what it delivers."""

from dva_sim.simulation.transports.scenario import (
    SessionRecording,
    TransportScenario,
    build,
    rehearse,
    simulate_session,
)

__all__ = [
    "SessionRecording",
    "TransportScenario",
    "build",
    "rehearse",
    "simulate_session",
]
