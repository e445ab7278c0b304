"""Handling of an event: decisions, their authors, and notes of people."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


class Choice(NamedTuple):
    """Decision, its author, and when it was made.

    Attributes:
        author: Id of the device; the DVA's for its policy and its rules.
        label: Label of the author.
        action: Kind of decision, as in `audit.Fact`.
        time: Time [s].
        reason: Reason in words; may be empty.
        device: About whom; empty: about nobody.
    """

    author: str
    label: str
    action: str
    time: float
    reason: str = ""
    device: str = ""

    def described(self, now: float) -> str:
        """Describe the choice in words, as of now."""
        about = self.device and f" of {self.device}"
        why = self.reason and f": {self.reason}"
        did, ago = self.action.replace("_", " "), now - self.time
        return f"{did}{about} by {self.label}, {ago:.1f} s ago{why}"


@dataclass(slots=True)
class Handling:
    """Decisions on one event.

    Attributes:
        decisions: Number of decisions; a decision made on an older number is too late.
        last: The last of it.
        acknowledged: First acknowledgement.
        note: The newest.
        taken_off: Devices that the policy may no longer send there.
        expected: Time of the order [s] and expected travel time [s], by device.
        advised: Id of whom the policy has sent or would have sent last; empty: nobody.
    """

    decisions: int = 0
    last: Choice | None = None
    acknowledged: Choice | None = None
    note: str = ""
    taken_off: set[str] = field(default_factory=set)
    expected: dict[str, tuple[float, float]] = field(default_factory=dict)
    advised: str = ""

    def decide(self, choice: Choice) -> None:
        """Something was decided."""
        self.decisions += 1
        self.last = choice

    def is_already(self, author: str, action: str, device: str = "") -> bool:
        """Return True if the last decision was exactly this, by the same author."""
        last = self.last
        return last is not None and (last.author, last.action, last.device) == (
            author,
            action,
            device,
        )

    def arrival_in(self, device: str, now: float) -> float | None:
        """Return when a device that was sent is expected to arrive [s from now]."""
        if device not in self.expected:
            return None
        sent, way = self.expected[device]
        return max(0.0, sent + way - now)
