"""Updates of whatever runs, sent only when something in them has changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from dva_sim.console.run.lag import LagRule
from dva_sim.console.wire.lines import Tell, WorldLine
from dva_sim.console.wire.rows import ClockShown
from dva_sim.network.realtime import PacedClock


class News:
    """Tells a line unless nothing in it has changed, its time apart.

    Args:
        tell: Function that returns the callback for lines, with a key where only the newest counts.
    """

    def __init__(self, tell: Callable[[], Tell]) -> None:
        self._tell = tell
        self._newest: dict[tuple[str, object], dict[str, Any]] = {}

    def tell(self, line: WorldLine, key: object = "") -> None:
        """Tell a line; `key` tells lines of one kind apart."""
        values = {name: value for name, value in line.items() if name != "t"}
        if self._newest.get((line["k"], key)) != values:
            self._newest[line["k"], key] = values
            self._tell()(line, key)

    def forget(self, kind: str, key: object) -> None:
        """Tell the next line of a kind and key in any case."""
        self._newest.pop((kind, key), None)


def clock_shown(clock: PacedClock, lag: LagRule) -> ClockShown:
    """Return the state of the clock."""
    return {
        "factor": clock.factor,
        "paused": clock.paused,
        "lag_s": round(lag.newest, 3),
        "given_up_s": round(clock.given_up, 2),
        "held_by_lag": lag.held,
    }
