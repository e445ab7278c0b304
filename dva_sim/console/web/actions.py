"""What clients may ask for, read with suspicion: known actions, and who may ask for them."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from typing import Any, TypeGuard

from dva_sim.console.web.access import Role
from dva_sim.console.web.checks import (
    MOST_ROBOTS,
    BadMessage,
    Check,
    Labels,
    NotAllowed,
    flag,
    maybe,
    number,
    one_of,
    robot,
    robots,
    robots_or_all,
    several,
    text,
    whole,
    word,
)

MOST_BYTES = 16 * 1024  # of a message or a body
MOST_SAMPLES = 64  # in one message
FAR = 1e6  # of the origin: no site is so large [m]
_ID = re.compile(r"[A-Za-z0-9._:-]{1,64}")

Known = dict[str, tuple[dict[str, Check], tuple[str, ...]]]


def read(text: str | bytes) -> dict[str, Any]:
    """A JSON object out of a message.

    Raises:
        BadMessage: it is something else.
    """
    try:
        data = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError):
        raise BadMessage("is not JSON") from None
    if not isinstance(data, dict):
        raise BadMessage("is not a JSON object")
    return data


def _no_number(word: str) -> float:
    raise ValueError(word)


_LINK = {
    "delay_s": number(0, 60),
    "jitter_s": number(0, 60),
    "loss": number(0, 1),
    "rate_bps": number(1, 1e12),
    "processing_s": number(0, 60),
}

_AXES = several(number(-1000, 1000), 3, 3)  # of an acceleration [m/s^2]
_PLACE = {"x_m": number(-FAR, FAR), "y_m": number(-FAR, FAR)}
_LABEL = text(1, 64)
_REGISTER = {
    "server": text(1, 64),
    "port": whole(1, 65_535),
    "label": _LABEL,
    "type": one_of("Robot", "Remote Control", "Teleoperation"),
}
_FAKE = {
    "label": _LABEL,
    "type": one_of("Robot", "Guard", "TeleOp", "Remote Control"),
    "address": text(0, 64),
    "id_tag": text(0, 17),
}
_PERMISSION = {"device": word, "level": one_of("teleoperation", "missions", "both")}
_CALIBRATE = {
    "reference_mps2": maybe(_AXES),
    "speed_step_mps2": number(0.001, 100),
    "turn_step_mps2": number(0.001, 100),
    "max_delay_s": number(0.02, 5),
    "pipeline": one_of("dissertation", "default"),
    "filter": maybe(word),
    "mapping": one_of("absolute", "differential", "leaky"),
    "ios": flag,
    "keep": flag,
}
_OPTIONAL = ("ios", "keep")
# Pictures that the page has drawn last: a robot's index and when the picture was taken [ms].
_SEEN_PICTURES = several(several(number(0, 1e13), 2, 2), 0, MOST_ROBOTS)
_SAMPLES = {
    "n": whole(0, 2**53),
    "at": several(number(0, 1e13), 1, MOST_SAMPLES),
    "xyz": several(_AXES, 1, MOST_SAMPLES),
    "hand": flag,
    "orientation": one_of(0, 90, 180, 270),
    "seen": _SEEN_PICTURES,
}
_REPORT = {
    "kind": one_of("fire", "gas_leak", "flood"),
    "severity": one_of("low", "medium", "high", "critical"),
    **_PLACE,
}
_EVENT = {"event": whole(1, 10**9)}
_SEEN = {"decisions": maybe(whole(0, 10**9))}  # of the event, as the page knows it
_REASON = text(0, 256)
_ALARM = {"alarm": text(1, 200)}
_SENT = _EVENT | {"device": _LABEL}
_SHIFT = 8 * 3600  # no alarm is shelved for longer [s]
_NEEDED_EVENT = ("event",)
# What a control room asks for: by the messages of a device of its own, or of this console.
CONTROL_ROOM: Known = {
    "room_join": ({"name": text(0, 64)}, ("name",)),
    "event_raise": (_REPORT, tuple(_REPORT)),
    "event_acknowledge": (_EVENT, _NEEDED_EVENT),
    "event_assign": (
        _SENT | _SEEN | {"task": one_of("confirm", "contain", "stand_by"), "reason": _REASON},
        ("event", "device"),
    ),
    "event_take_off": (_SENT | _SEEN | {"reason": _REASON}, ("event", "device")),
    "event_false_alarm": (_EVENT | _SEEN | {"reason": text(1, 256)}, ("event", "reason")),
    "event_escalate": (_EVENT | _SEEN | {"reason": _REASON}, _NEEDED_EVENT),
    "event_note": (_EVENT | {"text": text(1, 256)}, ("event", "text")),
    "event_proposal": (_EVENT, _NEEDED_EVENT),
    "dispatch_mode": (
        {"mode": one_of("automatic", "ask_first"), "reason": _REASON},
        ("mode",),
    ),
    "mission": ({"robot": robot, **_EVENT}, ("robot", "event")),
    "take_over": ({"robot": robot, "reason": text(1, 256)}, ("robot", "reason")),
    "alarm_acknowledge": (_ALARM, ("alarm",)),
    "alarm_shelve": (_ALARM | {"for_s": number(1, _SHIFT)}, ("alarm", "for_s")),
    "alarm_unshelve": (_ALARM, ("alarm",)),
}
_SAYINGS = ("departed", "arrived", "confirmed", "refuted", "contained", "help")

_FAULT = {
    "robot": robot,
    "what": one_of("processing", "replies", "freeze", "camera", "sensor"),
    "on": flag,
    "seconds": number(0, 3),
    "sensor": word,
}

# What may be asked: its arguments, and those of them that have to be there.
ACTIONS: Known = {
    "take": ({"robots": robots}, ("robots",)),
    "release": ({}, ()),
    "start": ({}, ()),
    "stop": ({}, ()),
    "emergency": ({"robots": robots_or_all}, ()),
    "link": (_LINK, ()),
    "pattern": ({"robot": robot, "name": word}, ("robot", "name")),
    "pace": ({"factor": number(0.01, 1000), "paused": flag}, ()),
    "seek": ({"t_ms": whole(0, 10**10)}, ("t_ms",)),
    "open_recording": ({"name": text(1, 255)}, ("name",)),
    "confirm": ({}, ()),
    "refute": ({}, ()),
    "decline": ({}, ()),
    "tour": ({}, ()),
    "tour_time": ({"robot": robot, "took_s": number(0, 3600)}, ("robot", "took_s")),
    "manual_take": ({"robot": robot}, ("robot",)),
    "manual_release": ({}, ()),
    "robot_register": ({"robot": robot, "dva": text(3, 80)}, ("robot", "dva")),
    "robot_listen": ({"robot": robot}, ("robot",)),
    "robot_off": ({"robot": robot}, ("robot",)),
    "fault": (_FAULT, ("robot", "what", "on")),
    "phone_register": (_REGISTER, tuple(_REGISTER)),
    "phone_devices": ({}, ()),
    "phone_permission": (_PERMISSION, tuple(_PERMISSION)),
    "phone_calibrate": (_CALIBRATE, tuple(key for key in _CALIBRATE if key not in _OPTIONAL)),
    "server_start": ({"port": whole(1, 65_534)}, ("port",)),
    "server_stop": ({}, ()),
    "revoke": ({"device": word}, ("device",)),
    "fake_add": (_FAKE, ("label", "type")),
    "fake_remove": ({"device": word}, ("device",)),
    "guard_join": ({"guard": _LABEL}, ("guard",)),
    "guard_leave": ({}, ()),
    "guard_answer": ({"accept": flag, "reason": text(0, 200)}, ("accept", "reason")),
    "guard_say": ({"what": one_of(*_SAYINGS)}, ("what",)),
    "guard_place": (_PLACE, tuple(_PLACE)),
    "guard_report": (_REPORT, tuple(_REPORT)),
    **CONTROL_ROOM,
}
_INPUT = {
    "n": whole(0, 2**53),
    "speed": number(0, 1),
    "turn": number(-1, 1),
    "held": flag,
    "seen": _SEEN_PICTURES,
}
# Those that have no answer.
SILENT: Known = {
    "input": (_INPUT, tuple(key for key in _INPUT if key != "seen")),
    "manual": (_INPUT, tuple(key for key in _INPUT if key != "seen")),
    "samples": (_SAMPLES, tuple(key for key in _SAMPLES if key != "seen")),
    "gone": ({}, ()),
}
# The least role that may ask for it; whoever acts at all may ask for the others. A phone changes
# nothing for others, but that it stops a robot.
NEEDS = {
    **dict.fromkeys(
        ("take", "link", "pattern", "pace", "tour", "tour_time", "seek", "open_recording"),
        Role.DRIVE,
    ),
    **dict.fromkeys(("server_start", "server_stop", "fake_add", "fake_remove"), Role.DRIVE),
    **dict.fromkeys(("manual_take", "manual", "fault"), Role.DRIVE),
    **dict.fromkeys(("robot_register", "robot_listen", "robot_off"), Role.DRIVE),
    **dict.fromkeys(CONTROL_ROOM, Role.DISPATCH),
    **dict.fromkeys(("room_join", "event_raise", "event_proposal", "mission"), Role.DRIVE),
    **dict.fromkeys(("dispatch_mode", "take_over", "revoke"), Role.SUPERVISE),
}


def check_role(role: Role, name: Any) -> None:
    """Whether somebody may ask for an action at all.

    Raises:
        NotAllowed: not by this address.
    """
    if not role.acts:
        raise NotAllowed("this address may only look")
    least = NEEDS.get(name, Role.PHONE) if isinstance(name, str) else Role.PHONE
    if role < least:
        own = "a phone's address" if role is Role.PHONE else "this address"
        raise NotAllowed(f"{own} may not {plain(name)}; an address {_FOR[least]} may")


_FOR = {Role.DRIVE: "for driving", Role.DISPATCH: "for dispatch", Role.SUPERVISE: "to supervise"}


def plain(name: str) -> str:
    """The name of an action, for people."""
    return name.replace("_", " ")


def asked_of(name: Any, given: Any, labels: Labels, silent: bool = False) -> dict[str, Any]:
    """What the simulation is asked for.

    Args:
        name: Of the action.
        given: Its arguments.
        labels: Of the robots, with their indices.
        silent: Whether those without an answer may be asked for, too.

    Raises:
        BadMessage: no such action, or an argument that makes no sense.
    """
    known = ACTIONS | SILENT if silent else ACTIONS
    if not isinstance(name, str) or name not in known:
        raise BadMessage(f"no such action; there are: {', '.join(known)}")
    if not isinstance(given, dict):
        raise BadMessage(f"{name}: arguments should be an object")
    checks, needed = known[name]
    for key in needed:
        if key not in given:
            raise BadMessage(f"{name}: {key} is missing")
    asked = {"do": name}
    for key, value in given.items():
        if key not in checks:
            raise BadMessage(f"{name}: no such argument; there are: {', '.join(checks) or 'none'}")
        try:
            asked[key] = checks[key](value, labels)
        except BadMessage as error:
            raise BadMessage(f"{name}: {key} {error}") from None
    if name == "samples":
        _check_times(asked)
    if name == "emergency":
        asked.setdefault("robots", "all")
    return asked


def _check_times(asked: dict[str, Any]) -> None:
    """A time for each sample, and each later than the one before.

    Raises:
        BadMessage: it is otherwise.
    """
    at = asked["at"]
    if len(at) != len(asked["xyz"]):
        raise BadMessage("samples: at and xyz should be equally long")
    if any(later <= one for one, later in pairwise(at)):
        raise BadMessage("samples: at should rise")


def id_of(value: Any) -> str:
    """The id by which a repeated request is known.

    Raises:
        BadMessage: it is none.
    """
    if not is_id(value):
        raise BadMessage("id should be 1 to 64 letters, digits, dots, colons or hyphens")
    return str(value)


def is_id(value: Any) -> TypeGuard[str]:
    """Return True if a value can be the id of a request."""
    return isinstance(value, str) and _ID.fullmatch(value) is not None


class Bucket:
    """How often a client may say something.

    Args:
        rate: On average [1/s].
        burst: At once.
    """

    def __init__(self, rate: float, burst: int) -> None:
        self._rate, self._burst = rate, float(burst)
        self._room, self._then = float(burst), 0.0

    def takes(self, now: float) -> bool:
        """Whether another message at `now` [s] is within bounds."""
        self._room = min(self._burst, self._room + (now - self._then) * self._rate)
        self._then = now
        self._room -= 1.0
        return self._room >= 0.0
