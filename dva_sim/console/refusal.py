"""How an action ends: answered, or refused with the reason."""

from __future__ import annotations

from typing import Any, Protocol


class Said(Protocol):
    """Whoever waits for the answer to an action."""

    def __call__(self, ok: bool, text: str, /, **more: Any) -> object:
        """Told whether it was done, what there is to say of it, and what was asked for."""


class Refused(Exception):
    """An action that cannot be done, and why, in a line."""
