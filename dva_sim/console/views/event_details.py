"""Details of events for pages: their histories, of a run or of a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Final

from dva_sim.agents.control_room.history import EventHistory
from dva_sim.console.asking.refusal import Refused
from dva_sim.console.events.decisions import moment_ms
from dva_sim.console.wire.events import DetailsShown, InstructionShown, StepShown

NEWEST: Final = 40  # steps of all events together that a shift begins with


def details_shown(
    number: int | None,
    histories: Mapping[int, EventHistory],
    label_of: Callable[[str], str],
    instructions: Iterable[InstructionShown] = (),
) -> DetailsShown:
    """Return the details of an event; without a number the newest steps of all events.

    Args:
        number: Number of the event.
        histories: Histories by the numbers of their events.
        label_of: Function that returns the label of a device by its id.
        instructions: Instructions for the event.

    Raises:
        Refused: there is no such event.
    """
    if number is None:
        steps = [step for each in histories for step in _steps(each, histories[each], label_of)]
        steps.sort(key=lambda step: step["at_ms"])
        return {"event": None, "history": steps[-NEWEST:], "instructions": []}
    if number not in histories:
        raise Refused(f"there is no event {number}")
    history = _steps(number, histories[number], label_of)
    return {"event": number, "history": history, "instructions": [*instructions]}


def _steps(event: int, history: EventHistory, label_of: Callable[[str], str]) -> list[StepShown]:
    return [
        {
            "event": event,
            "at_ms": moment_ms(step.time),
            "what": step.what,
            "who": step.who,
            "device": label_of(step.device) if step.device else "",
            "reason": step.reason,
        }
        for step in history.steps
    ]
