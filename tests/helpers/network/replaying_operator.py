"""An operator who repeats the messages of an earlier one."""

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.drive import Teleoperation
from dva_sim.agents.operator.supervision import Work
from dva_sim.agents.tilt import Phone, TiltCommand
from dva_sim.simulation.full import Recording, control_room, simulate
from dva_sim.simulation.scenario import Scenario


class Tape:
    """Actions of a phone and its person in a run with one drive, in order."""

    def __init__(self) -> None:
        self.looks: list[TiltCommand | None] = []
        self.next_looks: list[float] = []
        self.keeps_alive = True
        self.arrivals: list[float] = []
        self.ended, self.outcome, self.why = 0.0, "", ""


def taped(scenario: Scenario, seed: int) -> tuple[Tape, Recording]:
    """A run, and what was done in it."""
    tape = Tape()

    class TapedPhone(Phone):
        def look(self, now: float) -> TiltCommand | None:
            tape.keeps_alive = self.keeps_alive
            tape.looks.append(super().look(now))
            return tape.looks[-1]

        def next_look(self, now: float, rate_hz: float) -> float:
            tape.next_looks.append(super().next_look(now, rate_hz))
            return tape.next_looks[-1]

    class TapedDrive(Teleoperation):
        def _arrive(self) -> None:
            tape.arrivals.append(self._clock.now)
            super()._arrive()

        def end(self, outcome: str, why: str = "") -> None:
            tape.ended, tape.outcome, tape.why = self._clock.now, outcome, why
            super().end(outcome, why)

    with _in_the_room(TapedPhone, TapedDrive):
        return tape, simulate(scenario, seed)


def replay(scenario: Scenario, seed: int, tape: Tape) -> Recording:
    """Repeat a run with an operator who neither looks nor tilts, but sends the same."""

    class TapePhone:
        """Sends the recorded messages."""

        hand_lag, keeps_alive, failures, first_failure = 0.0, tape.keeps_alive, 0, ""
        samples = values = 0
        waits = False

        def __init__(self, *_: Any) -> None:
            self._looks, self._next_looks = deque(tape.looks), deque(tape.next_looks)

        def pick_up(self, now: float) -> None:
            """Nothing to pick up."""

        def look(self, now: float) -> TiltCommand | None:
            return self._looks.popleft()

        def next_look(self, now: float, rate_hz: float) -> float:
            return self._next_looks.popleft()

    class Sender(Teleoperation):
        """Takes frames for the tick of the newest one alone."""

        def begin(self) -> None:
            Work.begin(self)
            self._device.recorder.drive_begins(self._device.id_tag)
            for time in tape.arrivals:
                self._clock.call_at(time, self._arrive)
            self._sender = self._make_sender()
            self._sender.start()
            self._clock.call_at(tape.ended, self.end, tape.outcome, tape.why)

        def _see(self, observation: Observation) -> None:
            self._seen_tick = observation.tick

    with _in_the_room(TapePhone, Sender):
        return simulate(scenario, seed)


@contextmanager
def _in_the_room(phone: type, drive: type[Teleoperation]) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as room:
        room.setattr(control_room, "Phone", phone)
        room.setattr(control_room, "Teleoperation", drive)
        yield
