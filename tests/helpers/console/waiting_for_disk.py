"""An audit log in virtual time, which waits for the disk instead of running away from it."""

from __future__ import annotations

import select

from dva_sim.console.audit.audit_keeper import AuditKeeper


def take_what_is_safe(keeper: AuditKeeper) -> None:
    """Run the callbacks of all rows so far, once they are on disk."""
    answers: list[str] = []
    keeper.when_safe(answers.append)
    while not answers:
        select.select([keeper], [], [])
        keeper.take()
