"""What people at an attached console decide on events: messages of its own control room.

Whether that is allowed, the DVA says: it alone knows the role of each control room.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.refusal import Refused, Said
from dva_sim.protocol import messages as m

Line = dict[str, Any]


class AttachedDecisions:
    """Does what pages ask for about events.

    Args:
        system: To which the console is attached.
    """

    def __init__(self, system: AttachedSystem) -> None:
        self._system = system
        self.doers: Mapping[str, Callable[[Line, Said], object]] = {
            "room_join": self._join,
            "event_acknowledge": partial(self._do, self._acknowledge, "acknowledged"),
            "event_assign": partial(self._do, self._assign, "assigned"),
            "event_take_off": partial(self._do, self._take_off, "open to others"),
            "event_false_alarm": partial(self._do, self._false_alarm, "a false alarm"),
            "event_escalate": partial(self._do, self._escalate, "escalated"),
            "event_note": partial(self._do, self._note, "noted"),
            "dispatch_mode": self._mode,
        }

    def _join(self, _: Line, said: Said) -> None:
        if not self._system.answers:
            raise Refused("the DVA does not answer")
        said(True, f"you are {self._system.device.label}, and may {self._system.role}")

    def _do(self, make: Callable[[Line], m.Body], done: str, line: Line, said: Said) -> None:
        self._ask(make(line), f"event {line['event']} is {done}", said)

    def _ask(self, body: m.Body, done: str, said: Said) -> None:
        def answered(reply: m.Reply) -> None:
            words = reply.text or m.CODE_NAMES.get(reply.code, str(reply.code))
            said(reply.code == m.OK, done if reply.code == m.OK else words)

        self._system.agent.ask(body, answered, partial(said, False, "the DVA does not answer"))

    @staticmethod
    def _acknowledge(line: Line) -> m.Body:
        return m.Acknowledge(line["event"])

    def _assign(self, line: Line) -> m.Body:
        return m.Assign(
            line["event"],
            self._device(line),
            task=line.get("task"),
            reason=line.get("reason") or None,
            decisions=self._seen(line),
        )

    def _take_off(self, line: Line) -> m.Body:
        reason = line.get("reason") or None
        return m.TakeOff(line["event"], self._device(line), reason, self._seen(line))

    def _false_alarm(self, line: Line) -> m.Body:
        return m.FalseAlarm(line["event"], line["reason"], self._seen(line))

    def _escalate(self, line: Line) -> m.Body:
        return m.Escalate(line["event"], line.get("reason") or None, self._seen(line))

    @staticmethod
    def _note(line: Line) -> m.Body:
        return m.AddNote(line["event"], line["text"])

    def _mode(self, line: Line, said: Said) -> None:
        mode = line["mode"]
        told = "the policy asks first" if mode == "ask_first" else "the policy decides by itself"
        self._ask(m.SetDispatch(mode, line.get("reason") or None), told, said)

    def _seen(self, line: Line) -> int | None:
        """How many decisions the asker knows: what the page says, else what is known here."""
        status = self._system.agent.events.get(line["event"])
        known = None if status is None else status.decisions
        return known if line.get("decisions") is None else int(line["decisions"])

    def _device(self, line: Line) -> str:
        """The id of a device by its label.

        Raises:
            Refused: the DVA has listed none of that label.
        """
        label, known = line["device"], self._system.told.devices.items()
        found = next((i for i, told in known if told.device.label == label), None)
        if found is None:
            raise Refused(f"there is no device {label!r}")
        return found
