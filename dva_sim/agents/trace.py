"""What a robot's controller was told and what it decided: kept as lines of JSON, and replayed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dva_sim.agents.modes import Decision, Limits, RobotController, SetPoint
from dva_sim.errors import ConfigError
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode

LEASE_ENDS, MISSION_ENDS = "lease ends", "mission ends"


class Trace:
    """Writes what one controller decides; each line is on disk before the next decision.

    Args:
        path: The file; its folder must be there.
        controller: Whose decisions these will be.
    """

    def __init__(self, path: Path, controller: RobotController) -> None:
        self._file = path.open("w", encoding="utf-8", buffering=1)
        start = {
            "robot": controller.id_tag,
            "dva": controller.dva,
            "limits": asdict(controller.limits),
            "camera_url": controller.camera_url,
            "sensors": [asdict(sensor) for sensor in controller.sensors],
            "clock_offset": controller.clock_offset,
        }
        self._write(start)

    def decided(
        self, message: m.Message, arrived: float, now: float, moving: bool, decision: Decision
    ) -> None:
        """A message was decided on; arguments as of `RobotController.handle`."""
        told = {"arrived": arrived, "now": now, "moving": moving}
        self._write({"message": encode(message).decode(), **told, **_as_data(decision)})

    def happened(self, what: str, now: float) -> None:
        """Time or the world changed the mode: `LEASE_ENDS` or `MISSION_ENDS`."""
        self._write({"happened": what, "now": now})

    def close(self) -> None:
        """Nothing more will be decided."""
        self._file.close()

    def _write(self, data: dict[str, Any]) -> None:
        self._file.write(json.dumps(data) + "\n")


def _as_data(decision: Decision) -> dict[str, Any]:
    point = decision.set_point
    return {
        "code": decision.code,
        "text": decision.text,
        "set_point": None if point is None else list(point),
    }


def replay(path: Path) -> Iterator[tuple[m.Message, Decision, Decision]]:
    """Ask a fresh controller the same again.

    Yields:
        Each message, what was decided then, and what is decided now (reply contents left out).

    Raises:
        ConfigError: the file is no trace, or its last line is not whole.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    try:
        controller = _controller(json.loads(lines[0]))
        for line in lines[1:]:
            entry = json.loads(line)
            if "happened" in entry:
                _happen(controller, entry)
            else:
                yield _ask_again(controller, entry)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ConfigError(f"{path} is no trace of a robot: {error}") from error


def _controller(start: dict[str, Any]) -> RobotController:
    return RobotController(
        start["robot"],
        start["dva"],
        Limits(**start["limits"]),
        camera_url=start["camera_url"],
        sensors=tuple(m.Sensor(**sensor) for sensor in start["sensors"]),
        clock_offset=start["clock_offset"],
    )


def _happen(controller: RobotController, entry: dict[str, Any]) -> None:
    if entry["happened"] == LEASE_ENDS:
        controller.expire(entry["now"])
    else:
        controller.mission_done()


def _ask_again(
    controller: RobotController, entry: dict[str, Any]
) -> tuple[m.Message, Decision, Decision]:
    message = decode(entry["message"].encode())
    now = controller.handle(message, entry["arrived"], entry["now"], entry["moving"])
    point = entry["set_point"]
    then = Decision(entry["code"], entry["text"], None if point is None else SetPoint(*point))
    return message, then, now._replace(content=None)
