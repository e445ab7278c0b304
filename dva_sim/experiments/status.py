"""What a result may be called: declared beforehand, explored, or a confirmation."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from dva_sim.config import Config


class Status(Config):
    """What a result may be called, and why; the manifest holds it, the report shows it.

    Attributes:
        kind: `declared`: run as its file says, nothing registered. `exploratory`: something was
            changed, tried or left open. `confirmatory`: run as registered, on seeds that nobody
            could know before.
        why: Reasons and remarks, each a sentence without its full stop.
        reproducible: Whether the same command gives the same bytes on any machine.
        registration: What was registered, whether or not this is it; None if nothing was.
    """

    kind: Literal["declared", "exploratory", "confirmatory"] = "declared"
    why: tuple[str, ...] = ()
    reproducible: bool = True
    registration: dict[str, Any] | None = Field(default=None)
