"""Why two ends did not come together, in words, as far as either end can know.

What libzmq reports of a failed handshake says less at one end than at the other, and not the
same each time.
"""

from __future__ import annotations

import errno
from dataclasses import dataclass
from enum import StrEnum

import zmq

HANDSHAKE_LIMIT = 10_000  # for the other end to answer, whose loop may be busy [ms]


class Reason(StrEnum):
    """Why two ends did not come together; the same word at both, as far as an end can know."""

    UNKNOWN_KEY = "unknown key"
    WRONG_SERVER_KEY = "wrong server key"
    PLAIN_CLIENT = "client without keys"
    PLAIN_SERVER = "server without keys"
    SILENT = "no answer"
    CLOSED = "closed"
    NOT_UNDERSTOOD = "not understood"


@dataclass(frozen=True)
class Refusal:
    """Two ends that did not come together, as seen from one.

    Attributes:
        device: Whose socket has noticed.
        peer: The device it wanted to reach; None at a server, which cannot know.
        endpoint: Where the server is bound; empty where that is not known.
        reason: Why.
        why: The same for people.
    """

    device: str
    peer: str | None
    endpoint: str
    reason: Reason
    why: str

    def __str__(self) -> str:
        if self.peer is None:
            place = f" at {self.endpoint}" if self.endpoint else ""
            return f"{self.device}{place} refused a connection: {self.why}"
        return f"{self.device}: handshake with {self.peer} at {self.endpoint} failed: {self.why}"

    @property
    def gave_up(self) -> bool:
        """Whether ZeroMQ makes no further attempt; see `Security.retry`."""
        final = {Reason.UNKNOWN_KEY, Reason.PLAIN_CLIENT, Reason.PLAIN_SERVER}
        return self.peer is not None and self.reason in final


def at_server(has_keys: bool, device: str, code: int) -> tuple[Reason, str]:
    """What a server makes of a code that libzmq gives for a failed handshake."""
    if code == zmq.PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH:
        if not has_keys:
            return Reason.PLAIN_SERVER, "the other end has keys switched on, this one has not"
        return Reason.PLAIN_CLIENT, "the other end has no keys, this one wants them"
    if code == zmq.PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC:
        return Reason.WRONG_SERVER_KEY, f"the other end has a wrong public key of {device}"
    return Reason.NOT_UNDERSTOOD, "the other end shakes hands in a way not understood"


def at_client(has_keys: bool, device: str, peer: str, event: int, code: int) -> tuple[Reason, str]:
    """What a client makes of a failed handshake: the event, and its code."""
    if event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
        return Reason.UNKNOWN_KEY, f"{peer} does not know the key of {device}"
    if event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL:
        return _at_hang_up(has_keys, peer, code)
    if code == zmq.PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH:
        return at_mismatch(has_keys, peer)
    if code == zmq.PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC:
        return Reason.WRONG_SERVER_KEY, f"what answers does not have the key of {peer}"
    return Reason.NOT_UNDERSTOOD, "what answers shakes hands in a way not understood"


def at_mismatch(has_keys: bool, peer: str) -> tuple[Reason, str]:
    """One end has keys and the other has none."""
    if not has_keys:
        return Reason.PLAIN_CLIENT, f"{peer} wants keys, this end has none"
    return Reason.PLAIN_SERVER, f"{peer} has no keys switched on, this end has"


def _at_hang_up(has_keys: bool, peer: str, code: int) -> tuple[Reason, str]:
    """A server does not say that it cannot read a greeting: it hangs up."""
    if code == errno.EAGAIN:
        limit = HANDSHAKE_LIMIT // 1000
        return Reason.SILENT, f"no answer within {limit} s: is it {peer} who listens there?"
    if not has_keys:
        return Reason.CLOSED, f"it hung up: is it {peer} who listens there?"
    return (
        Reason.WRONG_SERVER_KEY,
        f"it hung up, most likely because the public key of {peer} here is not the one it has",
    )
