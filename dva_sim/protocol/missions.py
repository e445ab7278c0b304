"""Missions: what a robot is ordered to do by itself, and its progress; also in `messages`."""

from __future__ import annotations

from dataclasses import dataclass

from dva_sim.protocol.places import Position


@dataclass(frozen=True, slots=True)
class GoTo:
    """Visit these places in this order; 1 to 64 of them."""

    waypoints: tuple[Position, ...]


@dataclass(frozen=True, slots=True)
class Patrol:
    """Visit these places in this order, 1 to 64 of them, and repeat.

    Attributes:
        waypoints: The places of one lap.
        laps: Number of laps, up to 1000; 0: until the mission is cancelled.
    """

    waypoints: tuple[Position, ...]
    laps: int


@dataclass(frozen=True, slots=True)
class Inspect:
    """Go to where the place of an event can be seen, face it, and say what is in view.

    Attributes:
        event_id: The event.
        kind: `fire`, `gas_leak` or `flood`.
        position: Position of the event.
    """

    event_id: int
    kind: str
    position: Position


@dataclass(frozen=True, slots=True)
class ReturnToBase:
    """Go back to where the robot stood when it was switched on."""


@dataclass(frozen=True, slots=True)
class CancelMission:
    """Give up the mission and stand idle."""


@dataclass(frozen=True, slots=True)
class GetMissionStatus:
    """Ask a robot how its newest mission stands; answered with `MissionStatus`."""


@dataclass(frozen=True, slots=True)
class MissionStatus:
    """State of a robot's newest mission: published on every change, and returned on request.

    Attributes:
        mission_id: MessageID of the message that began it; 0 if there was none.
        mission_state: `none`, `under_way`, `waiting`, `replanning`, `done` or `failed`.
        waypoints_left: Places still to be visited, of the present lap; at most 64.
        reason: Reason in words, up to 256 characters; may be empty.
    """

    mission_id: int
    mission_state: str
    waypoints_left: int
    reason: str
