"""Bugs of what every device does, and of operators."""

from __future__ import annotations

import re
from typing import Any, Final

from helpers.mutation.planting import Bug, Original, Planted, quiet_about

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError


def _by_message_id(original: Original, bug: Planted) -> Original:
    """A reply cache that is keyed without the source."""
    known: dict[Any, bytes] = {}

    def wrong(sender: str | None, request: bytes) -> Any:
        found = re.search(rb"<MessageID>(\d+)<", request)
        key = found[1] if found else request
        if known.setdefault(key, request) != request:
            bug.act(f"a request counts as answered that has number {key!r} like another")
        return sender, key

    return wrong


def _drops_nonsense(original: Original, bug: Planted) -> Original:
    """A message that is none is dropped without a word and without a count."""

    def wrong(self: Any, request: Any) -> Any:
        try:
            decode(request.data)
        except ProtocolError:
            bug.act(f"{self.label} drops a message")
            return None
        return original(self, request)

    return wrong


def _unbounded(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, key: Any, source: str, reply: bytes) -> Any:
        self._each, self._room = 100_000, 10**9
        original(self, key, source, reply)
        if len(self._kept[source].keys) > 64:
            bug.act(f"{len(self._kept[source].keys)} replies to {source} are kept")
        return reply

    return wrong


def _registers_once(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, then: Any, life: int) -> Any:
        ask = self.ask

        def asks(peer: str, body: Any, on_reply: Any, on_failure: Any, *rest: Any) -> Any:
            def fails() -> None:
                bug.act(f"{self.label} gives up to register")

            return ask(peer, body, on_reply, fails, *rest)

        self.ask = asks
        try:
            return original(self, then, life)
        finally:
            del self.ask

    return wrong


def _stays_silent(original: Original, bug: Planted) -> Original:
    def wrong(self: Any) -> Any:
        original(self)
        bug.act(f"{self.label} says nothing any more")
        self.silent = True

    return wrong


def _refuses_misdirected(original: Original, bug: Planted) -> Original:
    """An emergency that names another robot is refused."""

    def wrong(self: Any, message: m.Message) -> Any:
        if isinstance(message.body, m.Emergency) and message.destination != self.id_tag:
            bug.act(f"{self.label} refuses an emergency to {message.destination}")
            return m.Reply(message.message_id, m.UNKNOWN_DEVICE, f"this is {self.id_tag}")
        return original(self, message)

    return wrong


def _never_over(original: Original, bug: Planted) -> Original:
    """An operator goes on, whatever the robot says."""

    def wrong(self: Any, code: int | None, why: str = "") -> str:
        bug.act(f"{self.me} goes on, though {original(self, code, why)}")
        return ""

    return wrong


DEVICE_BUGS: Final = (
    Bug(
        "emergency-by-name-only",
        "S3",
        "an emergency that names another robot is refused",
        "dva_sim.agents.device:AgentDevice._misdirection",
        _refuses_misdirected,
    ),
    Bug(
        "refusals-ignored",
        "S5",
        "an operator who is refused drives on",
        "dva_sim.agents.operator.refusals:Refusals._over",
        _never_over,
    ),
    Bug(
        "reply-cache-without-source",
        "S6",
        "a request with the number of another gets its answer",
        "dva_sim.agents.device:key_of",
        _by_message_id,
    ),
    Bug(
        "never-registers-again",
        "S8",
        "who could not register gives up",
        "dva_sim.agents.device:AgentDevice._register",
        _registers_once,
    ),
    Bug(
        "stays-silent",
        "S8",
        "a restarted program says nothing",
        "dva_sim.agents.device:AgentDevice.restart",
        _stays_silent,
    ),
    Bug(
        "replies-without-bound",
        "S10",
        "replies are kept for ever",
        "dva_sim.protocol.exchange:ReplyCache.put",
        _unbounded,
    ),
    Bug(
        "bad-messages-uncounted",
        "S11",
        "what is no message is dropped without a word",
        "dva_sim.agents.device:AgentDevice.admit",
        _drops_nonsense,
    ),
    Bug(
        "silent-when-busy",
        "S11",
        "a refusal as busy is not said",
        "dva_sim.agents.device:AgentDevice.conclude",
        quiet_about(m.BUSY),
    ),
    Bug(
        "unknown-unanswered",
        "S11",
        "who is not registered gets no answer",
        "dva_sim.agents.device:AgentDevice.conclude",
        quiet_about(m.NOT_REGISTERED),
    ),
)
