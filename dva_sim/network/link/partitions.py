"""One link as a pair of nodes meets it whom a partition of the network keeps apart."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from fnmatch import fnmatchcase
from typing import Any

from dva_sim.errors import ConfigError
from dva_sim.guesses import hint
from dva_sim.network.link.link import Link
from dva_sim.network.link.outages import Gap, Partition


class PartedLink(Link):
    """A link that others use too, seen by a pair of nodes that it does not always serve.

    Its queue, its weather and its counts are the whole link's; a packet that is kept back does
    not take up room.

    Args:
        whole: The link.
        gaps: When it carries nothing for this pair.
    """

    def __init__(self, whole: Link, gaps: Sequence[Gap]) -> None:
        self._whole, self._gaps = whole, gaps

    def __getattr__(self, name: str) -> Any:
        return getattr(self._whole, name)

    def is_ideal(self) -> bool:
        """See `Link`."""
        return False

    def carry(self, now: float, size: int) -> float | None:
        """See `Link`."""
        if any(gap.covers(now) for gap in self._gaps):
            self._whole.offered += 1
            self._whole.lost += 1
            return None
        return self._whole.carry(now, size)

    def carry_train(self, now: float, packets: int, size: int) -> float | None:
        """See `Link`: packets that are kept back are looked at one by one."""
        if any(gap.covers(now) for gap in self._gaps):
            return None
        return self._whole.carry_train(now, packets, size)

    def backlog_bytes(self, now: float) -> float:
        """See `Link`."""
        return self._whole.backlog_bytes(now)


def check_partitions(partitions: Sequence[Partition], names: Collection[str]) -> None:
    """Refuse a partition that concerns nobody.

    Raises:
        ConfigError: no node has a name that it gives.
    """
    for partition in partitions:
        for key, pattern in (("source", partition.source), ("destination", partition.destination)):
            if not any(fnmatchcase(name, pattern) for name in names):
                problem = f"{key} {pattern!r} of a partition is nobody"
                raise ConfigError(f"{problem}; {hint(pattern, sorted(names))}")


def part_links(
    links: tuple[Link, Link], source: str, destination: str, partitions: Sequence[Partition]
) -> tuple[Link, Link]:
    """The link from one node to another and the one back, as far as partitions let them through.

    Args:
        links: The same without partitions.
        source: Name of one node.
        destination: Name of the other.
        partitions: Who does not hear whom, and when.
    """
    out = [p for p in partitions if p.parts(source, destination)]
    back = [p for p in partitions if p.parts(destination, source)]
    return (
        PartedLink(links[0], out) if out else links[0],
        PartedLink(links[1], back) if back else links[1],
    )
