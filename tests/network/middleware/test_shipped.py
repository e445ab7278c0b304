"""The transports that are shipped keep the promises of every transport."""

import pytest

from dva_sim.network.middleware import load_transport
from dva_sim.network.middleware.registry import SHIPPED
from dva_sim.testing.promises import tried
from dva_sim.testing.transports import check_transport

EXAMPLE = "repeated_udp.py:RepeatedUdp"
VARIANTS = [
    *((name, {}) for name in SHIPPED),
    ("zeromq", {"pattern": "req-rep"}),
    ("zeromq", {"pattern": "conflate"}),
    ("websocket", {"nodelay": False}),
    ("mqtt", {"qos": 1, "nodelay": True, "broker": "near", "expiry_s": 2}),
    ("zenoh", {"carrier": "udp", "congestion": "block", "express": True}),
    ("webrtc", {"ordered": False, "retransmits": 0}),
    ("dds", {"reliable": True, "depth": 8}),
    (EXAMPLE, {"copies": 3}),
]


@pytest.mark.system
@pytest.mark.parametrize(("name", "options"), VARIANTS)
def test_every_transport_that_is_shipped_keeps_its_promises(name, options):
    if missing := load_transport(name, options)().lacks():
        pytest.skip(missing)
    outcome = tried(check_transport, name, options)
    assert (outcome.broken, outcome.warnings) == ((), ())
