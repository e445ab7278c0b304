"""Growth rates of counts, for status displays."""

from __future__ import annotations

from collections import deque
from typing import Final

RATE_OVER: Final = 5.0  # window over which a rate is taken [s]


class Rate:
    """Growth rate of a count."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, int]] = deque([(0.0, 0)], maxlen=int(RATE_OVER) + 1)

    def of(self, count: int, now: float) -> float:
        """Return the growth rate over the last samples [1/s]; to be called once a second."""
        self._samples.append((now, count))
        then, before = self._samples[0]
        return (count - before) / (now - then) if now > then else 0.0
