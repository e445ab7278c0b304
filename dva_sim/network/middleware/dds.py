"""DDS by Eclipse Cyclone DDS, which is under most ROS 2 systems; both ends name each other."""

from __future__ import annotations

import os
import time
from html import escape
from typing import Final

from typing_extensions import override

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.middleware.ends import (
    CommandTransport,
    Receive,
    Rendezvous,
    TransportEnd,
    TransportError,
)

COMMANDS = "command"
PICTURES = "picture"
_STEP: Final = 0.01  # interval of checks for the other end [s]


class DdsTransport(CommandTransport):
    """DDS over UDP.

    Args:
        reliable: True to send lost data again.
        depth: Messages kept for a reader that has not read them.
    """

    title = "DDS"
    library = "cyclonedds"
    extra = "dds"

    def __init__(self, reliable: bool = False, depth: int = 1) -> None:
        if depth < 1:
            raise ConfigError(f"depth {depth!r} should be 1 or more")
        self.reliable = reliable
        self.depth = depth

    @override
    def near(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        end = _DdsEnd(self, place, receive, is_near=True)
        end.await_robot(place.ready_by)
        return end

    @override
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return _DdsEnd(self, place, receive, is_near=False)


class _DdsEnd(TransportEnd):
    def __init__(
        self, options: DdsTransport, place: Rendezvous, receive: Receive, is_near: bool
    ) -> None:
        os.environ["CYCLONEDDS_URI"] = _configuration(place, is_near)
        from cyclonedds.core import Policy, Qos, ReadCondition, SampleState, WaitSet
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic
        from cyclonedds.util import duration

        from dva_sim.network.middleware.dds_types import Bytes  # late: start-up

        self._make = Bytes
        self._receive = receive
        self._duration = duration
        reliability = (
            Policy.Reliability.Reliable(duration(milliseconds=100))
            if options.reliable
            else Policy.Reliability.BestEffort
        )
        qos = Qos(reliability, Policy.History.KeepLast(options.depth))
        hears, tells = (PICTURES, COMMANDS)[:: 1 if is_near else -1]
        participant = DomainParticipant(0)
        self._reader = DataReader(participant, Topic(participant, hears, Bytes), qos)
        self._writer = DataWriter(participant, Topic(participant, tells, Bytes), qos)
        self._unread = WaitSet(participant)
        self._unread.attach(ReadCondition(self._reader, SampleState.NotRead))

    def await_robot(self, ready_by: float) -> None:
        """Wait until each end has found the other."""
        while not (
            self._writer.get_matched_subscriptions()
            and list(self._reader.get_matched_publications())
        ):
            if time.monotonic() > ready_by:
                raise TransportError("the robot does not answer")
            time.sleep(_STEP)

    @override
    def send(self, data: bytes) -> bool:
        self._writer.write(self._make(data))
        return True

    @override
    def serve(self, until: float) -> None:
        while (left := until - time.monotonic()) > 0:
            if self._unread.wait(self._duration(seconds=left)):
                for sample in self._reader.take(64):
                    self._receive(bytes(sample.data))

    @override
    def close(self) -> None:
        pass  # it ends with the process


def _configuration(place: Rendezvous, is_near: bool) -> str:
    """Return the configuration of Cyclone DDS: this address, the peer by name, no multicast."""
    own, peer = (place.near, place.far)[:: 1 if is_near else -1]
    return (
        "<CycloneDDS><Domain id='any'><General><Interfaces>"
        f"<NetworkInterface address='{escape(own)}' multicast='false'/></Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<Peers><Peer Address='{escape(peer)}'/></Peers></Discovery></Domain></CycloneDDS>"
    )
