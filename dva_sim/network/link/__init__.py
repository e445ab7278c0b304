"""One direction of a link: delay, jitter, loss, rate, queue, recorded weather, outages."""

from dva_sim.network.link.config import Direction, LinkConfig, Way
from dva_sim.network.link.delay_logs import read_delay_log
from dva_sim.network.link.link import (
    Link,
    PartedLink,
    check_partitions,
    make_link,
    make_serialiser,
    part_links,
)
from dva_sim.network.link.outages import Gap, Outage, Partition
from dva_sim.network.link.rates import ConstantRate, PacketQueue, Serialiser, TraceRate
from dva_sim.network.link.recorded import read_trace
from dva_sim.network.link.time_noise import FastNoise

__all__ = [
    "ConstantRate",
    "Direction",
    "FastNoise",
    "Gap",
    "Link",
    "LinkConfig",
    "Outage",
    "PacketQueue",
    "PartedLink",
    "Partition",
    "Serialiser",
    "TraceRate",
    "Way",
    "check_partitions",
    "make_link",
    "make_serialiser",
    "part_links",
    "read_delay_log",
    "read_trace",
]

Weather = FastNoise  # its name before 0.9
