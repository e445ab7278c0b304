"""Rows of the audit log about what people ask for at pages.

An answer to a page waits until its row is on the disk. Whatever only stops something never waits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Unpack

from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.wire.actions import ACTIONS, Asked
from dva_sim.console.wire.seats import REFUSAL, Answered

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
            self._note(what, client, line, more.get("outcome", DONE if ok else REFUSAL), text)
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


def name_of_page(client: str) -> str:
    """Return the fallback name of a page or a program that has no device."""
    number = client.partition("-")[0]
    if number.startswith("c"):
        return f"page {number}"
    return number if number == "program" else f"program {number}"
