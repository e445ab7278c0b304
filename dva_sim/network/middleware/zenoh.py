"""Zenoh, peer to peer: the operator connects to the robot, nobody scouts."""

from __future__ import annotations

import json
import time
from typing import Any, Final, Literal

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
_AGAIN: Final = 0.1  # interval of checks for the other end [s]


class ZenohTransport(CommandTransport):
    """Zenoh.

    Args:
        carrier: Transport protocol of its session.
        congestion: `drop`: what finds no room is dropped. `block`: the sender waits.
        reliable: True to send lost data again where the carrier does not do that itself.
        express: True to send messages at once instead of in batches.
    """

    title = "Zenoh"
    library = "zenoh"
    extra = "zenoh"

    def __init__(
        self,
        carrier: Literal["tcp", "udp"] = "tcp",
        congestion: Literal["drop", "block"] = "drop",
        reliable: bool = True,
        express: bool = False,
    ) -> None:
        for key, value, choices in (
            ("carrier", carrier, ("tcp", "udp")),
            ("congestion", congestion, ("drop", "block")),
        ):
            if value not in choices:
                raise ConfigError(f"{key} {value!r} should be one of {', '.join(choices)}")
        self.carrier = carrier
        self.congestion = congestion
        self.reliable = reliable
        self.express = express

    @override
    def near(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return _ZenohEnd(self, place, receive, is_near=True)

    @override
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return _ZenohEnd(self, place, receive, is_near=False)


class _ZenohEnd(TransportEnd):
    def __init__(
        self, options: ZenohTransport, place: Rendezvous, receive: Receive, is_near: bool
    ) -> None:
        import zenoh

        endpoint = f"{options.carrier}/{place.far}:{place.port}"
        config = zenoh.Config()
        settings: dict[str, Any] = {
            "mode": "peer",
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
            f"{'connect' if is_near else 'listen'}/endpoints": [endpoint],
        }
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        self._session = zenoh.open(config)
        hears, tells = (PICTURES, COMMANDS)[:: 1 if is_near else -1]
        self._subscriber = self._session.declare_subscriber(
            hears, lambda sample: receive(sample.payload.to_bytes())
        )
        self._publisher = self._session.declare_publisher(
            tells,
            congestion_control=getattr(zenoh.CongestionControl, options.congestion.upper()),
            reliability=getattr(
                zenoh.Reliability, "RELIABLE" if options.reliable else "BEST_EFFORT"
            ),
            express=options.express,
        )
        if is_near:
            while not self._publisher.matching_status.matching:
                if time.monotonic() > place.ready_by:
                    self.close()
                    raise TransportError("the robot does not answer")
                time.sleep(_AGAIN)

    @override
    def send(self, data: bytes) -> bool:
        self._publisher.put(data)
        return True

    @override
    def close(self) -> None:
        self._session.close()
