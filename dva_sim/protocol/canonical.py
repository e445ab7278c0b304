"""The messages of a drive as `encode` writes them, read without a parser.

A command goes through here ten times a second and more, and a pattern reads it several times as
fast as a validating parser. A pattern is narrower than the schema: it lets pass nothing that the
schema refuses, and what it does not know is left to the parser. The bounds of real numbers are in
the digits that may stand before the point, so that no rounding decides.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Final

from dva_sim.protocol import messages as m
from dva_sim.protocol.writers import DECLARATION

MAX_UINT32: Final = 2**32 - 1
MAX_SESSION: Final = 2**64 - 1
MAX_TICK: Final = 2**53 - 1

_Groups = Sequence[bytes]

_DEVICE_ID = "(" + ":".join(["[0-9A-F]{2}"] * 6) + ")"
_CLOCK = r"((?:[01][0-9]|2[0-3]):[0-5][0-9]:[0-5][0-9](?:\.[0-9]{1,9})?)"
_POSITIVE = "([1-9][0-9]{0,9})"
_NATURAL = "(0|[1-9][0-9]{0,9})"
_SESSION = "(0|[1-9][0-9]{0,19})"
_TICK = "(0|[1-9][0-9]{0,15})"
_CODE = "(0|[1-9][0-9]{0,2})"
_TEXT = "([ -%'-;=?-~]{0,256})"
_NAME = "([ -%'-;=?-~]{1,64})"
_MODE = "(Idle|Mission|Teleoperation)"


def _real(whole: str) -> str:
    """A number with these digits before the point, or one below 10 with an exponent."""
    small = r"[0-9](?:\.[0-9]{1,17})?e-[0-9]{2,3}"
    return rf"(-?(?:{whole}\.[0-9]{{1,22}}|{small}))"


_BELOW_100 = _real("[0-9]{1,2}")
_LATITUDE = _real("[1-8]?[0-9]")
_LONGITUDE = _real("(?:1[0-7]|[1-9])?[0-9]")
_HEADING = _real("[0-9]{1,6}")

_HEADER = (
    f"<DestinationID>{_DEVICE_ID}</DestinationID><MessageID>{_POSITIVE}</MessageID>"
    f"<SourceID>{_DEVICE_ID}</SourceID><Timestamp>{_CLOCK}</Timestamp>"
)
_HEARTBEAT = f"<HBMsg>{_HEADER}</HBMsg>"
_SET_TELEOP = (
    f"<TeleOp><SetTeleOp><Speed>{_BELOW_100}</Speed><TurnRate>{_BELOW_100}</TurnRate>"
    f"(?:<SeenTick>{_TICK}</SeenTick>)?</SetTeleOp></TeleOp>"
)
_POSITION = (
    f"<Position><Latitude>{_LATITUDE}</Latitude><Longitude>{_LONGITUDE}</Longitude></Position>"
)
_PERSON = f"<PersonStatus><Activity>{_NAME}</Activity>{_POSITION}</PersonStatus>"
_STATUS = (
    f"<RobotStatus><Mode>{_MODE}</Mode>{_POSITION}<Heading>{_HEADING}</Heading>"
    f"<Speed>{_BELOW_100}</Speed><TurnRate>{_BELOW_100}</TurnRate><Tick>{_TICK}</Tick>"
    "</RobotStatus>"
)
_REPLY = f"<reply><Answers>{_NATURAL}</Answers><Code>{_CODE}</Code><Text>{_TEXT}</Text></reply>"


def _simple(payload: str) -> str:
    return f"<SimpleMsg>{_HEADER}<SessionID>{_SESSION}</SessionID>{payload}</SimpleMsg>"


def _set_teleop(groups: _Groups) -> m.SetTeleOp | None:
    speed, turn_rate, seen = groups
    tick = int(seen) if seen else None
    if tick and tick > MAX_TICK:
        return None
    return m.SetTeleOp(float(speed), float(turn_rate), tick)


def _status(groups: _Groups) -> m.RobotStatus | None:
    mode, latitude, longitude, heading, speed, turn_rate, tick = groups
    if int(tick) > MAX_TICK:
        return None
    return m.RobotStatus(
        mode.decode(),
        m.Position(float(latitude), float(longitude)),
        float(heading),
        float(speed),
        float(turn_rate),
        int(tick),
    )


def _person(groups: _Groups) -> m.PersonStatus:
    activity, latitude, longitude = groups
    return m.PersonStatus(activity.decode(), m.Position(float(latitude), float(longitude)))


def _reply(groups: _Groups) -> m.Reply | None:
    answers, code, text = groups
    if int(answers) > MAX_UINT32:
        return None
    return m.Reply(int(answers), int(code), text.decode())


_Match = Callable[[bytes], re.Match[bytes] | None]


def _whole(kind: str) -> _Match:
    return re.compile(f"{re.escape(DECLARATION)}<msg>{kind}</msg>".encode()).fullmatch


_LAST: Final = 26
"""So many last bytes tell the kinds apart, which is quicker than trying every pattern."""

_READERS: Final[dict[bytes, tuple[_Match, Callable[[_Groups], m.Body | None]]]] = {
    b"</Timestamp></HBMsg></msg>"[-_LAST:]: (_whole(_HEARTBEAT), lambda groups: m.Heartbeat()),
    b"</TeleOp></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_SET_TELEOP)), _set_teleop),
    b"</RobotStatus></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_STATUS)), _status),
    b"</PersonStatus></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_PERSON)), _person),
    b"</reply></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_REPLY)), _reply),
}


def read_canonical(data: bytes) -> m.Message | None:
    """The message, if this is one of those known here; else None, which says nothing about it."""
    reader = _READERS.get(data[-_LAST:])
    if reader is None:
        return None
    match, read_body = reader
    found = match(data)
    if found is None:
        return None
    destination, number, source, clock, *rest = found.groups()
    message_id = int(number)
    # Only a heartbeat has no session.
    session = int(rest[0]) if rest else None
    body = read_body(rest[1:])
    if body is None or message_id > MAX_UINT32 or (session and session > MAX_SESSION):
        return None
    return m.Message(
        destination.decode(), message_id, source.decode(), clock.decode(), session, body
    )
