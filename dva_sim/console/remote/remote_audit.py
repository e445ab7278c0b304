"""The audit log at a remote DVA: what people do here, and what the DVA tells of decisions.

A decision of this console is one row: who asked for it at which page, what the DVA answered, and
what its own record of it says beside, such as whom the policy would have sent. Of everybody else's
decisions there is the record alone. Where nobody answers, the outcome is `unknown`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, Unpack

from typing_extensions import override

from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.audit.audited import Audited
from dva_sim.console.system.known_system import KnownSystem
from dva_sim.console.wire.actions import ACTIONS, Action, Asked, Audit
from dva_sim.console.wire.seats import Answered
from dva_sim.protocol import messages as m
from dva_sim.protocol.facts import Fact

RECORD_WITHIN: Final = 0.5  # the DVA's record of a decision comes so long after its answer [s]


@dataclass
class AskedDecision:
    """A decision of which the DVA's answer or its record is still to come.

    Attributes:
        action: Name that the DVA uses for it.
        event: About which event; None: none, or one that has no number yet.
        record: Record published by the DVA.
        finish: Callback that reports the result; None: no reply yet.
    """

    action: str
    event: int | None
    record: m.AuditRecord | None = None
    finish: Callable[[], object] | None = None

    def matches(self, record: m.AuditRecord) -> bool:
        """Return True if a record can be that of this decision."""
        fits = record.action == self.action and self.event in (None, record.event_id)
        return fits and self.record is None


class RemoteAudit(Audited):
    """Keeps the audit log of a console at a remote DVA.

    Args:
        keeper: Keeper of the file.
        system: System of the DVA.
        author: Name of the person at a page.
    """

    def __init__(
        self, keeper: AuditKeeper, system: KnownSystem, author: Callable[[str], str]
    ) -> None:
        super().__init__(keeper, author, system.named)
        self._system = system
        self._asked: dict[str, AskedDecision] = {}  # by the id of the action

    @override
    def answered(self, what: str, client: str, line: Asked, on_result: OnResult) -> OnResult:
        # A decision waits a moment for the DVA's record of it.
        report = super().answered(what, client, line, on_result)
        if ACTIONS[what].audit is not Audit.DVA:
            return report
        number = str(line["id"])
        asked = self._asked[number] = AskedDecision(_action(what), line.get("event"))

        def wait(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            asked.finish = partial(report, ok, text, **more)
            if not ok or asked.record is not None:
                asked.finish()
            else:
                self._system.clock.call_after(RECORD_WITHIN, self._finish, number)

        return wait

    def is_noted(self, action: Action) -> bool:
        """Return True: the console knows of decisions by messages alone."""
        return True

    def _finish(self, number: str) -> None:
        asked = self._asked.get(number)
        if asked is not None and asked.finish is not None:
            asked.finish()

    def heard(self, record: m.AuditRecord) -> None:
        """Take the DVA's record of a decision."""
        if record.author == self._system.device.id_tag:
            for number, asked in self._asked.items():
                if asked.matches(record):
                    asked.record = record
                    self._finish(number)
                    return
            if record.code != m.OK:  # its answer has said so already
                return
        self.decided(self._fact(record))

    def _fact(self, record: m.AuditRecord) -> Fact:
        waited = self._system.age_of(record.event_id)
        return Fact.of_record(record, self._system.clock.now, waited)

    def _note(self, what: str, client: str, line: Asked, outcome: str, text: str) -> None:
        asked = self._asked.pop(str(line["id"]), None)
        if asked is None:
            super()._note(what, client, line, outcome, text)
        elif asked.record is not None:
            fact = replace(self._fact(asked.record), label=self._author(client))
            words = line.get("text") or line.get("kind")
            self.decided(replace(fact, text=words, mode=line.get("mode")))
        else:
            self._note_answer(asked, client, line, outcome, text)

    def _note_answer(
        self, asked: AskedDecision, client: str, line: Asked, outcome: str, text: str
    ) -> None:
        """Note a decision by request and answer, which are all that is known."""
        values = {key: line[key] for key in ("task", "mode", "kind", "severity") if key in line}
        waited = self._system.age_of(asked.event)
        self.keeper.put(
            self.keeper.entry(
                asked.action.replace("_", " "),
                self._author(client),
                device=self._system.device.id_tag,
                role=self._system.role,
                event=asked.event,
                subject=self._label(str(line.get("device", ""))),
                cause=str(line.get("reason") or ""),
                outcome=outcome,
                text=": ".join(word for word in (line.get("text"), text) if word),
                details=values if waited is None else values | {"waited_s": round(waited, 3)},
            )
        )


def _action(what: str) -> str:
    """Return the DVA's name for an action of a page."""
    return "set_dispatch" if what == "dispatch_mode" else what.removeprefix("event_")
