"""Connection of the web process to the simulation: state, and pending answers.

An answer belongs to the id of its question. A repeated question waits for the same answer; the
simulation does once what is asked.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from dva_sim.console.web.state import RunState
from dva_sim.console.wire.actions import ACTIONS, OF_THE_WEB, Asked, Queueing
from dva_sim.console.wire.kinds import Labels
from dva_sim.console.wire.limits import (
    MAX_ACTIONS,
    MAX_ASKING,
    MAX_BATCHES,
    MAX_PENDING,
    MAX_URGENT,
    SILENCE,
)
from dva_sim.console.wire.seats import REFUSAL
from dva_sim.serving.pipes import Lines, WatchedEnd


class OutgoingLines:
    """Lines to the simulation that have not been written yet.

    Only the newest input, watched robots and viewed logs of each client wait.
    Of a phone's samples all count, in their order; if too many wait, the oldest are lost, which
    their numbers tell.

    Attributes:
        refused: Number of actions rejected for lack of room.
    """

    def __init__(self) -> None:
        self._urgent: deque[Asked] = deque()
        self._actions: deque[Asked] = deque()
        self._newest: dict[tuple[str, str], Asked] = {}
        self._samples: dict[str, deque[Asked]] = {}
        self.refused = 0

    def put(self, request: Asked) -> bool:
        """Add a line: whether there was room."""
        kind = request["do"]
        client = request.get("client", "")
        action = ACTIONS.get(kind) or OF_THE_WEB.get(kind)
        waits = action.waits if action is not None else Queueing.IN_TURN
        if waits is Queueing.NEWEST:
            self._newest[client, kind] = request
            return True
        if waits is Queueing.BATCH:
            self._samples.setdefault(client, deque(maxlen=MAX_BATCHES)).append(request)
            return True
        if kind == "gone":
            for hand in ("input", "manual"):
                self._newest.pop((client, hand), None)
            self._samples.pop(client, None)
        is_urgent = waits is Queueing.FIRST
        queue = self._urgent if is_urgent else self._actions
        if len(queue) >= (MAX_URGENT if is_urgent else MAX_ACTIONS):
            self.refused += 1
            return False
        queue.append(request)
        return True

    def next(self) -> bytes | None:
        """Return the next line to write, with its end; None if there is nothing to say."""
        if self._urgent:
            request = self._urgent.popleft()
        elif self._actions:
            request = self._actions.popleft()
        elif self._newest:
            request = self._newest.pop(next(iter(self._newest)))
        elif self._samples:
            request = self._next_samples()
        else:
            return None
        return json.dumps(request, separators=(",", ":")).encode() + b"\n"

    def _next_samples(self) -> Asked:
        """Return the next samples, of each phone in turn."""
        client = next(iter(self._samples))
        waiting = self._samples.pop(client)
        request = waiting.popleft()
        if waiting:
            self._samples[client] = waiting
        return request


MAX_COMPLAINTS = 20

Answer = dict[str, Any]
OnAnswer = Callable[[Answer], object]


class Simulation:
    """The simulation, as seen from here.

    Args:
        clock: Real time [s].

    Attributes:
        state: The newest of everything.
        ended: Set when the simulation has ended.
        why: Reason why it ended.
        labels: Labels of the robots, with their indices in the scene.
        kinds: Called with each line's kind when the state has changed.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.state = RunState()
        self.ended = asyncio.Event()
        self.why = ""
        self.labels: Labels = {}
        self.changed: Callable[[str, dict[str, Any]], None] = lambda kind, line: None
        self._lines = Lines()
        self._asked = OutgoingLines()
        self._pipe: WatchedEnd | None = None
        self._heard = clock()
        self._pending: dict[str, list[OnAnswer]] = {}
        self._complaints = 0

    def open(self, number: int) -> None:
        """Use the pipe of that number."""
        loop = asyncio.get_running_loop()
        self._pipe = WatchedEnd(loop, number, self._take, self._end, self._asked.next)

    @property
    def runs(self) -> bool:
        """True if the simulation is there and, once it has begun, still sends."""
        speaks = self.state.scene is None or self._clock() - self._heard < SILENCE
        is_open = self._pipe is not None and self._pipe.is_open
        return is_open and speaks and not self.ended.is_set()

    # --- what it says --------------------------------------------------------------------

    def _take(self, data: bytes) -> None:
        self._heard = self._clock()
        try:
            lines = self._lines.feed(data)
        except ValueError as error:
            self.why = f"the simulation said too much: {error}"
            self._end()
            return
        for text in lines:
            try:
                self._take_line(json.loads(text))
            except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
                self._complaints += 1
                if self._complaints <= MAX_COMPLAINTS:
                    words = "dva-sim: a line of the simulation makes no sense"
                    print(f"{words}: {error!r}", file=sys.stderr)

    def _take_line(self, line: dict[str, Any]) -> None:
        kind = line.get("k")
        if kind == "done":
            self._answer(line)
            return
        if kind == "bye":
            self.why = str(line.get("why", ""))
            self._end()
            return
        kind = self.state.take(line)
        if kind == "scene":
            things = line.get("things", ())
            self.labels = {str(t["label"]): t["i"] for t in things if t["kind"] == "robot"}
        self.changed(kind, line)

    def _end(self) -> None:
        self.why = self.why or "the simulation has ended"
        self.ended.set()
        for key in list(self._pending):
            line = {"k": "done", "id": key, "ok": False, "text": self.why, "outcome": REFUSAL}
            self._answer(line)

    def _answer(self, line: Answer) -> None:
        for entry in self._pending.pop(str(line.get("id")), ()):
            entry(line)

    # --- what it is asked for ------------------------------------------------------------

    def send(self, request: Asked) -> bool:
        """Ask for something that has no answer: False if it cannot be said."""
        if self._pipe is None or not self._pipe.is_open or not self._asked.put(request):
            return False
        self._pipe.flush()
        return True

    def ask(self, request: Asked, on_answer: OnAnswer) -> None:
        """Send a request; `on_answer` receives the reply, which may be that the queue is full.

        Ids are those of the client that asks: the same id of another one is another question.
        """
        number = request["id"]
        key = f"{request['client']}/{number}"

        def answered(line: Answer) -> None:
            on_answer(line | {"id": number})

        if self.ended.is_set():
            answered({"k": "done", "ok": False, "text": self.why, "outcome": REFUSAL})
            return
        action = ACTIONS[request["do"]]
        is_urgent = action.waits is Queueing.FIRST
        waiting = self._pending.get(key)
        if waiting is not None and is_urgent and len(waiting) >= MAX_ASKING:
            waiting.pop(0)  # repeated questions: the newest ones get the answer
        if waiting is not None and len(waiting) < MAX_ASKING:
            waiting.append(answered)
            return
        full = waiting is not None or (len(self._pending) >= MAX_PENDING and not is_urgent)
        if full or not self.send(request | {"id": key}):
            answered({"k": "done", "ok": False, "text": "too many requests at once; try again"})
            return
        self._pending[key] = [answered]
        loop = asyncio.get_running_loop()
        patience = action.patience
        loop.call_later(patience, self._give_up, key, answered, patience)

    def _give_up(self, key: str, on_answer: OnAnswer, patience: float) -> None:
        if on_answer in self._pending.get(key, ()):
            text = f"no answer within {patience:g} s"
            self._answer({"k": "done", "id": key, "ok": False, "text": text, "late": True})

    async def answer(self, request: Asked) -> Answer:
        """Ask for something and wait for the answer."""
        reply: asyncio.Future[Answer] = asyncio.get_running_loop().create_future()
        self.ask(request, lambda line: None if reply.done() else reply.set_result(line))
        return await reply

    def close(self) -> None:
        """Ask for nothing more."""
        if self._pipe is not None:
            self._pipe.close()
