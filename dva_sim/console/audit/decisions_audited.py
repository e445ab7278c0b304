"""Rows of the audit log about decisions: what people decide here, and what the DVA tells of.

A decision of this console is one row: who asked for it at which page, what the DVA answered, and
what its own record of it says beside, such as whom the policy would have sent. Of everybody else's
decisions there is the record alone. Where nobody answers, the outcome is `unknown`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Protocol, Unpack

from typing_extensions import override

from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.audit.audited import DONE, Audited
from dva_sim.console.wire.actions import ACTIONS, Asked, Audit
from dva_sim.console.wire.seats import REFUSAL, Answered
from dva_sim.network.realtime import PacedClock
from dva_sim.protocol import messages as m

RECORD_WITHIN: Final = 0.5  # longest wait for the DVA's record after its answer [s]


class DecidingSystem(Protocol):
    """System on which people decide, as far as rows tell of it.

    Attributes:
        clock: Clock of the console.
    """

    clock: PacedClock

    @property
    def role(self) -> str:
        """Role that the DVA grants this console."""

    def named(self, given: str) -> str:
        """Return the name of a device by its id."""

    def age_of(self, event: int | None) -> float | None:
        """Return how long ago an event was first reported [s]."""


@dataclass
class AskedDecision:
    """A decision of which the DVA's answer or its record is still to come.

    Attributes:
        action: Name that the DVA uses for it.
        event: About which event; None: none, or one that has no number yet.
        client: Client of the page.
        record: Record published by the DVA.
        finish: Callback that reports the result; None: no reply yet.
    """

    action: str
    event: int | None
    client: str
    record: m.AuditRecord | None = None
    finish: Callable[[], object] | None = None

    def matches(self, record: m.AuditRecord) -> bool:
        """Return True if a record can be that of this decision."""
        fits = record.action == self.action and self.event in (None, record.event_id)
        return fits and self.record is None


class DecisionAudit(Audited):
    """Keeps the audit log of a console, with the decisions of its DVA.

    Args:
        keeper: Keeper of the file.
        system: System of the DVA.
        author: Name of the person at a page.
        room: Function that returns the id of the control room of a page's person, if there is one.
        others: Ids of the console's control rooms by which people decide in other regions.
    """

    def __init__(
        self,
        keeper: AuditKeeper,
        system: DecidingSystem,
        author: Callable[[str], str],
        room: Callable[[str], str | None],
        others: Collection[str] = (),
    ) -> None:
        super().__init__(keeper, author, system.named)
        self._system = system
        self._room = room
        self._others = others
        self._rooms: set[str | None] = set()  # control rooms by which people have decided here
        self._asked: dict[str, AskedDecision] = {}  # by the id of the action

    @override
    def answered(self, what: str, client: str, line: Asked, on_result: OnResult) -> OnResult:
        # A decision waits a moment for the DVA's record of it.
        report = super().answered(what, client, line, on_result)
        if ACTIONS[what].audit is not Audit.DVA:
            return report
        number = str(line["id"])
        decision = self._asked[number] = AskedDecision(_action(what), line.get("event"), client)

        def wait(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            self._rooms.add(self._room(client))
            decision.finish = partial(report, ok, text, **more)
            if not ok or decision.record is not None:
                decision.finish()
            else:
                self._system.clock.call_after(RECORD_WITHIN, self._finish, number)

        return wait

    def _finish(self, number: str) -> None:
        decision = self._asked.get(number)
        if decision is not None and decision.finish is not None:
            decision.finish()

    def heard(self, record: m.AuditRecord) -> None:
        """Take the DVA's record of a decision."""
        for number, decision in self._asked.items():
            if decision.matches(record) and record.author in (
                self._room(decision.client),
                *self._others,
            ):
                decision.record = record
                self._finish(number)
                return
        if record.code == m.OK or record.author not in self._rooms:  # else its answer has said so
            self._put(record, record.label)

    @override
    def _note(self, what: str, client: str, line: Asked, outcome: str, text: str) -> None:
        decision = self._asked.pop(str(line["id"]), None)
        if decision is None:
            super()._note(what, client, line, outcome, text)
        elif decision.record is not None:
            self._put(decision.record, self._author(client))
        else:
            self._note_answer(decision, client, line, outcome, text)

    def _put(self, record: m.AuditRecord, author: str) -> None:
        arguments: Asked = {
            "task": record.task,
            "mode": record.dispatch_mode,
            "operator": record.operator and self._label(record.operator),
            "arrival_s": record.arrival_in,
            "waited_s": self._system.age_of(record.event_id),
        }
        details: Asked = {
            key: _short(value) for key, value in arguments.items() if value is not None
        }
        if record.action == "assign":
            details["advised"] = record.advised and self._label(record.advised)
            details["advised_s"] = _short(record.advised_in)
        if record.code != m.OK:
            details["code"] = record.code
        self.keeper.put(
            self.keeper.entry(
                record.action.replace("_", " "),
                author,
                device=record.author,
                role=record.role or "",
                event=record.event_id,
                subject=(record.device and self._label(record.device)) or "",
                cause=record.reason,
                outcome=DONE if record.code == m.OK else REFUSAL,
                text=": ".join(text for text in (record.note, record.text) if text),
                details=details,
            )
        )

    def _note_answer(
        self, decision: AskedDecision, client: str, line: Asked, outcome: str, text: str
    ) -> None:
        """Note a decision by request and answer, which are all that is known."""
        values = {key: line[key] for key in ("task", "mode", "kind", "severity") if key in line}
        waited = self._system.age_of(decision.event)
        self.keeper.put(
            self.keeper.entry(
                decision.action.replace("_", " "),
                self._author(client),
                device=self._room(client) or "",
                role=self._system.role,
                event=decision.event,
                subject=self._label(str(line.get("device", ""))),
                cause=str(line.get("reason") or ""),
                outcome=outcome,
                text=": ".join(word for word in (line.get("text"), text) if word),
                details=values if waited is None else values | {"waited_s": _short(waited)},
            )
        )


def _action(what: str) -> str:
    """Return the DVA's name for an action of a page."""
    return "set_dispatch" if what == "dispatch_mode" else what.removeprefix("event_")


def _short(value: Any) -> Any:
    """Return a time to the millisecond; all else as it is."""
    return round(value, 3) if isinstance(value, float) else value
