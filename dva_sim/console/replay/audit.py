"""The audit log in a recording, as a file that the web process reads like that of a console."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dva_sim.console.wire.events import AuditLine
from dva_sim.recordings.audit_log import NOTHING_BEFORE


class RecordedAudit:
    """The rows of whichever recording is played; a file that is gone with the player.

    Attributes:
        path: File of the rows.
    """

    def __init__(self) -> None:
        self._folder = TemporaryDirectory(prefix="dva-sim-audit-")
        self.path = Path(self._folder.name) / "audit.json"
        self.path.write_text("[]")

    def show(self, rows: Sequence[Mapping[str, Any]], name: str) -> AuditLine:
        """Open the log of another recording; returns the line for the pages."""
        new = self.path.with_suffix(".new")
        new.write_text(json.dumps(rows))
        new.replace(self.path)  # at once: somebody may be reading
        last = rows[-1] if rows else None
        return {
            "k": "audit",
            "t": 0,
            "rows": 0 if last is None else last["number"],
            "hash": NOTHING_BEFORE if last is None else last["hash"],
            "problem": "",
            "lasting": True,
            "file": name,
        }

    def close(self) -> None:
        """Leave nothing behind."""
        self._folder.cleanup()
