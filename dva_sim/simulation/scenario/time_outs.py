"""Time that an answer takes over a link, and time-outs that allow for it."""

from __future__ import annotations

from dva_sim.agents.robot.command_queue import mean_of
from dva_sim.network.link import LinkConfig
from dva_sim.simulation.scenario.scenario import (
    Scenario,
    robot_profiles,
)

TRIPS_OF_A_START = 4  # round trips: three until a new connection stands, one for the request
USUAL_S = 9.0  # default time-out, if the link leaves time for an answer [s]
MAX_TIMEOUT_S = 120.0
_ROOM = 1.25  # factor on the time needed, if that exceeds the default


def time_out_s(needed_s: float) -> float:
    """Return the time-out of a request that nobody gave one [s]: the usual one, or longer.

    Args:
        needed_s: Time that the first reply over a new connection takes [s].
    """
    return USUAL_S if needed_s < USUAL_S else min(_ROOM * needed_s, MAX_TIMEOUT_S)


def request_timeout_s(scenario: Scenario) -> float:
    """Return the time-out of a request: as given, else as the link and the backbone need it [s]."""
    timeout_s = scenario.request.timeout_s
    backbone = scenario.dva.backbone
    needed_s = start_needs_s(scenario)
    if backbone is not None:
        needed_s = max(needed_s, TRIPS_OF_A_START * round_trip_s(backbone))
    return time_out_s(needed_s) if timeout_s is None else timeout_s


def command_timeout_s(scenario: Scenario) -> float:
    """Return the time-out of a command that is to be answered, likewise [s]."""
    timeout_s = scenario.command.timeout_s
    return time_out_s(start_needs_s(scenario)) if timeout_s is None else timeout_s


def start_needs_s(scenario: Scenario) -> float:
    """Return how long the first answer over a new connection to a robot takes [s]."""
    return TRIPS_OF_A_START * round_trip_s(scenario.link) + mean_processing_s(scenario)


def command_needs_s(scenario: Scenario) -> float:
    """Return how long the reply to a command takes, over an open connection [s]."""
    return round_trip_s(scenario.link) + mean_processing_s(scenario)


def round_trip_s(link: LinkConfig) -> float:
    """Mean delay of a link there and back, without queues and losses [s]."""
    return sum(link.toward(direction).delay_s for direction in ("up", "down"))


def mean_processing_s(scenario: Scenario) -> float:
    """Mean time that a message takes the slowest robot's computer [s]."""
    if scenario.robot.processing_s is not None:
        return mean_of(scenario.robot.processing_s)
    return max((mean_of(robot.processing_s) for robot in robot_profiles(scenario)), default=0.0)
