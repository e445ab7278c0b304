"""A simulated person who dispatches by a script: with delays, and sometimes against the policy.

The person does one thing at a time: acknowledges an event, reads the policy's advice, decides, and
turns to the next event. All actions are messages of an ordinary control room.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.control_room.profile import DispatcherProfile, Overrule
from dva_sim.protocol import messages as m

FREE = "free"  # reason that the DVA states for a candidate that can be sent
KINDS = {"Robot": "robot", "Guard": "guard"}
MAX_TRIES = 3  # design: attempts at a decision while others decide meanwhile


@dataclass
class Turned:
    """Actions taken on an event.

    Attributes:
        acknowledged: True once anybody has acknowledged it.
        looks: Number of looks so far; the duration of each is drawn separately.
        tries: Number of decisions refused in a row.
    """

    acknowledged: bool = False
    looks: int = 0
    tries: int = 0


class ScriptedDispatcher:
    """A simulated person at a control room.

    Args:
        room: Control room that it sees and acts by.
        profile: Working habits.
        streams: Random stream by name; each delay and each whim has its own.
    """

    def __init__(
        self,
        room: ControlRoomAgent,
        profile: DispatcherProfile,
        streams: Callable[[str], np.random.Generator],
    ) -> None:
        self.room = room
        self.profile = profile
        self._streams = streams
        self._known: dict[int, Turned] = {}
        self._waiting: deque[int] = deque()
        self._busy: int | None = None
        room.on_event = self._seen

    # --- choice of an event ---------------------------------------------------------------

    def _seen(self, status: m.EventStatus) -> None:
        number = status.event_id
        turned = self._known.setdefault(number, Turned())
        turned.acknowledged = turned.acknowledged or status.acknowledged is not None
        if self._wants_something(status, turned) and number not in (*self._waiting, self._busy):
            self._waiting.append(number)
            self._next()

    @staticmethod
    def _wants_something(status: m.EventStatus, turned: Turned) -> bool:
        """Return True for a new event, or one with an undecided request of the policy."""
        if status.closed_for is not None or turned.tries >= MAX_TRIES:
            return False
        return not turned.looks or status.proposed is not None

    def _next(self) -> None:
        while self._busy is None and self._waiting:
            number = self._waiting.popleft()
            if self._wants_something(self.room.events[number], self._known[number]):
                self._busy = number
                self._turn_to(number)

    def _done(self) -> None:
        """Turn to the next event, or to the same one if it needs another decision."""
        number = self._busy
        self._busy = None
        if number is not None:
            self._seen(self.room.events[number])
        self._next()

    def _turn_to(self, number: int) -> None:
        if self._known[number].acknowledged:
            self._read(number)
            return
        delay = self.profile.acknowledge_s.draw(self._streams(f"acknowledge/{number}"))
        self.room.device.clock.call_after(delay, self._acknowledge, number)

    def _acknowledge(self, number: int) -> None:
        self._known[number].acknowledged = True
        self.room.device.tell(f"acknowledges event {number}", "order")
        self.room.ask(m.Acknowledge(number), lambda _: self._read(number), self._done)

    # --- deciding ----------------------------------------------------------------------------

    def _read(self, number: int) -> None:
        turned = self._known[number]
        turned.looks += 1
        delay = self.profile.decide_s.draw(self._streams(f"decide/{number}/{turned.looks}"))
        self.room.device.clock.call_after(delay, self._ask, number)

    def _ask(self, number: int) -> None:
        if self.room.events[number].closed_for is not None:
            self._done()
            return

        def take_reply(reply: m.Reply) -> None:
            if isinstance(reply.content, m.Proposal):
                self._decide(number, reply.content)
            else:
                self._done()

        self.room.ask(m.GetProposal(number), take_reply, self._done)

    def _decide(self, number: int, proposal: m.Proposal) -> None:
        status = self.room.events[number]
        wish = self._wish(status, proposal)
        if wish is None:
            self._done()
            return
        self.room.ask(wish, lambda reply: self._answered(number, wish, reply), self._done)

    def _answered(self, number: int, wish: m.Body, reply: m.Reply) -> None:
        turned = self._known[number]
        device = self.room.device
        what = type(wish).__name__.lower()
        if reply.code == m.OK:
            turned.tries = 0
            device.tell(f"decides on event {number}: {_in_words(wish, device.label_of)}", "order")
        else:
            turned.tries += 1
            device.tell(f"is refused ({what}, event {number}): {reply.text}", "order")
        self._done()

    def _wish(self, status: m.EventStatus, proposal: m.Proposal) -> m.Body | None:
        """Return the desired order; None if the policy has given it, or none is possible."""
        number = status.event_id
        decisions = status.decisions
        task = proposal.task
        rule = self._rule(status, proposal)
        if rule is None:
            if status.proposed is None or proposal.device is None:
                return None
            return m.Assign(number, proposal.device, None, task, None, decisions)
        if rule.sends == "nobody":
            return m.FalseAlarm(number, "as the script says", decisions)
        if rule.sends == "others":
            return m.Escalate(number, "as the script says", decisions)
        able = [
            (who.arrival_in, who.device)
            for who in proposal.candidates
            if who.arrival_in is not None and self._kind(who.device) == rule.sends
            if who.reason == FREE or who.device == proposal.device
        ]
        chosen = min(able)[1] if able else None
        if chosen is None and status.proposed is not None:
            chosen = proposal.device
        if chosen is None or chosen in (status.responder, status.actor):
            return None
        if status.event_state not in ("pending", "assigned") and task == "confirm":
            return None
        return m.Assign(number, chosen, None, task, "as the script says", decisions)

    def _rule(self, status: m.EventStatus, proposal: m.Proposal) -> Overrule | None:
        for index, rule in enumerate(self.profile.overrules):
            below = rule.confidence_below
            holds = (
                rule.kind in (None, status.kind)
                and status.severity >= rule.severity_from
                and (below is None or status.confidence < below)
                and rule.advised in (None, self._kind(proposal.device))
            )
            if holds:
                whim = self._streams(f"overrule/{status.event_id}/{index}").random()
                if whim < rule.share:
                    return rule
        return None

    def _kind(self, device: str | None) -> str | None:
        entry = self.room.devices.get(device or "")
        return None if entry is None else KINDS.get(entry.device_type)


def _in_words(wish: m.Body, label_of: Callable[[str], str]) -> str:
    match wish:
        case m.Assign(device=device, task=task):
            return f"{label_of(device)} shall {(task or 'confirm').replace('_', ' ')} it"
        case m.FalseAlarm():
            return "it is a false alarm"
    return "others have to deal with it"
