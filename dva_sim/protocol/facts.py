"""Decisions with author, reason and outcome: the facts of an audit log.

A fact is a value: a recorder of facts needs nothing else of the DVA. `AuditRecord` is its form as a
message, as far as a message can hold it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from dva_sim.protocol import messages as m
from dva_sim.protocol.wire_size import sent_time


@dataclass(frozen=True, slots=True, kw_only=True)
class Fact:
    """Decision of a person, the policy or the DVA, or its refusal.

    Attributes:
        time: Time by the DVA's clock [s].
        author: Id of the device that decided; the DVA's for its policy and its rules.
        label: Label of the author; for the policy its name, for a rule `rule`.
        role: Role of the author, if it is a control room: `look`, `drive`, `dispatch`, `supervise`.
        action: Kind of decision: `acknowledge`, `assign`, `take_off`, `false_alarm`, `escalate`,
            `note`, `set_dispatch`, `revoke`, `raise`, `take`, `take_over`, `give_back`, `expire`,
            `emergency`, `release_emergency`, `severity`.
        event: Number of the event that it is about.
        device: Id of the guard or robot that it is about.
        operator: Id of the device that drives that robot.
        task: `confirm`, `contain` or `stand_by`.
        arrival_in: Expected arrival of the device [s from then].
        mode: New dispatch mode: `automatic` or `ask_first`.
        text: Text of a note, place where an event was raised, or word for its severity.
        cause: Reason in words of the author.
        code: `messages.OK`, or why it was refused.
        outcome: Result in words; for a refusal its reason.
        advised: Id of the device that the policy would have sent; None: none, or not applicable.
        advised_in: Expected arrival of the advised device [s from then].
        waited: Time since the first report of the event [s].
    """

    time: float
    author: str
    label: str
    action: str
    role: str | None = None
    event: int | None = None
    device: str | None = None
    operator: str | None = None
    task: str | None = None
    arrival_in: float | None = None
    mode: str | None = None
    text: str | None = None
    cause: str = ""
    code: int = m.OK
    outcome: str = ""
    advised: str | None = None
    advised_in: float | None = None
    waited: float | None = None

    @property
    def overrides(self) -> bool:
        """True if a person sent another device than the policy would have sent."""
        done = self.action == "assign" and self.code == m.OK and self.role is not None
        return done and self.device != self.advised

    def row(self) -> dict[str, Any]:
        """Return the fact by names, as plain numbers and words that JSON can hold."""
        return asdict(self)

    def record(self) -> m.AuditRecord:
        """Return the fact as a message, as far as a message can hold it."""
        return m.AuditRecord(
            author=self.author,
            label=self.label[:64],
            action=self.action,
            reason=self.cause[:256],
            code=self.code,
            text=self.outcome[:256],
            role=self.role,
            event_id=self.event,
            device=self.device,
            task=self.task,
            arrival_in=_span(self.arrival_in),
            advised=self.advised,
            advised_in=_span(self.advised_in),
            operator=self.operator,
            dispatch_mode=self.mode,
            note=None if self.text is None else self.text[:256],
        )


def _span(seconds: float | None) -> float | None:
    return None if seconds is None else sent_time(seconds)
