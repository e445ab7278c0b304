"""Messages between DVAs, each of which serves regions of one site, and between them and devices.

One frozen dataclass per element below `Peer` of `protocol/dva.xsd`, as in `messages`, where all of
them are found, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from dva_sim.protocol.control_room import EventStatus

MAX_REGIONS: Final = 16  # maximum regions that one DVA serves


@dataclass(frozen=True, slots=True)
class ServedRegion:
    """A region that a DVA serves.

    Attributes:
        region: Name of the region, up to 64 characters.
        epoch: Number of DVAs that have served it so far, from 1; of two claims the higher holds.
    """

    region: str
    epoch: int


@dataclass(frozen=True, slots=True)
class PeerStatus:
    """Status that a DVA publishes for the others.

    Attributes:
        regions: Regions that it serves; at most 16.
        device_count: Number of registered devices that are not silent.
        open_events: Number of open events.
        free_responders: Number of guards and robots that it could send somewhere now.
    """

    regions: tuple[ServedRegion, ...]
    device_count: int
    open_events: int
    free_responders: int


@dataclass(frozen=True, slots=True)
class HandOver:
    """A DVA asks a device of its own to register with another DVA, and to obey that one.

    Attributes:
        dva: Id of the other DVA; the device must know it already.
        address: Address of the other DVA, if the sender knows it.
    """

    dva: str
    address: str | None = None


@dataclass(frozen=True, slots=True)
class Replicate:
    """A DVA tells the deputy of a region how an event there is now.

    Attributes:
        region: Name of the region.
        epoch: Epoch of the sender, as in `ServedRegion`.
        fact: Number that grows with every fact that the sender replicates, from 1.
        event: Status of the event.
    """

    region: str
    epoch: int
    fact: int
    event: EventStatus


@dataclass(frozen=True, slots=True)
class GiveBack:
    """A region goes back to its own DVA, from the one that has taken it over.

    Attributes:
        region: Name of the region.
        epoch: Epoch in which the receiver, the region's own DVA, serves it; None: a supervisor asks
            the DVA that serves it.
    """

    region: str
    epoch: int | None = None


PeerBody = PeerStatus | HandOver | Replicate | GiveBack
