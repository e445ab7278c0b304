"""Links as a scenario describes them, alone or as the two ways of a pair."""

from typing import Any

from dva_sim.kernel.streams import Streams
from dva_sim.network.link import Link, LinkConfig, make_serialiser
from dva_sim.network.link.link import make_link

FAST = 1e12  # [bit/s]: a packet's own length costs no time
NORMAL = {"law": "normal", "sd_s": 0.02}
GAMMA = {"law": "gamma", "sd_s": 0.03, "least_s": 0.04}
SHIFTED = {"law": "shifted_exponential", "least_s": 0.04}


def link(direction: Any = "up", seed: int = 1, **config: Any) -> Link:
    return make_link(LinkConfig(**config), direction, Streams(seed), "link")


def links(seed: int = 1, **config: Any) -> tuple[Link, Link]:
    """Both ways, each with its own fate."""
    settings, streams = LinkConfig(**config), Streams(seed)
    up, down = (
        Link(settings, make_serialiser(settings, way, streams, "l"), streams, f"l/{way}", way)
        for way in ("up", "down")
    )
    return up, down
