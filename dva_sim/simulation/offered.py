"""What carries the messages of a scenario, and what they ask of a robot's link."""

from __future__ import annotations

from dva_sim.network.connecting import Connector, Load
from dva_sim.network.link import LinkConfig
from dva_sim.network.stream import HEADERS, MSS
from dva_sim.scenario import Scenario

# Beside pictures and commands: heartbeats, status, sensors, orders, replies; assumed, and ample.
OTHERS_HZ = 20.0
MESSAGE = 1000  # more than any but a picture takes, with all headers [B]
TOGETHER = 10  # messages that may coincide with a picture; assumed


def connector_of(scenario: Scenario) -> Connector:
    """Makes the connections of a scenario's network."""
    return Connector(scenario.transport, scenario.network_depth, scenario.zeromq, load_of(scenario))


def link_of(scenario: Scenario) -> LinkConfig:
    """A robot's link as it is played.

    Packets that are sent together share their luck only where each carries a message.
    """
    link = scenario.link
    by_message = scenario.transport == "zeromq" and scenario.network_depth == "message"
    if by_message or "draws" in link.model_fields_set:
        return link
    return link.model_copy(update={"draws": "independent"})


def load_of(scenario: Scenario) -> Load:
    """What a robot's link is offered at most, in the busier direction."""
    frame = scenario.camera.frame_bytes
    picture = frame + -(-frame // MSS) * HEADERS
    messages = MESSAGE * (scenario.command.rate_hz + OTHERS_HZ)
    rate = 8.0 * (scenario.camera.rate_hz * picture + messages)
    return Load(rate, picture + TOGETHER * MESSAGE)
