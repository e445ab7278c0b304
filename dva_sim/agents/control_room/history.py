"""History of an event as received by a control room: each step, its author and its time."""

from __future__ import annotations

from typing import Final, NamedTuple

from dva_sim.protocol import messages as m

MAX_STEPS: Final = 60  # design: maximum steps of an event; then the oldest but the report go
SAME_STEP: Final = 2.0  # design: a state and its decision arrive within this time [s]
LED_BY: Final = {
    "assign": "assigned",
    "false_alarm": "refuted",
    "escalate": "escalated",
    "expire": "expired",
}
"""States by the decisions that lead to them: the decision also names its author."""


class EventStep(NamedTuple):
    """Step of an event.

    Attributes:
        time: Time [s].
        what: State as in `EventStatus`, `reported`, or a decision as in `Fact`.
        who: Label of the person, policy or rule that decided; empty if none did.
        device: Id of the device that was sent or has arrived.
        reason: Reason or text, in words.
    """

    time: float
    what: str
    who: str = ""
    device: str = ""
    reason: str = ""


class EventHistory:
    """Known steps of an event, in order of time."""

    def __init__(self) -> None:
        self.steps: list[EventStep] = []
        self._known: m.EventStatus | None = None

    def hear_status(self, status: m.EventStatus, at: float) -> None:
        """Take the DVA's statement of an event at a time [s]."""
        before = self._known
        self._known = status
        if before is None:
            self._add(EventStep(at - status.age, "reported"))
        acknowledgement = status.acknowledged
        if acknowledgement is not None and (before is None or before.acknowledged is None):
            self._add(EventStep(at - acknowledgement.ago, "acknowledge", acknowledgement.label))
        is_new = status.event_state != ("pending" if before is None else before.event_state)
        if is_new or (before is not None and status.responder != before.responder):
            responder = status.responder or status.actor
            if responder is None and before is not None and status.closed_for is None:
                responder = before.actor if before.event_state == "confirmed" else before.responder
            self._add(EventStep(at - status.state_for, status.event_state, "", responder or ""))

    def hear_record(self, record: m.AuditRecord, at: float) -> None:
        """Take the DVA's record of a decision at a time [s]."""
        if record.code != m.OK or record.action == "acknowledge":
            return  # nothing was done, or the status says so
        words = ": ".join(word for word in (self._said(record), record.reason) if word)
        step = EventStep(at, record.action, record.label, record.device or "", words or record.text)
        state = LED_BY.get(record.action)
        self.steps = [
            each
            for each in self.steps
            if each.what != state or each.who or abs(each.time - at) > SAME_STEP
        ]
        self._add(step)

    def _said(self, record: m.AuditRecord) -> str:
        """Return the words of a decision besides its reason."""
        if record.action == "severity":
            return record.text
        if record.action == "note":  # before version 1.9 notes are only in the status
            return record.note or (self._known and self._known.note) or ""
        task = record.task or "confirm"
        return "" if task == "confirm" else f"to {task.replace('_', ' ')}"

    def _add(self, step: EventStep) -> None:
        self.steps = sorted([*self.steps, step], key=lambda each: each.time)
        if len(self.steps) > MAX_STEPS:
            del self.steps[1]
