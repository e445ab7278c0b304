"""What carries the messages of a scenario, and what they ask of a robot's link."""

from __future__ import annotations

from dva_sim.network.connecting import Connector, Load
from dva_sim.network.stream import HEADERS, MSS
from dva_sim.scenario import Scenario

# Beside pictures and commands: heartbeats, status, sensors, orders, replies; assumed, and ample.
OTHERS_HZ = 20.0
MESSAGE = 1000  # more than any but a picture takes, with all headers [B]
TOGETHER = 10  # messages that may coincide with a picture; assumed


def connector_of(scenario: Scenario) -> Connector:
    """Makes the connections of a scenario's network."""
    return Connector(scenario.transport, scenario.network_depth, scenario.zeromq, load_of(scenario))


def load_of(scenario: Scenario) -> Load:
    """What a robot's link is offered at most, in the busier direction."""
    frame = scenario.camera.frame_bytes
    picture = frame + -(-frame // MSS) * HEADERS
    messages = MESSAGE * (scenario.command.rate_hz + OTHERS_HZ)
    rate = 8.0 * (scenario.camera.rate_hz * picture + messages)
    return Load(rate, picture + TOGETHER * MESSAGE)
