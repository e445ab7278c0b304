"""Errors in decoding bytes into messages."""

from __future__ import annotations

from dva_sim.kernel.errors import DvaSimError


class ProtocolError(DvaSimError):
    """Bytes that do not form a message, or values that no message can hold.

    Args:
        code: The reply code that tells the sender; see `dva_sim.protocol.messages`.
        reason: Reason in one line; that of `decode` fits into the text of a reply.
    """

    def __init__(self, code: int, reason: str) -> None:
        self.code = code
        self.reason = reason
        super().__init__(code, reason)

    def __str__(self) -> str:
        return self.reason
