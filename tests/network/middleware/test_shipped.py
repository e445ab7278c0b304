"""The transports that are shipped keep the promises of every transport."""

import pytest

from dva_sim.kernel.errors import ConfigError
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


@pytest.mark.parametrize(
    ("name", "options", "named"),
    [
        ("zeromq", {"pattern": "push"}, "'push'"),
        ("mqtt", {"qos": 3}, "qos 3"),
        ("mqtt", {"broker": "middle"}, "'middle'"),
        ("zenoh", {"carrier": "quic"}, "'quic'"),
        ("dds", {"depth": 0}, "depth 0"),
        ("upd", {}, "udp"),
        ("udp", {"qos": 1}, "qos"),
    ],
)
def test_a_transport_or_an_option_that_does_not_exist_is_refused_in_a_line(name, options, named):
    with pytest.raises(ConfigError) as refused:
        load_transport(name, options)()
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)
