"""S5: a driver whose commands are refused stops driving, as its messages show."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass
from typing import Any

from dva_sim.kernel.recorder import Recorder
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.storms.interference import PassingMessage

STOPS_WITHIN = 20.0  # of the first refusal, which may be as late as others [s]
ENOUGH = 3  # refusals in a row; the first may be of a former drive
_BEGINS, _COMMANDS = b"<StartTeleOp", b"<SetTeleOp"
_TELLS = b"<reply>", b"<RobotHolder>"


@dataclass
class _Refused:
    """Refusals in a row of one driver by one robot."""

    first: float
    count: int = 0


class RefusedDrivers:
    """Sees what robots tell their drivers, and whether those go on all the same.

    Args:
        recorder: Recorder of drivers who continue.
        labels: Names by id.
        drivers: Ids of those who have to stop.
    """

    def __init__(self, recorder: Recorder, labels: dict[str, str], drivers: Container[str]) -> None:
        self._recorder, self._labels, self._drivers = recorder, labels, drivers
        self._refused: dict[tuple[str, str], _Refused] = {}

    def arrives(self, now: float, passing: PassingMessage) -> None:
        """Note the replies that a driver receives."""
        data, to = passing.payload, passing.to
        if to not in self._drivers or not isinstance(data, bytes):
            return
        if not any(kind in data for kind in _TELLS):
            return
        key, is_refused = (to, passing.source), _refuses(data, to)
        if is_refused:
            self._refused.setdefault(key, _Refused(now)).count += 1
        elif is_refused is False:
            self._refused.pop(key, None)

    def sent(self, now: float, source: str, to: str, payload: Any) -> None:
        """Judge a command by a refused driver, unless that driver has restarted."""
        refused = self._refused.get((source, to))
        if refused is None or not isinstance(payload, bytes):
            return
        if _BEGINS in payload:
            del self._refused[source, to]
        elif _COMMANDS in payload and refused.count >= ENOUGH:
            since = now - refused.first
            if since > STOPS_WITHIN:
                what = f"commands {self._labels[to]} on, which has refused it for {since:.0f} s"
                self._recorder.violated("S5", now, self._labels[source], what)


def _refuses(data: bytes, to: str) -> bool | None:
    """Return True if a robot refuses a driver, False if it obeys it, None if that is not told."""
    try:
        body = decode(data).body
    except ProtocolError:
        return None
    if isinstance(body, m.RobotHolder):
        return body.holder != to or body.code in m.OBEYS_NO_MORE
    if isinstance(body, m.Reply) and body.content is None:
        return body.code in m.OBEYS_NO_MORE if body.code != m.OK else False
    return None
