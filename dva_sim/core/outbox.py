"""What the DVA wants delivered."""

from __future__ import annotations

from dataclasses import dataclass

from dva_sim.protocol import messages as m


@dataclass(frozen=True, slots=True)
class Send:
    """A message that the DVA wants delivered: to whom, what, and in which session."""

    to: str
    body: m.Body
    session: int = 0
