"""Recordings and traces: their messages are valid, and every decision is made the same again."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.testing.messages import check_message
from dva_sim.testing.promises import Problem

CUT: Final = "its last line is cut off, as of a program that was killed; all others were checked"


def check_recording(path: Path) -> tuple[list[Problem], list[str]]:
    """What is wrong with a recording, and doubts: its messages, and the decisions it holds."""
    from dva_sim.recordings import read_recording  # late: start-up

    try:
        opened = read_recording(path)
    except ConfigError as error:
        return [Problem(1, 1, error.problem)], []
    problems = list[Problem]()
    for number, sent in enumerate(opened.playback.recorder.traffic or (), 1):
        for found in check_message(sent.payload) if isinstance(sent.payload, bytes) else ():
            where = f"message {number}, at {sent.time:.1f} s, from {sent.source}"
            problems.append(Problem(1, 1, f"{where}: {found.text}"))
    for who, lines in opened.traces.items():
        found_there = _differences([line.encode() for line in lines], path)
        problems += [Problem(1, 1, f"{who}, line {p.line}: {p.text}") for p in found_there]
    doubts = [] if opened.is_whole else ["was cut short"]
    return problems, doubts


def check_trace(path: Path) -> tuple[list[Problem], list[str]]:
    """What is decided otherwise than a trace tells, and whether its end is missing."""
    *lines, rest = path.read_bytes().split(b"\n")
    problems = list(_differences(lines, path))
    return problems, [CUT] if rest else []


def _differences(lines: Sequence[bytes], path: Path) -> Iterator[Problem]:
    try:
        yield from (_of_dva if _is_of_dva(lines) else _of_robot)(lines, path)
    except ConfigError as error:
        yield Problem(error.line or 1, 1, error.problem)


def _is_of_dva(lines: Sequence[bytes]) -> bool:
    try:
        return "scenario" in json.loads(lines[0])
    except (ValueError, IndexError, TypeError, RecursionError):
        return False


def _of_dva(lines: Sequence[bytes], path: Path) -> Iterator[Problem]:
    from dva_sim.simulation.full.dva_trace import replay_dva  # late: start-up

    for line, what, then, now in replay_dva(lines, path):
        if then != now:
            told, found = ("; ".join(each) or "nothing" for each in (then, now))
            yield Problem(line, 1, f"{what}: decided was {told}, and now is {found}")


def _of_robot(lines: Sequence[bytes], path: Path) -> Iterator[Problem]:
    from dva_sim.agents.robot.decision_log import replay  # late: start-up

    # The first line is what the robot was; what has happened to it takes lines, too.
    numbers = (number for number, line in enumerate(lines, 1) if b'"message"' in line)
    for (message, then, now), line in zip(replay(path, lines), numbers, strict=False):
        if then != now:
            name = type(message.body).__name__
            told, found = tuple(then[:3]), tuple(now[:3])
            yield Problem(line, 1, f"{name}: decided was {told}, and now is {found}")
