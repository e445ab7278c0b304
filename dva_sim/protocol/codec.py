"""Messages to bytes and back, by `protocol/dva.xsd`.

The output of `encode` is valid by construction. `decode` trusts nobody: `schema` validates every
message. Only the frequent messages of a drive, in exactly the form that `encode` gives them, take
a shorter path: commands come ten times a second and more, and a regular expression reads them
several times as fast as a validating parser. The expressions are narrower than the schema: they
accept nothing that the schema refuses, and leave everything else to the parser. The bounds of real
numbers are in the digits allowed before the point, so that no rounding decides.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Final

from dva_sim.protocol import limits
from dva_sim.protocol import messages as m
from dva_sim.protocol.elements import DECLARATION, write
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.limits import bounds, choices
from dva_sim.protocol.messages import BAD_MESSAGE, Message
from dva_sim.protocol.schema import MAX_BYTES, read_validated

MAX_UINT32: Final = bounds("Natural")[1]
MAX_SESSION: Final = bounds("SessionID")[1]
MAX_TICK: Final = bounds("Tick")[1]

_Groups = Sequence[bytes]

_DEVICE_ID = f"({limits.pattern('DeviceID')})"
_CLOCK = f"({limits.pattern('Timestamp')})"
_POSITIVE = "([1-9][0-9]{0,9})"
_NATURAL = "(0|[1-9][0-9]{0,9})"
_SESSION = "(0|[1-9][0-9]{0,19})"
_TICK = "(0|[1-9][0-9]{0,15})"
_CODE = "(0|[1-9][0-9]{0,2})"
_TEXT = "([ -%'-;=?-~]{0,256})"
_NAME = "([ -%'-;=?-~]{1,64})"
_ADDRESS = f"({limits.pattern('Address')})"
_MODE = f"({'|'.join(choices('Mode'))})"


def _real(whole: str, sign: str = "-?") -> str:
    """Return a pattern of numbers: with `whole` before the point, or with an exponent."""
    small = r"[0-9](?:\.[0-9]{1,17})?e-[0-9]{2,3}"
    return rf"({sign}(?:{whole}\.[0-9]{{1,22}}|{small}))"


_BELOW_100 = _real("[0-9]{1,2}")
_LATITUDE = _real("[1-8]?[0-9]")
_LONGITUDE = _real("(?:1[0-7]|[1-9])?[0-9]")
_HEADING = _real("[0-9]{1,6}")
_DURATION = _real("[0-9]{1,6}", sign="")

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
_HOLDER = (
    f"<RobotHolder>(?:<HolderID>{_DEVICE_ID}</HolderID>)?"
    f"(?:<DeviceLabel>{_NAME}</DeviceLabel>)?<HeldFor>{_DURATION}</HeldFor>"
    f"(?:<Code>{_CODE}</Code>)?</RobotHolder>"
)
_REPLY = f"<reply><Answers>{_NATURAL}</Answers><Code>{_CODE}</Code><Text>{_TEXT}</Text></reply>"
_DESCRIPTION = (
    f"<DeviceLabel>{_NAME}</DeviceLabel><DeviceType>{_NAME}</DeviceType><IpAddr>{_ADDRESS}</IpAddr>"
)


def _simple(payload: str, kind: str = "SimpleMsg") -> str:
    return f"<{kind}>{_HEADER}<SessionID>{_SESSION}</SessionID>{payload}</{kind}>"


def _set_teleop(groups: _Groups) -> m.SetTeleOp | None:
    speed, turn_rate, frame = groups
    tick = int(frame) if frame else None
    if tick and tick > MAX_TICK:
        return None
    return m.make_set_tele_op(float(speed), float(turn_rate), tick)


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


def _holder(groups: _Groups) -> m.RobotHolder:
    holder, label, held_for, code = groups
    return m.RobotHolder(
        holder.decode() if holder else None,
        label.decode() if label else None,
        float(held_for),
        int(code) if code else None,
    )


def _person(groups: _Groups) -> m.PersonStatus:
    activity, latitude, longitude = groups
    return m.PersonStatus(activity.decode(), m.Position(float(latitude), float(longitude)))


def _registration(groups: _Groups) -> m.Registration:
    label, device_type, address = groups
    return m.Registration(label.decode(), device_type.decode(), address.decode())


def _reply(groups: _Groups) -> m.Reply | None:
    answers, code, text = groups
    if int(answers) > MAX_UINT32:
        return None
    return m.Reply(int(answers), int(code), text.decode())


_Match = Callable[[bytes], re.Match[bytes] | None]


def _whole(kind: str) -> _Match:
    return re.compile(f"{re.escape(DECLARATION)}<msg>{kind}</msg>".encode()).fullmatch


_LAST: Final = 26
"""Number of last bytes that distinguish the kinds, which is quicker than trying every pattern."""
_REGISTERS: Final = b"</IpAddr></RegMsg></msg>"

_READERS: Final[dict[bytes, tuple[_Match, Callable[[_Groups], m.Body | None]]]] = {
    b"</Timestamp></HBMsg></msg>"[-_LAST:]: (_whole(_HEARTBEAT), lambda groups: m.Heartbeat()),
    b"</TeleOp></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_SET_TELEOP)), _set_teleop),
    b"</RobotStatus></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_STATUS)), _status),
    b"</RobotHolder></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_HOLDER)), _holder),
    b"</PersonStatus></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_PERSON)), _person),
    b"</reply></SimpleMsg></msg>"[-_LAST:]: (_whole(_simple(_REPLY)), _reply),
    _REGISTERS: (_whole(_simple(_DESCRIPTION, "RegMsg")), _registration),
}


def read_canonical(data: bytes) -> m.Message | None:
    """Return the message, if it has one of the forms known here.

    None says nothing about its validity.
    """
    reader = _READERS.get(data[-_LAST:]) or _READERS.get(data[-len(_REGISTERS) :])
    if reader is None:
        return None
    match, read_body = reader
    fields = match(data)
    if fields is None:
        return None
    destination, number, source, clock, *rest = fields.groups()
    message_id = int(number)
    # Only a heartbeat has no session.
    session = int(rest[0]) if rest else None
    body = read_body(rest[1:])
    if body is None or message_id > MAX_UINT32 or (session and session > MAX_SESSION):
        return None
    return m.make_message(
        destination.decode(), message_id, source.decode(), clock.decode(), session, body
    )


def timestamp(seconds_of_day: float, exact: bool = False) -> str:
    """Return the time of day as `HH:MM:SS`; midnight wraps.

    Args:
        seconds_of_day: Seconds since midnight [s].
        exact: True for microseconds; otherwise fractions are dropped.
    """
    whole = int(seconds_of_day // 1)
    face = _clock_face(whole % 86_400)
    return f"{face}.{int((seconds_of_day - whole) * 1e6):06}" if exact else face


@lru_cache(maxsize=64)
def _clock_face(second: int) -> str:
    minutes, seconds = divmod(second, 60)
    return f"{minutes // 60:02}:{minutes % 60:02}:{seconds:02}"


def encode(message: Message) -> bytes:
    """Return the message as UTF-8 XML, valid by the schema.

    Raises:
        ProtocolError: a value that the schema cannot hold (nan, an unknown mode, a bad id, ...),
            or a message of more than `MAX_BYTES`.
    """
    data = write(message).encode()
    if len(data) > MAX_BYTES:
        raise ProtocolError(BAD_MESSAGE, f"{len(data)} bytes; a message has at most {MAX_BYTES}")
    return data


@lru_cache(maxsize=64)
def decode(data: bytes) -> Message:
    """Return the message in `data`; whatever the bytes, a message or a `ProtocolError`.

    A publication is read by every subscriber: the same bytes are validated once.

    Raises:
        ProtocolError: not a message by the specification; the reason fits into a reply.
    """
    return read_canonical(data) or read_validated(data)


def decode_if_valid(data: bytes) -> Message | None:
    """Decode a message; None if it is not valid."""
    try:
        return decode(data)
    except ProtocolError:
        return None
