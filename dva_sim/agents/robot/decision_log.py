"""Log of a robot controller's inputs and decisions, as lines of JSON, and its replay."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TextIO

from dva_sim.agents.robot.controller import Decision, Limits, RobotController, TimedSetPoint
from dva_sim.agents.robot.emergency_latch import DRIVE, EmergencyLatch
from dva_sim.kernel.errors import ConfigError
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.errors import ProtocolError

LEASE_ENDS = "lease ends"
MISSION_ENDS = "mission ends"
TAKEN_BY_HAND = "taken by hand"
LET_GO = "let go"
PRESSED = "emergency pressed"
RELEASED_BY_HAND = "released by hand"
RELEASES_UNKNOWN = "the DVA knows no releases"
STANDS = "stands"
HANGS = "hangs"
ASKS = "asks the DVA"
NO_ANSWER = "no answer of the DVA"
HAND = "hand"  # name used in a replay: a trace does not record who drove by hand


class DecisionLog:
    """Log of one controller's decisions; each line is in its file before the next decision.

    Args:
        to: The file, whose folder must exist; or a callback for each line.
        controller: Controller to log.
    """

    def __init__(self, to: Path | Callable[[str], object], controller: RobotController) -> None:
        self._file: TextIO | None = None
        self._take: Callable[[str], object] = self._put
        if isinstance(to, Path):
            self._file = to.open("w", encoding="utf-8", buffering=1)
        else:
            self._take = to
        start = {
            "robot": controller.id_tag,
            "dva": controller.dva,
            "limits": asdict(controller.limits),
            "camera_url": controller.camera_url,
            "sensors": [asdict(sensor) for sensor in controller.sensors],
            "clock_offset": controller.clock_offset,
            "release": controller.latch.rule,
        }
        self._write(start)

    def decided(
        self,
        message: m.Message,
        arrived: float,
        now: float,
        moving: bool,
        decision: Decision,
        waited: bool = False,
    ) -> None:
        """Note the decision on a message; arguments as of `RobotController.handle`."""
        values = {"arrived": arrived, "now": now, "moving": moving}
        values |= {"waited": True} if waited else {}
        point = decision.set_point
        self._write(
            {
                "message": encode(message).decode(),
                **values,
                "code": decision.code,
                "text": decision.text,
                "set_point": None if point is None else list(point),
            }
        )

    def happened(self, what: str, now: float) -> None:
        """Log a change by time, the world or a hand at the robot: one of the words above."""
        self._write({"happened": what, "now": now})

    def close(self) -> None:
        """Close the log: nothing more will be decided."""
        if self._file is not None:
            self._file.close()

    def _put(self, line: str) -> None:
        assert self._file is not None
        self._file.write(line + "\n")

    def _write(self, data: dict[str, Any]) -> None:
        self._take(json.dumps(data))


def replay(
    path: Path, lines: Sequence[str | bytes] | None = None
) -> Iterator[tuple[m.Message, Decision, Decision]]:
    """Give a new controller the same inputs again.

    Args:
        path: The file.
        lines: Lines of the file, if already read.

    Yields:
        Each message, what was decided then, and what is decided now (reply contents left out).

    Raises:
        ConfigError: the file cannot be read or is not a trace, or its last line is not whole.
    """
    try:
        lines = path.read_bytes().splitlines() if lines is None else lines
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", path) from error
    controller: RobotController | None = None
    for number, line in enumerate(lines or [b""], 1):
        try:
            entry = json.loads(line)
            if controller is None:
                controller = RobotController(
                    entry["robot"],
                    entry["dva"],
                    Limits(**entry["limits"]),
                    camera_url=entry["camera_url"],
                    sensors=tuple(m.Sensor(**sensor) for sensor in entry["sensors"]),
                    clock_offset=entry["clock_offset"],
                    # absent before there was a latch
                    latch=EmergencyLatch(entry.get("release", DRIVE)),
                )
                decision = None
            else:
                decision = _again(controller, entry)
        except _BROKEN as error:
            # The file is untrusted, so each value in it may be wrong.
            problem = f"is no line of a robot's trace: {_in_words(error)}"
            raise ConfigError(problem, path, number) from error
        if decision is not None:
            yield decision


_BROKEN = ValueError, KeyError, TypeError, RecursionError, ProtocolError


def _in_words(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"{error} is missing"
    return error.msg if isinstance(error, json.JSONDecodeError) else str(error)


def _again(
    controller: RobotController, entry: dict[str, Any]
) -> tuple[m.Message, Decision, Decision] | None:
    """Apply an entry; return a message's old and new decision, None for other entries."""
    if "message" in entry:
        return _ask_again(controller, entry)
    now = _value(entry, "now", float, int)
    happened = _value(entry, "happened", str)
    if happened == LEASE_ENDS:
        controller.expire(now)
    elif happened == MISSION_ENDS:
        controller.mission_changed("done", 0, "")
    elif happened == TAKEN_BY_HAND:
        controller.take_by_hand(HAND, now, moving=False)
    elif happened == LET_GO:
        controller.let_go(HAND)
    elif happened == PRESSED:
        controller.stop(now)
    elif happened == RELEASED_BY_HAND:
        controller.release_by_hand(HAND)
    elif happened == RELEASES_UNKNOWN:
        controller.latch.take_refusal()
    elif happened == STANDS:
        controller.stand(now)
    elif happened == HANGS:
        controller.hang()
    elif happened == ASKS:
        controller.inquiry.next(now)
    elif happened == NO_ANSWER:
        controller.inquiry.unanswered()
    else:
        raise ValueError(f"{happened!r} does not happen to a robot")
    return None


def _ask_again(
    controller: RobotController, entry: dict[str, Any]
) -> tuple[m.Message, Decision, Decision]:
    message = decode(_value(entry, "message", str).encode())
    arrived, time = (_value(entry, name, float, int) for name in ("arrived", "now"))
    code = _value(entry, "code", int)
    text = _value(entry, "text", str)
    point = _value(entry, "set_point", list, type(None))
    then = Decision(code, text, None if point is None else TimedSetPoint(*point))
    moving = _value(entry, "moving", bool)
    waited = bool(entry.get("waited"))
    now = controller.handle(message, arrived, time, moving, waited)
    return message, then, now._replace(content=None, waits=False)


def _value(entry: dict[str, Any], name: str, *types: type) -> Any:
    value = entry[name]
    if not isinstance(value, types):
        raise TypeError(f"{name} is {value!r}")
    return value
