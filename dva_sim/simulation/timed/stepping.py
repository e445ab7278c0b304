"""A shift that pauses whenever the DVA asks its policy, for external decisions."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from queue import SimpleQueue

import numpy as np
from typing_extensions import override

from dva_sim.core.dispatch import Advice, Policy, Situation
from dva_sim.core.events import Event
from dva_sim.simulation.timed.recording import TimedRecording
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.timed.simulation import Shift


class SteppedShift:
    """A shift, decision by decision.

    The DVA asks its policy from deep within a run, so the run has a thread of its own. It goes on
    only while `advise` waits for it: nothing ever happens at the same time.

    Args:
        seed: Random seed, as in `simulate_timed`.
        preempts: See `Policy`.
        auctions: See `Policy`.
        relocates: See `Policy`.

    Attributes:
        situation: Situation that the DVA asks about; None once the shift is over.
        rng: Random numbers for policies that use them.
        recording: The whole run, once it is over.

    Raises:
        ConfigError: see `simulate_timed`.
    """

    situation: Situation | None
    rng: np.random.Generator
    recording: TimedRecording | None = None

    def __init__(
        self,
        scenario: TimedScenario,
        seed: int,
        *,
        preempts: bool = False,
        auctions: bool = False,
        relocates: bool = False,
    ) -> None:
        policy = _Outside(self._halt)
        policy.preempts = preempts
        policy.auctions = auctions
        policy.relocates = relocates
        self._shift = Shift(scenario, seed, policy)
        self._known = 0
        self._questions: SimpleQueue[Situation | BaseException | None] = SimpleQueue()
        self._answers: SimpleQueue[Sequence[Advice] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="shift", daemon=True)
        self._thread.start()
        self._wait()

    @property
    def now(self) -> float:
        """Time of the shift [s]."""
        return self._shift.clock.now

    @property
    def units(self) -> list[str]:
        """Device ids of all guards and robots."""
        return [unit.device for unit in self._shift.units]

    def new_events(self) -> list[Event]:
        """Return the events reported since the last call, as the DVA knows them."""
        events = self._shift.core.events
        first = self._known + 1
        self._known = events.total
        return [e for number in range(first, events.total + 1) if (e := events.get(number))]

    def advise(self, advice: Sequence[Advice]) -> Situation | None:
        """Return the answer, and let time pass until the DVA asks again; None: the shift is over.

        Raises:
            RuntimeError: it is over already, or was closed.
        """
        if self.situation is None:
            raise RuntimeError("the shift is over: nothing is asked any more")
        self._answers.put(advice)
        return self._wait()

    def close(self) -> None:
        """End the shift where it is; nothing of it is kept."""
        self._answers.put(None)
        self._thread.join()
        self.situation = None

    def _wait(self) -> Situation | None:
        question = self._questions.get()
        if isinstance(question, BaseException):
            self.situation = None
            raise question
        self.situation = question
        return question

    # --- in the thread of the shift ------------------------------------------------------

    def _run(self) -> None:
        end: BaseException | None = None
        try:
            self.recording = self._shift.run()
        except _Closed:
            return
        except BaseException as error:
            end = error
        self._questions.put(end)

    def _halt(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        self.rng = rng
        self._questions.put(situation)
        advice = self._answers.get()
        if advice is None:
            raise _Closed
        return advice


class _Closed(BaseException):
    """Ends the thread of a shift; no `Exception`, which the DVA would take for a policy's fault."""


class _Outside(Policy):
    """Policy that is decided outside of the run."""

    def __init__(self, ask: Callable[[Situation, np.random.Generator], Sequence[Advice]]) -> None:
        self._ask = ask

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        return self._ask(situation, rng)
