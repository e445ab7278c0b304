"""Interference with messages, which arrive late, twice, altered, or not at all."""

from __future__ import annotations

import random
from collections import Counter, deque
from collections.abc import Callable
from typing import Any, NamedTuple

from dva_sim.agents.observation import CameraFrame
from dva_sim.kernel.clock import Clock
from dva_sim.network.virtual_network import Take
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode_if_valid, encode

REMEMBERED = 64  # latest messages to a node kept for replays, each of frequent and of other kinds
FREQUENT_MESSAGES = b"<SetTeleOp", b"<HBMsg>", b"<RobotStatus>"


class PassingMessage(NamedTuple):
    """Message that is about to reach a node.

    Attributes:
        source: Id of its sender.
        to: Id of its receiver.
        payload: Bytes, or a camera frame.
        take: Function that hands a payload to the receiver now.
    """

    source: str
    to: str
    payload: Any
    take: Take


Rule = Callable[[PassingMessage], bool]
"""Function applied to a passing message; True if nothing else is to happen to it."""


class Interference:
    """Filter that lets each message pass, unless a rule in force decides otherwise.

    Args:
        clock: The run's clock.
        watch: Callback for each message that reaches its receiver; it has to hand it over.

    Attributes:
        rules: Rules in force now, in the order in which they began.
        counts: Messages that were interfered with, by kind of fault.
        delivered: Number of messages that have reached a receiver.
    """

    def __init__(self, clock: Clock, watch: Callable[[PassingMessage], None]) -> None:
        self.clock = clock
        self.rules = list[Rule]()
        self.counts = Counter[str]()
        self._watch = watch
        self.delivered = 0
        self._awaited: list[tuple[bytes, str, Callable[[str], object]]] = []
        self._past: dict[tuple[str, bool], deque[PassingMessage]] = {}

    def __call__(self, source: str, to: str, payload: Any, take: Take) -> None:
        """Deliver, drop, delay or replace a message; see `VirtualNetwork.interference`."""
        passing = PassingMessage(source, to, payload, take)
        if isinstance(payload, bytes):
            kind = to, any(often in payload for often in FREQUENT_MESSAGES)
            self._past.setdefault(kind, deque(maxlen=REMEMBERED)).append(passing)
            if self._awaited:
                self._look_out(passing)
        for rule in tuple(self.rules):
            if rule(passing):
                return
        self.deliver(passing)

    def deliver(self, passing: PassingMessage) -> None:
        """Let a message reach its receiver now."""
        self.delivered += 1
        self._watch(passing)

    def later(self, passing: PassingMessage, delay: float) -> None:
        """Let a message reach its receiver after a delay [s]."""
        self.clock.call_after(delay, self.deliver, passing)

    def past(self, to: str) -> list[PassingMessage]:
        """Return the newest messages to a node, and older ones of the rarer kinds."""
        return [each for often in (False, True) for each in self._past.get((to, often), ())]

    def await_message(self, kind: str, to: str, then: Callable[[str], object]) -> None:
        """Call `then` once, just before the next message of a kind reaches a node.

        Args:
            kind: Name of its element, such as `StartTeleOp`.
            to: Prefix of the receiver's id.
            then: Callback with the id of the receiver.
        """
        self._awaited.append((b"<" + kind.encode(), to, then))

    def _look_out(self, passing: PassingMessage) -> None:
        for waiting in tuple(self._awaited):
            kind, to, then = waiting
            if passing.to.startswith(to) and kind in passing.payload:
                self._awaited.remove(waiting)
                then(passing.to)


Meddling = Callable[[Interference, PassingMessage], bool]
"""Function that alters the delivery of a message; True if nothing else is to happen to it."""


# --- rules -------------------------------------------------------------------------------


def loses(share: float, chance: random.Random) -> Meddling:
    """Lose a share of the messages."""
    return lambda interference, passing: chance.random() < share


def delays(longest: float, chance: random.Random) -> Meddling:
    """Delay each message by up to `longest` [s]; messages may overtake each other."""

    def rule(interference: Interference, passing: PassingMessage) -> bool:
        interference.later(passing, longest * chance.random())
        return True

    return rule


def doubles(longest: float, chance: random.Random) -> Meddling:
    """Let each message pass, and deliver a copy up to `longest` later [s]."""

    def rule(interference: Interference, passing: PassingMessage) -> bool:
        interference.deliver(passing)
        interference.later(passing, longest * chance.random())
        return True

    return rule


def reorders(longest: float, chance: random.Random) -> Meddling:
    """Hold back half of the messages, at random, by up to `longest` [s]."""

    def rule(interference: Interference, passing: PassingMessage) -> bool:
        if chance.random() < 0.5:
            return False
        interference.later(passing, longest * chance.random())
        return True

    return rule


def corrupts(share: float, chance: random.Random) -> Meddling:
    """Alter a share of the messages: a byte is changed, removed or replaced by two."""

    def rule(interference: Interference, passing: PassingMessage) -> bool:
        if not isinstance(passing.payload, bytes) or chance.random() >= share:
            return False
        data = passing.payload
        index = chance.randrange(len(passing.payload))
        new = bytes([chance.randrange(256)]) * chance.randrange(3)
        altered = data[:index] + new + data[index + 1 :]
        interference.deliver(passing._replace(payload=altered))
        return True

    return rule


def loses_in_bursts(share: float, chance: random.Random) -> Meddling:
    """Lose all messages in a share of the quarters of a second."""
    first = chance.randrange(1 << 30)

    def rule(interference: Interference, passing: PassingMessage) -> bool:
        slot = int(interference.clock.now * 4)
        return random.Random(first + slot).random() < share

    return rule


def holds_tilt(speed: float, chance: random.Random) -> Meddling:
    """Make all commands equal, as if the driver had put the phone aside.

    Args:
        speed: Speed in the commands [m/s].
        chance: Random numbers from which the turn rate is drawn.
    """
    turn = chance.uniform(-0.5, 0.5)

    def rule(interference: Interference, passing: PassingMessage) -> bool:
        data = passing.payload if isinstance(passing.payload, bytes) else b""
        message = decode_if_valid(passing.payload) if b"<SetTeleOp" in data else None
        if message is None or not isinstance(message.body, m.SetTeleOp):
            return False
        body = message.body._replace(speed=speed, turn_rate=turn)
        same = encode(message._replace(body=body))
        interference.deliver(passing._replace(payload=same))
        return True

    return rule


def freezes_pictures(_: float, __: random.Random) -> Meddling:
    """Repeat the first picture for ever, each time with the tick of the current one."""
    first_frames: dict[str, CameraFrame] = {}

    def rule(interference: Interference, passing: PassingMessage) -> bool:
        frame = passing.payload
        if not isinstance(frame, CameraFrame):
            return False
        first = first_frames.setdefault(passing.source, frame)
        lie = first.observation._replace(tick=frame.observation.tick)
        interference.deliver(passing._replace(payload=frame._replace(observation=lie)))
        return True

    return rule
