"""Self-check of the emulated link, measured with real packets.

Datagrams cross it from one namespace to the other; delay, jitter, losses and rate are counted
where they arrive, and not where they are decided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from dva_sim.network.link import LinkConfig
from dva_sim.network.link.losses import Bursts
from dva_sim.network.pattern_runs import UNLIMITED_BPS
from dva_sim.validation.network.real_side.cell import EmulatedJob, EmulatedOutcome, run_job

Floats = NDArray[np.float64]
_DELAY_BAND_S = 1e-3
_RATE_BAND = 0.02
_SIGMAS = 3.0


@dataclass(frozen=True)
class LinkFinding:
    """One measured property.

    Attributes:
        name: Name of the property.
        unit: Unit of the numbers.
        wanted: Value set for the link.
        found: Measured value.
        band: Largest difference that passes.
    """

    name: str
    unit: str
    wanted: float
    found: float
    band: float

    @property
    def passed(self) -> bool:
        """True if the value lies within its band."""
        return abs(self.found - self.wanted) <= self.band

    def __str__(self) -> str:
        verdict = "ok" if self.passed else "MISSED"
        numbers = f"{self.found:8.3f} wanted {self.wanted:8.3f} within {self.band:.3f} {self.unit}"
        return f"{self.name:24} {numbers:52} {verdict}"


@dataclass(frozen=True)
class Probe:
    """Datagrams at equal intervals over a link, and the measured properties.

    Attributes:
        wire: Settings of the link.
        count: Datagrams.
        interval_s: Interval between two datagrams [s].
        size: Packet size including headers [B].
        find: Findings from the wire, the times of sending and arrival [s] and their numbers.
    """

    wire: LinkConfig
    count: int
    interval_s: float
    size: int
    find: Callable[[Crossing], list[LinkFinding]]

    def job(self, rootless: bool) -> EmulatedJob:
        """Return the job of the run, long enough for the last packet to arrive."""
        wire = self.wire
        linger_s = wire.delay_s + wire.jitter_s + 0.1
        linger_s += max(0.0, self.count * (8 * self.size / wire.rate_bps - self.interval_s))
        values = {"count": self.count, "size": self.size, "interval_s": self.interval_s}
        bound_s = self.count * self.interval_s + linger_s + 10.0
        return EmulatedJob(
            "probe", wire, bound_s=bound_s, arguments=values | {"linger_s": linger_s},
            rootless=rootless,
        )  # fmt: skip


@dataclass(frozen=True)
class Crossing:
    """Datagrams that were sent and that arrived.

    Attributes:
        wire: Settings of the link.
        size: Packet size [B].
        sent: Send time of each packet [s], shape `(n,)`.
        numbers: Numbers of the packets that arrived, in the order of arrival, shape `(m,)`.
        arrived: Arrival times [s], shape `(m,)`.
    """

    wire: LinkConfig
    size: int
    sent: Floats
    numbers: NDArray[np.int_]
    arrived: Floats

    @classmethod
    def of(cls, probe: Probe, outcome: EmulatedOutcome) -> Crossing:
        """Combine the notes of both ends."""
        sent = np.array([at for _, _, at in outcome.operator])
        numbers = np.array([number for _, number, _ in outcome.robot], dtype=int)
        arrived = np.array([at for _, _, at in outcome.robot])
        return cls(probe.wire, probe.size, sent, numbers, arrived)

    @property
    def delays(self) -> Floats:
        """One-way delays [s], shape `(m,)`."""
        return np.asarray(self.arrived - self.sent[self.numbers])

    @property
    def lost(self) -> NDArray[np.bool_]:
        """Mark packets that did not arrive, shape `(n,)`."""
        return ~np.isin(np.arange(len(self.sent)), self.numbers)


def check_link(rootless: bool = False) -> list[LinkFinding]:
    """Measure the emulated link; some ten seconds.

    Args:
        rootless: Take a user namespace also where root could do without.

    Raises:
        EmulatorError: the link cannot be set up here.
    """
    findings = []
    for probe in PROBES:
        outcome = run_job(probe.job(rootless))
        findings += probe.find(Crossing.of(probe, outcome))
    return findings


def find_delay(crossing: Crossing) -> list[LinkFinding]:
    """Return the median and the 95th percentile of a constant delay."""
    expected_ms = 1e3 * crossing.wire.delay_s
    p50, p95 = (1e3 * float(p) for p in np.percentile(crossing.delays, (50, 95)))
    band = 1e3 * _DELAY_BAND_S
    return [
        LinkFinding("delay, median", "ms", expected_ms, p50, band),
        LinkFinding("delay, 95th percentile", "ms", expected_ms, p95, band),
    ]


def find_jitter(crossing: Crossing) -> list[LinkFinding]:
    """Return the half-width of a uniform law, and whether packets overtake as they may.

    From the standard deviation, which a single late packet does not move.
    """
    expected_ms = 1e3 * crossing.wire.jitter_s
    jitter_ms = 1e3 * float(np.std(crossing.delays)) * np.sqrt(3)
    overtaken = float(np.mean(np.diff(crossing.numbers) < 0))
    interval = float(np.mean(np.diff(crossing.sent)))
    share = 0.5 * (1 - interval / (2 * crossing.wire.jitter_s)) ** 2
    sigma = np.sqrt(share * (1 - share) / len(crossing.numbers))
    return [
        LinkFinding("jitter, half-width", "ms", expected_ms, float(jitter_ms), 1e3 * _DELAY_BAND_S),
        LinkFinding("overtaken", "", share, overtaken, float(_SIGMAS * sigma)),
    ]


def find_loss(crossing: Crossing) -> list[LinkFinding]:
    """Return the share of independent losses."""
    share = crossing.wire.loss
    lost = crossing.lost
    sigma = np.sqrt(share * (1 - share) / len(lost))
    return [LinkFinding("loss", "", share, float(lost.mean()), float(_SIGMAS * sigma))]


def find_bursts(crossing: Crossing) -> list[LinkFinding]:
    """Return the mean length of runs of losses, which is distributed geometrically."""
    runs = [sum(1 for _ in run) for lost, run in groupby(crossing.lost) if lost]
    bursts = crossing.wire.bursts
    mean = (bursts and bursts.mean_packets) or 1.0
    sigma = np.sqrt(mean * (mean - 1) / len(runs))
    return [
        LinkFinding("run of losses, mean", "packets", mean, float(np.mean(runs)), _SIGMAS * sigma)
    ]


def find_rate(crossing: Crossing) -> list[LinkFinding]:
    """Return bits that arrive per second while packets wait."""
    expected_kbps = 1e-3 * crossing.wire.rate_bps
    bits = 8 * crossing.size * (len(crossing.arrived) - 1)
    rate_kbps = 1e-3 * bits / float(crossing.arrived[-1] - crossing.arrived[0])
    return [LinkFinding("rate", "kbit/s", expected_kbps, rate_kbps, _RATE_BAND * expected_kbps)]


_fast = partial(LinkConfig, rate_bps=UNLIMITED_BPS)
PROBES = (
    Probe(_fast(delay_s=0.05), 300, 0.004, 100, find_delay),
    Probe(_fast(delay_s=0.05, jitter_s=0.02, reorder=True), 1500, 1e-3, 100, find_jitter),
    Probe(_fast(loss=0.1), 4000, 5e-4, 100, find_loss),
    Probe(_fast(loss=0.1, bursts=Bursts(mean_packets=4.0)), 4000, 5e-4, 100, find_bursts),
    Probe(LinkConfig(rate_bps=1e6, queue_packets=400), 250, 4e-3, 1000, find_rate),
)
"""Load on the link; light enough for a slow machine."""
