"""Actions on alarms: acknowledging and shelving them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, Unpack

from dva_sim.agents.operator.handheld import Gathered
from dva_sim.console.asking.dispatcher import Doer, does
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.events.console_alarms import ConsoleAlarms
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import OfAlarm, ShelveAsked
from dva_sim.console.wire.seats import Answered

ENDING: Final = ("event_false_alarm", "event_escalate", "mission_found")  # decisions


class AlarmActions:
    """Does what people ask for about alarms.

    Args:
        alarms: Alarms of the console.
        author: Name of the person at a page.
        acknowledge: Action that notifies the DVA of an acknowledgement.
    """

    def __init__(
        self, alarms: ConsoleAlarms, author: Callable[[str], str], acknowledge: Doer
    ) -> None:
        self._alarms = alarms
        self._author = author
        self._acknowledge_event = acknowledge

    @does("alarm_acknowledge")
    def _acknowledge(self, client: str, line: Asked, on_result: OnResult) -> None:
        """Acknowledge an alarm: at the DVA if an open event is behind it, else here."""
        keys = self._alarms.members(line["alarm"])
        events = self._alarms.by_event(keys)
        for key in keys:
            if key not in events:
                self._alarms.acknowledge(key, self._author(client))
        if not events:
            on_result(True, "seen")
            return
        answers = Gathered(len(events), on_result)
        for number in events.values():
            self._notify(client, line, number, answers)

    def seeing(self, client: str, line: Mapping[str, Any], on_result: OnResult) -> OnResult:
        """Note with a decision's success that its person has seen the alarm of its event.

        The DVA gets it, too, unless the event ends with the decision.
        """
        key = f"event {line.get('event')}"

        def answer_with(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            if ok and key in self._alarms.alarms.known:
                news = self._alarms.by_event([key])
                self._alarms.acknowledge(key, self._author(client))
                if news and line["do"] not in ENDING:
                    self._notify(client, line, line["event"], _ignored)
            on_result(ok, text, **more)

        return answer_with

    def _notify(
        self, client: str, line: Mapping[str, Any], event: int, on_result: OnResult
    ) -> None:
        """Tell the DVA that a person has seen an event."""
        about = {"do": "event_acknowledge", "event": event, "id": f"{line['id']} {event}"}
        who = {key: line[key] for key in ("client", "role") if key in line}
        self._acknowledge_event(client, who | about, on_result)

    @does("alarm_shelve")
    def _shelve(self, client: str, line: ShelveAsked, on_result: OnResult) -> None:
        keys = self._alarms.members(line["alarm"])
        self._alarms.shelve(keys, line["for_s"], self._author(client), line["reason"])
        on_result(True, f"shelved for {line['for_s'] / 60:.0f} minutes")

    @does("alarm_unshelve")
    def _unshelve(self, client: str, line: OfAlarm, on_result: OnResult) -> None:
        self._alarms.unshelve(self._alarms.members(line["alarm"]))
        on_result(True, "back in the list")


def _ignored(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
    """Ignore an answer: the decision is done, whatever the DVA says of its acknowledgement."""
