"""Actions at the desk about events: their history, instructions, and handing them over."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.operator.handheld import Gathered
from dva_sim.console.asking.answers import answering
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused, unanswered
from dva_sim.console.driving.decision_actions import DecidingRooms, DecisionActions
from dva_sim.console.driving.drive_actions import Driving
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.events.decisions import moment_ms
from dva_sim.console.events.handing_over import Offer, client_named
from dva_sim.console.views.event_details import details_shown
from dva_sim.console.wire.arguments import DetailsAsked, HandOverAsked, OfferAnswered, TickAsked
from dva_sim.console.wire.events import InstructionShown
from dva_sim.console.wire.scenes import LabelledMoment
from dva_sim.protocol import messages as m
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.scenario.instructions import Instruction, read_instructions

AFTER_RELEASE: Final = 1.0  # from giving robots back to asking for them again [s]

Ticks = dict[tuple[int, int], tuple[str, float]]  # who and when [s], by event and step


def instructions_of(scenario: Scenario) -> dict[str, tuple[Instruction, ...]]:
    """Return the instructions of a scenario, by kind of event.

    Raises:
        ConfigError: a file cannot be read.
    """
    return {kind: read_instructions(Path(file)) for kind, file in scenario.instructions.items()}


class DeskActions:
    """Does what people ask for at the desk.

    Args:
        system: System whose events and robots those are.
        rooms: Control rooms of the console.
        driving: Seats, and drives from pages.
        decisions: Decisions of people, with the robots that they have sent.
        instructions: Instructions by kind of event.
        author: Function that returns the name of a page's person.
    """

    def __init__(
        self,
        system: DrivenSystem,
        rooms: DecidingRooms,
        driving: Driving,
        decisions: DecisionActions,
        instructions: Mapping[str, Sequence[Instruction]],
        *,
        author: Callable[[str], str],
    ) -> None:
        self._system = system
        self._rooms = rooms
        self._driving = driving
        self._decisions = decisions
        self._instructions = instructions
        self._author = author
        self._ticks: Ticks = {}

    # --- history and instructions -----------------------------------------------------------

    @does("event_details")
    def _details(self, _: str, line: DetailsAsked, on_result: OnResult) -> None:
        number = line.get("event")
        histories = self._rooms.listener.histories
        instructions = self._numbered(number) if number in histories else ()
        details = details_shown(number, histories, self._system.label_of, instructions)
        on_result(True, "", details=details)

    def _lines(self, event: int) -> Sequence[Instruction]:
        return self._instructions.get(self._rooms.listener.events[event].kind, ())

    def _numbered(self, event: int) -> Iterator[InstructionShown]:
        step = 0
        for line in self._lines(event):
            if not line.is_step:
                yield {"text": line.text, "step": None, "done": None}
                continue
            by = self._ticks.get((event, step))
            done = None if by is None else LabelledMoment(label=by[0], at_ms=moment_ms(by[1]))
            yield {"text": line.text, "step": step, "done": done}
            step += 1

    @does("event_tick")
    def _tick(self, client: str, line: TickAsked, on_result: OnResult) -> None:
        """Tick a step of the instructions, or take that back."""
        event = line["event"]
        if event not in self._rooms.listener.events:
            raise Refused(f"there is no event {event}")
        steps = [each.text for each in self._lines(event) if each.is_step]
        if line["step"] >= len(steps):
            raise Refused(f"the instructions for event {event} have {len(steps)} steps")
        key = event, line["step"]
        self._ticks.pop(key, None)
        if line["done"]:
            self._ticks[key] = self._author(client), self._system.clock.now
        on_result(True, f"{'done' if line['done'] else 'not done'}: {steps[line['step']]}")

    # --- handing over -----------------------------------------------------------------------

    @does("hand_over")
    def _hand_over(self, client: str, line: HandOverAsked, on_result: OnResult) -> None:
        """Offer one event, or all events and robots in hand, to a colleague."""
        people = self._rooms.names()
        to = client_named(line["to"], people)
        if to == client:
            raise Refused("you have it already")
        sender = self._author(client)
        event = line.get("event")
        numbers = self._answered_for(client, sender) if event is None else [event]
        events = self._rooms.listener.events
        if event is not None and (event not in events or events[event].closed_for is not None):
            raise Refused(f"event {event} is not open")
        missions = [
            self._system.label_of(mission.robot)
            for mission in self._decisions.sent.of_client(client)
            if event in (None, mission.event)
        ]
        held = [] if event is not None else self._held(client)
        offer = Offer(
            sender=sender,
            sender_client=client,
            to=line["to"],
            client=to,
            events=tuple(numbers),
            robots=tuple(dict.fromkeys([*missions, *held])),
            note=line["note"],
            whole=event is None,
            at=self._system.clock.now,
        )
        self._rooms.handing_over.offer(offer)
        on_result(True, f"offered to {offer.to}: {offer.described()}")

    def _answered_for(self, client: str, name: str) -> list[int]:
        """Return the open events that a person answers for, or has sent a robot to."""
        owners = self._rooms.handing_over.owners
        sent = {mission.event for mission in self._decisions.sent.of_client(client)}
        numbers = []
        for number, status in sorted(self._rooms.listener.events.items()):
            seen = status.acknowledged
            owner = owners.get(number, seen.label if seen else "")
            if status.closed_for is None and (owner == name or number in sent):
                numbers.append(number)
        return numbers

    def _held(self, client: str) -> list[str]:
        """Return the robots in a page's seat, by label."""
        person = self._system.seating.of_client(client)
        return [] if person is None else [held.label for held in person.robots.values()]

    @does("hand_over_answer")
    def _answer(self, client: str, line: OfferAnswered, on_result: OnResult) -> None:
        """Take over what a colleague offers, or decline it."""
        offer = self._rooms.handing_over.answer(line["offer"], client, line["accept"])
        device = self._rooms.listener.device
        if not line["accept"]:
            device.tell(f"{offer.to} declines {offer.described()} of {offer.sender}", "order")
            on_result(True, f"declined: {offer.described()}")
            return

        def accept(agent: ControlRoomAgent, on_result: OnResult) -> None:
            self._accept(offer, client, agent, on_result)

        device.tell(f"{offer.to} takes over {offer.described()} from {offer.sender}", "order")
        self._rooms.decide(client, str(line.get("role", "look")), on_result, accept)

    def _accept(
        self, offer: Offer, client: str, agent: ControlRoomAgent, on_result: OnResult
    ) -> None:
        held = [label for label in self._held(offer.sender_client) if label in offer.robots]
        missions = [
            mission
            for mission in self._decisions.sent.of_client(offer.sender_client)
            if mission.event in offer.events
        ]
        text = f"you have taken over {offer.described()} from {offer.sender}"
        answers = Gathered(len(offer.events) + len(missions) + bool(held) + 1, on_result)

        def told(ok: bool, words: str, /, **_: object) -> None:
            answers(ok, text if ok else words)

        for number in offer.events:
            self._rooms.handing_over.give(number, offer.to)
            self._note(agent, number, offer, told)
        for mission in missions:
            self._decisions.sent.hand_to(client, agent, mission, told)
        if held:
            self._take_held(offer.sender_client, client, held, told)
        told(True, text)

    @staticmethod
    def _note(agent: ControlRoomAgent, number: int, offer: Offer, answers: OnResult) -> None:
        """Have the DVA note who answers for an event: other consoles see it, too."""
        words = f"handed over by {offer.sender} to {offer.to}"
        text = f"{words}: {offer.note}" if offer.note else words

        def answered(reply: m.Reply) -> None:
            answers(reply.code == m.OK, reply.reason)

        agent.ask(m.AddNote(number, text[:256]), answered, lambda: unanswered(answers))

    def _take_held(
        self, sender: str, client: str, robots: Sequence[str], answers: OnResult
    ) -> None:
        """Move robots from one seat to another; meanwhile they stand."""

        def take(*_: object, **__: object) -> None:
            self._system.clock.call_after(AFTER_RELEASE, ask)

        def ask() -> None:
            answering(partial(self._driving.take, client, {"robots": [*robots]}), answers)

        self._driving.release(sender, take)
