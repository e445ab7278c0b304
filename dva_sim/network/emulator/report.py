"""The packets of an emulated link, and the lateness of its forwarder, counted while it runs."""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import asdict, dataclass, field
from typing import Any

from dva_sim.network.link import Link

LATE_S = 0.005
"""A forwarder whose 99th percentile of lateness is above this has disturbed the run [s]."""

_MIN_DURATION_S = 1e-6
_STEP = math.log(1.01)


class Durations:
    """Durations, counted in steps of one percent: however many there are, memory is bounded."""

    def __init__(self) -> None:
        self._counts: Counter[int] = Counter()
        self.longest_s = math.nan

    def add(self, duration: float) -> None:
        """Count one [s]."""
        self._counts[
            math.ceil(math.log(max(duration, _MIN_DURATION_S) / _MIN_DURATION_S) / _STEP)
        ] += 1
        if not duration <= self.longest_s:
            self.longest_s = duration

    def quantile(self, share: float) -> float:
        """Return the duration [s] that a share does not exceed, within one percent; nan if none."""
        left = share * self._counts.total()
        for step in sorted(self._counts):
            left -= self._counts[step]
            if left <= 0:
                return min(self.longest_s, _MIN_DURATION_S * math.exp(step * _STEP))
        return math.nan


@dataclass
class LinkFlow:
    """One direction of an emulated link while it runs.

    Attributes:
        link: Link model that decides the fate of each packet.
        passed: Packets that came out.
        passed_bytes: Bytes of these [B].
        waits: Their times inside.
    """

    link: Link
    passed: int = 0
    passed_bytes: int = 0
    waits: Durations = field(default_factory=Durations)

    def report(self) -> DirectionReport:
        """Count as far as it has come."""
        link = self.link
        quantile = self.waits.quantile
        return DirectionReport(
            offered_packets=link.offered,
            passed_packets=self.passed,
            passed_bytes=self.passed_bytes,
            lost_by_chance=link.lost - link.cut,
            lost_in_queue=link.dropped,
            lost_in_outage=link.cut,
            waited_p50_s=quantile(0.5),
            waited_p95_s=quantile(0.95),
            waited_max_s=self.waits.longest_s,
        )


@dataclass(frozen=True)
class DirectionReport:
    """The packets of one direction.

    Attributes:
        offered_packets: Packets that entered the link; those that neither came out nor were lost
            were still inside at the end.
        passed_packets: Packets that came out.
        passed_bytes: Bytes of these, with all headers [B].
        lost_by_chance: Packets lost by `loss`, in bursts or not, or as recorded.
        lost_in_queue: Packets that found the queue full.
        lost_in_outage: Packets that met an outage or a partition.
        waited_p50_s: Median of the time from entering to coming out [s].
        waited_p95_s: 95th percentile of it [s].
        waited_max_s: Longest time [s].
    """

    offered_packets: int
    passed_packets: int
    passed_bytes: int
    lost_by_chance: int
    lost_in_queue: int
    lost_in_outage: int
    waited_p50_s: float
    waited_p95_s: float
    waited_max_s: float


@dataclass(frozen=True)
class LinkReport:
    """The packets of an emulated link, and how punctual its forwarder was.

    Attributes:
        up: From the near end to the far one.
        down: From the far end to the near one.
        late_p50_s: Median lateness of the forwarder [s].
        late_p99_s: 99th percentile of it [s].
        late_max_s: Longest lateness [s].
        overrun_packets: Packets that the kernel dropped because the forwarder was too slow.
    """

    up: DirectionReport
    down: DirectionReport
    late_p50_s: float
    late_p99_s: float
    late_max_s: float
    overrun_packets: int = 0

    @property
    def is_disturbed(self) -> bool:
        """True if the machine, and not the link alone, determined when packets came out."""
        return self.late_p99_s > LATE_S or self.overrun_packets > 0

    def to_json(self) -> str:
        """Return one line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> LinkReport:
        """Return the report of such a line."""
        data: dict[str, Any] = json.loads(text)
        up, down = (DirectionReport(**data.pop(direction)) for direction in ("up", "down"))
        return cls(up, down, **data)
