"""Judges a live run by the safety rules during the run, from the lines that its parts write.

Parts are processes. Each writes the facts that it observes, in order and by its own clock. A rule
compares only times of the same part, so that no rule depends on two clocks: commands, motors and
motion of a robot are facts of the world's process, events and permissions those of the DVA's. Two
facts come from another part: the true sender of a message, regardless of time, and the position of
a person or robot that confirms an event, accurate to half a second.
"""

from __future__ import annotations

import heapq
import json
import math
import threading
from collections.abc import Iterable
from typing import Any, Final

from dva_sim.agents.observation import CameraFrame, Observation, SeenHazard
from dva_sim.kernel.recorder import Moment, Sent
from dva_sim.simulation.full.observation_json import of_plain
from dva_sim.simulation.full.observations import MAX_SENT, Arrived, FactGap, SafetyTerms, Senders
from dva_sim.simulation.full.verdicts import Judge, Verdict

WAITS = 10.0  # maximum wait for the lines of a silent or late part [s]
# First words of the lines that are judged.
OWN_SIDE = "here"
SEEN = "seen"
SENT_LINE = "sent"
FRAME = "frame"
JUDGED: Final = OWN_SIDE, SEEN, SENT_LINE, FRAME
_STARTS: Final = tuple(f'["{word}"'.encode() for word in JUDGED)

Line = list[Any]


class Facts:
    """Reads facts from lines, and identifies the true sender of each message.

    Args:
        most: Maximum number of messages that are remembered; None: all.
    """

    def __init__(self, most: int | None = MAX_SENT) -> None:
        self._own_devices: set[str] = set()
        self._senders = Senders(self._own_devices.__contains__, most)

    def note(self, line: Line) -> None:
        """Remember the devices of this run and the messages that they sent, in any order."""
        if line[0] == OWN_SIDE:
            self._own_devices.update(line[2])
        elif line[0] == SENT_LINE and line[2] in self._own_devices:
            self._senders.note(line[2], line[4].encode())

    def fact(self, line: Line) -> Any:
        """Return the fact in a line; None if it contains none."""
        if line[0] == SENT_LINE:
            _, time, source, to, text = line
            return Sent(time, source, to, len(text), text.encode())
        if line[0] == FRAME:
            _, time, robot, seen, captured = line
            return Sent(time, robot, "", 0, CameraFrame(read_observation(seen), captured))
        if line[0] != SEEN:
            return None
        _, time, word, values = line
        fact = of_plain(word, time, values)
        if isinstance(fact, Arrived):
            fact = fact._replace(source=self._senders.sender(fact.source, fact.payload))
        return fact


def read_observation(seen: list[Any]) -> Observation:
    """Return a camera's observation from its values in a line."""
    *values, hazards, visibility = seen
    return Observation._make(
        (*values, tuple(SeenHazard(*hazard) for hazard in hazards), visibility)
    )


class LiveJudge:
    """Judges the lines of all parts in order of time; each part calls from its own thread.

    Args:
        terms: Limits of the safety rules.
    """

    def __init__(self, terms: SafetyTerms) -> None:
        self._judge = Judge(terms)
        self._facts = Facts()
        self._waiting: list[tuple[float, int, Line]] = []
        self._reported_to: dict[int, float] = {}  # latest time reported by each running part [s]
        self._count = 0
        self._latest = 0.0
        self._up_to = 0.0
        self._is_judging = False
        self._lock = threading.Lock()

    def joins(self, part: int) -> None:
        """Expect lines from a part."""
        with self._lock:
            self._reported_to[part] = 0.0

    def hear(self, part: int, lines: Iterable[bytes]) -> None:
        """Handle whole lines of a part."""
        with self._lock:
            for line in lines:
                if line.startswith(_STARTS):
                    self._hear(part, json.loads(line))
            self._judge_up_to(max(min(self._reported_to.values()), self._latest - WAITS))

    def _hear(self, part: int, line: Line) -> None:
        time = float(line[1])
        self._facts.note(line)
        self._reported_to[part] = max(self._reported_to[part], time)
        self._latest = max(self._latest, time)
        self._count += 1
        heapq.heappush(self._waiting, (time, self._count, line))

    def leaves(self, part: int) -> None:
        """Expect no more lines from a part."""
        with self._lock:
            self._reported_to.pop(part, None)
            self._judge_up_to(min(self._reported_to.values(), default=self._latest))

    def _judge_up_to(self, time: float) -> None:
        self._is_judging = True
        while self._waiting and self._waiting[0][0] <= time:
            self._up_to, _, line = heapq.heappop(self._waiting)
            fact = self._facts.fact(line)
            if fact is not None:
                self._judge.take(fact)
        self._is_judging = False

    def news(self) -> list[Moment]:
        """Return new breaches for the timeline; only the first one of each rule."""
        with self._lock:
            moments = self._judge.recorder.timeline
            self._judge.recorder.timeline = []
            return moments

    def verdicts(self) -> list[Verdict]:
        """Return the verdict on each rule, once all parts have ended.

        After an error of the judge itself, later lines are not judged.
        """
        with self._lock:
            if not self._is_judging:
                self._judge_up_to(self._latest)
            if self._is_judging:
                self._judge.take(FactGap(math.inf, len(self._waiting) + 1, self._up_to))
            return self._judge.verdicts()
