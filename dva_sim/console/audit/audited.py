"""Rows of the audit log: what people ask for at pages, and what the DVA says that it decided.

An answer to a page waits until its row is on the disk. Whatever only stops something never waits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Unpack

from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.wire.actions import ACTIONS, Action, Asked, Audit
from dva_sim.console.wire.seats import REFUSAL, Answered
from dva_sim.protocol import messages as m
from dva_sim.protocol.facts import Fact
from dva_sim.recordings.audit_log import AuditEntry

DONE: Final = "done"
_HEAD: Final = frozenset(["id", "do", "client", "role", "robots", "robot", "event", "reason"])
SECRET: Final = frozenset(["server", "port"])


class Audited:
    """Keeps the audit log of a console.

    Args:
        keeper: Keeper of the file.
        author: Name of the person at a page.
        label: The name of a device, by its id.
    """

    def __init__(
        self,
        keeper: AuditKeeper,
        author: Callable[[str], str],
        label: Callable[[str], str],
    ) -> None:
        self.keeper = keeper
        self._author = author
        self._label = label

    def answered(self, what: str, client: str, line: Asked, on_result: OnResult) -> OnResult:
        """Return a callback that passes an answer on once its row is in the log.

        Raises:
            Refused: the log cannot be written, and the action stops nothing.
        """
        action = ACTIONS[what]
        if isinstance(action.audit, str):
            return on_result
        if self.keeper.problem and not action.stops:
            raise Refused(f"{self.keeper.problem}; nothing can be done until this is fixed")

        def log_and_answer(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            if self.is_noted(action):
                outcome = more.get("outcome", DONE if ok else REFUSAL)
                self._note(what, client, line, outcome, text)
            if action.stops:
                on_result(ok, text, **more)
                return

            def safe(problem: str) -> None:
                if problem:
                    on_result(False, f"{text}; but {problem}", **more)
                else:
                    on_result(ok, text, **more)

            self.keeper.when_safe(safe)

        return log_and_answer

    def is_noted(self, action: Action) -> bool:
        """Return True if an action has a row of its own; of the others the DVA tells."""
        return action.audit is Audit.OWN

    def _note(self, what: str, client: str, line: Asked, outcome: str, text: str) -> None:
        robots = line.get("robots") or ([line["robot"]] if "robot" in line else [])
        named = robots if isinstance(robots, str) else ", ".join(map(str, robots))
        details = {k: v for k, v in line.items() if k not in _HEAD | SECRET}
        self.keeper.put(
            self.keeper.entry(
                what.replace("_", " "),
                self._author(client),
                role=str(line.get("role", "")),
                event=line.get("event"),
                subject=self._label(named),
                cause=str(line.get("reason", "")),
                outcome=outcome,
                text=text,
                details=details,
            )
        )

    def decided(self, fact: Fact) -> None:
        """Keep what the DVA, or somebody at it, has decided."""
        self.keeper.put(self._entry(fact))

    def _entry(self, fact: Fact) -> AuditEntry:
        ok = fact.code == m.OK
        arguments: Asked = {
            "task": fact.task,
            "mode": fact.mode,
            "operator": fact.operator and self._label(fact.operator),
            "arrival_s": fact.arrival_in,
            "waited_s": fact.waited,
        }
        details: Asked = {
            key: _short(value) for key, value in arguments.items() if value is not None
        }
        if fact.action == "assign":
            details["advised"] = fact.advised and self._label(fact.advised)
            details["advised_s"] = _short(fact.advised_in)
        if not ok:
            details["code"] = fact.code
        answer_text = (fact.text, fact.outcome)
        return self.keeper.entry(
            fact.action.replace("_", " "),
            fact.label,
            device=fact.author,
            role=fact.role or "",
            event=fact.event,
            subject=(fact.device and self._label(fact.device)) or "",
            cause=fact.cause,
            outcome=DONE if ok else REFUSAL,
            text=": ".join(text for text in answer_text if text),
            details=details,
        )


def name_of_page(client: str) -> str:
    """Return the fallback name of a page or a program that has no device."""
    number = client.partition("-")[0]
    if number.startswith("c"):
        return f"page {number}"
    return number if number == "program" else f"program {number}"


def _short(value: Any) -> Any:
    """Return a time to the millisecond; all else as it is."""
    return round(value, 3) if isinstance(value, float) else value
