"""The dispatcher of actions: each is done once and answered once, whatever is shown.

There is one dispatcher for all that a console can show - a world, a DVA elsewhere, a robot alone, a
recording. Functions are marked with the names of the actions that they do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Protocol, TypeVar

from dva_sim.console.asking.answers import Answers, answering
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.wire.actions import ACTIONS, OF_THE_WEB, ActionPlace, Asked, Queueing
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.console.wire.seats import DoneLine

Doer = Callable[[str, Asked, OnResult], object]
Taker = Callable[[str, Asked], object]
_HEAD = frozenset({"do", "id", "client", "role"})
_Marked = TypeVar("_Marked", bound=Callable[..., object])


class AuditedActions(Protocol):
    """The interface of an audit log."""

    def answered(self, what: str, client: str, line: Asked, on_result: OnResult) -> OnResult:
        """Return a callback that passes an answer on once its row is in the log."""


def does(*names: str) -> Callable[[_Marked], _Marked]:
    """Mark a method as the one that does some actions.

    It is called with the client, the line and the callback for the answer; for an action without
    an answer, with the client and the line.
    """

    def mark(method: _Marked) -> _Marked:
        method.does = names  # type: ignore[attr-defined]
        return method

    return mark


def doers_of(holders: Iterable[object]) -> dict[str, Callable[..., object]]:
    """Collect the marked methods of some objects by the names of their actions."""
    doers: dict[str, Callable[..., object]] = {}
    for holder in holders:
        for attribute in dir(type(holder)):
            for name in getattr(getattr(type(holder), attribute), "does", ()):
                doers[name] = getattr(holder, attribute)
    return doers


class ActionDispatcher:
    """Does what lines of the web process ask for.

    Args:
        place: Place whose actions are carried out here.
        holders: Objects with marked methods, for all that is declared for this place.
        tell: Callback for the answers.
        elsewhere: The refusal of actions that are declared for other places only.
        audited: Function that returns the audit log; None: there is none.
    """

    def __init__(
        self,
        place: ActionPlace,
        holders: Iterable[object],
        tell: Callable[[DoneLine], object],
        elsewhere: str,
        audited: Callable[[], AuditedActions | None] = lambda: None,
    ) -> None:
        self._tell = tell
        self._elsewhere = elsewhere
        self._audited = audited
        self._answers = Answers()
        self._doers = doers_of(holders)
        declared = {name for name, one in _KNOWN.items() if place in one.at}
        if declared != self._doers.keys():
            differ = ", ".join(sorted(declared ^ self._doers.keys()))
            raise TypeError(f"declared and done at {place.name} differ: {differ}")

    def take(self, line: Asked) -> None:
        """Do what a line asks for; nothing that it can hold does any harm."""
        what = str(line.get("do", ""))
        client = str(line.get("client", ""))
        number = line.get("id")
        action = _KNOWN.get(what)
        if action is not None and not action.has_answer:
            self._hear(what, client, line)
        elif isinstance(number, str):
            repeats = action is not None and action.waits is Queueing.FIRST
            do = partial(self.do, client, line | {"do": what})
            self._answers.once(number, do, self._tell, repeats=repeats)

    def _hear(self, what: str, client: str, line: Asked) -> None:
        """Do an action without an answer; invalid ones, and those of other places, are ignored."""
        take = self._doers.get(what)
        if take is not None:
            try:
                request = _checked(line)
            except BadMessage:
                return
            take(client, request)

    def do(self, client: str, line: Asked, on_result: OnResult) -> None:
        """Do an action, and note it in the audit log.

        Raises:
            Refused: it cannot be done here, or not now.
            BadMessage: its arguments make no sense.
        """
        what = line["do"]
        do = self._doers.get(what)
        if do is None:
            raise Refused(self._elsewhere.format(what=what))
        request = _checked(line)
        audited = self._audited()
        if audited is not None:
            on_result = audited.answered(what, client, request, on_result)
        answering(partial(do, client, request), on_result)


_KNOWN: Mapping[str, Any] = {**ACTIONS, **OF_THE_WEB}


def _checked(line: Asked) -> Asked:
    """Check the arguments of a line against their declaration."""
    head = {key: value for key, value in line.items() if key in _HEAD}
    arguments = {key: value for key, value in line.items() if key not in _HEAD}
    request: Asked = _KNOWN[line["do"]].read(arguments) | head
    return request
