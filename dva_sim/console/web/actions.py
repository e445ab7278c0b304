"""Validation of clients' requests: known actions, and the roles that may request them."""

from __future__ import annotations

import json
import re
from typing import Any, TypeGuard

from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.kinds import BadMessage, Labels
from dva_sim.console.wire.roles import Role

_ID = re.compile(r"[A-Za-z0-9._:-]{1,64}")


class NotAllowed(BadMessage):
    """The asking token does not allow it."""


def read(text: str | bytes) -> dict[str, Any]:
    """Return a JSON object out of a message.

    Raises:
        BadMessage: it is something else.
    """
    try:
        data = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError):
        raise BadMessage("is not JSON") from None
    if not isinstance(data, dict):
        raise BadMessage("is not a JSON object")
    return data


def _no_number(word: str) -> float:
    raise ValueError(word)


def check_role(role: Role, name: Any) -> None:
    """Check that a role may request an action at all.

    Raises:
        NotAllowed: not by this address.
    """
    least = ACTIONS[name].role if isinstance(name, str) and name in ACTIONS else Role.PHONE
    if role < least:
        if not role.acts:
            raise NotAllowed("this address is view-only; it may only press the emergency stop")
        own = "a phone's address" if role is Role.PHONE else "this address"
        raise NotAllowed(f"{own} may not {plain(name)}; an address {_FOR[least]} may")


_FOR = {Role.DRIVE: "for driving", Role.DISPATCH: "for dispatch", Role.SUPERVISE: "to supervise"}


def plain(name: str) -> str:
    """Return the name of an action, for people."""
    return name.replace("_", " ")


def asked_of(name: Any, arguments: Any, labels: Labels, silent: bool = False) -> dict[str, Any]:
    """Return the validated request for the simulation.

    Args:
        name: Name of the action.
        arguments: Its arguments.
        labels: Labels of the robots, with their indices.
        silent: True to allow actions without an answer.

    Raises:
        BadMessage: no such action, or an argument that makes no sense.
    """
    action = ACTIONS.get(name) if isinstance(name, str) else None
    if action is None or not (action.has_answer or silent):
        names = [name for name, one in ACTIONS.items() if one.has_answer or silent]
        raise BadMessage(f"no such action; there are: {', '.join(names)}")
    request = {"do": name, **action.read(arguments, labels)}
    if name == "emergency":
        request.setdefault("robots", "all")
    return request


def id_of(value: Any) -> str:
    """Return the id by which a repeated request is known.

    Raises:
        BadMessage: it is none.
    """
    if not is_id(value):
        raise BadMessage("id should be 1 to 64 letters, digits, dots, colons or hyphens")
    return str(value)


def is_id(value: Any) -> TypeGuard[str]:
    """Return True if a value can be the id of a request."""
    return isinstance(value, str) and _ID.fullmatch(value) is not None


class Bucket:
    """Rate limit of a client's messages.

    Args:
        rate: On average [1/s].
        burst: At once.
    """

    def __init__(self, rate: float, burst: int) -> None:
        self._rate = rate
        self._burst = float(burst)
        self._room = float(burst)
        self._then = 0.0

    def takes(self, now: float) -> bool:
        """Return True if another message at `now` [s] is within the limit."""
        self._room = min(self._burst, self._room + (now - self._then) * self._rate)
        self._then = now
        self._room -= 1.0
        return self._room >= 0.0
