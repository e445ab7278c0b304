"""JSON of the facts that the safety rules are judged by.

It stands in the lines of live runs and in recordings. Units stand in the names; a number that is
not finite is null.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

from dva_sim.kernel.recorder import Accepted, ByHand
from dva_sim.protocol.messages import Position
from dva_sim.simulation.full import observations as o
from dva_sim.simulation.full.stage import DVA

DIGITS = 5  # decimals of measured values: finer than motor ticks and the rules' tolerances

DEGREES = 8  # decimals of latitude and longitude: a millimetre

Plain = dict[str, Any]


class _Form(NamedTuple):
    """Functions that write a kind of fact, apart from its time, and read it."""

    kind: type
    write: Callable[[Any], Plain]
    read: Callable[[float, Mapping[str, Any]], Any]


def _as_named(kind: type, **renamed: str) -> _Form:
    """Return the form of a kind whose fields JSON can hold directly, some under other names."""
    fields = [name for name in kind._fields if name != "time"]  # type: ignore[attr-defined]
    names = {name: renamed.get(name, name) for name in fields}

    def write(fact: Any) -> Plain:
        return {written: getattr(fact, name) for name, written in names.items()}

    def read(time: float, content: Mapping[str, Any]) -> Any:
        return kind(time=time, **{name: content[written] for name, written in names.items()})

    return _Form(kind, write, read)


def _write_arrived(fact: o.Arrived) -> Plain:
    return {"source": fact.source, "to": fact.to, "message": fact.payload.decode()}


def _read_arrived(time: float, content: Mapping[str, Any]) -> o.Arrived:
    return o.Arrived(time, content["source"], content["to"], content["message"].encode())


def _write_moves(fact: o.MotionNews) -> Plain:
    return {"motions": [_write_motion(robot, motion) for robot, motion in fact.motions.items()]}


def _read_moves(time: float, content: Mapping[str, Any]) -> o.MotionNews:
    return o.MotionNews(
        time, {motion["robot"]: _read_motion(motion) for motion in content["motions"]}
    )


def _write_motion(robot: str, motion: o.RobotMotion) -> Plain:
    return {
        "robot": robot,
        "mode": motion.mode,
        "speed_m_s": _rounded(motion.speed),
        "turn_rate_rad_s": _rounded(motion.turn_rate),
        "asked_speed_m_s": _rounded(motion.asked_speed),
        "asked_turn_rate_rad_s": _rounded(motion.asked_turn_rate),
        "asked_until_s": _rounded(motion.asked_until),
        "touched_s": _rounded(motion.touched),
        "grip": _rounded(motion.grip),
        "powered": motion.powered,
    }


def _read_motion(content: Mapping[str, Any]) -> o.RobotMotion:
    return o.RobotMotion(
        mode=content["mode"],
        speed=_number(content["speed_m_s"], math.nan),
        turn_rate=_number(content["turn_rate_rad_s"], math.nan),
        asked_speed=_number(content["asked_speed_m_s"], math.nan),
        asked_turn_rate=_number(content["asked_turn_rate_rad_s"], math.nan),
        asked_until=_number(content["asked_until_s"], math.inf),
        touched=_number(content["touched_s"], -math.inf),
        grip=_number(content["grip"], math.nan),
        powered=bool(content["powered"]),
    )


def _rounded(value: float) -> float | None:
    return round(value, DIGITS) if math.isfinite(value) else None


def _number(value: float | None, missing: float) -> float:
    return missing if value is None else float(value)


def _write_places(fact: o.PlaceNews) -> Plain:
    return {"places": [_write_place(device, at) for device, at in fact.places.items()]}


def _write_place(device: str, at: Position) -> Plain:
    latitude = round(at.latitude, DEGREES)
    longitude = round(at.longitude, DEGREES)
    return {"device": device, "latitude_deg": latitude, "longitude_deg": longitude}


def _read_places(time: float, content: Mapping[str, Any]) -> o.PlaceNews:
    return o.PlaceNews(
        time,
        {
            at["device"]: Position(at["latitude_deg"], at["longitude_deg"])
            for at in content["places"]
        },
    )


def _write_events(fact: o.BookNews) -> Plain:
    rights = None if fact.rights is None else [right._asdict() for right in fact.rights]
    written = _EVENTS.write(fact) | {"rights": rights}
    if not fact.served and fact.dva == DVA:  # as it was written before there were several
        del written["dva"], written["copies"], written["served"]
    return written


def _read_events(time: float, content: Mapping[str, Any]) -> o.BookNews:
    rights = content["rights"] and [o.Right(**right) for right in content["rights"]]
    news: o.BookNews = _EVENTS.read(time, {"dva": DVA, "copies": {}, "served": {}} | dict(content))
    copies = {int(number): (lent[0], lent[1]) for number, lent in news.copies.items()}
    return news._replace(rights=rights, copies=copies)


_EVENTS: Final = _as_named(o.BookNews)


def _read_gap(time: float, content: Mapping[str, Any]) -> o.FactGap:
    """Read a gap; earlier versions noted neither its start nor the rules that depend on it."""
    since = float(content.get("since_s", time))
    return o.FactGap(time, content["missing"], since, tuple(content.get("rules", ())))


FORMS: Final[dict[str, _Form]] = {
    "arrived": _Form(o.Arrived, _write_arrived, _read_arrived),
    "heard": _as_named(o.Heard),
    "accepted": _as_named(Accepted, seen_tick="seen_tick_ms", arrived="arrived_s"),
    "by_hand": _as_named(ByHand),
    "moves": _Form(o.MotionNews, _write_moves, _read_moves),
    "places": _Form(o.PlaceNews, _write_places, _read_places),
    "book": _Form(o.BookNews, _write_events, _read_events),
    "deafened": _as_named(o.Deafened),
    "slowed": _as_named(o.Slowed, processing="processing_s"),
    "gap": _Form(o.FactGap, _as_named(o.FactGap, since="since_s").write, _read_gap),
}
"""Forms by the word that stands for each kind of fact."""
_WORDS: Final = {form.kind: word for word, form in FORMS.items()}


def as_plain(fact: Any) -> tuple[str, float, Plain]:
    """Return word, time [s] and content of a fact other than a sent message."""
    word = _WORDS[type(fact)]
    return word, fact.time, FORMS[word].write(fact)


def of_plain(word: str, time: float, content: Mapping[str, Any]) -> Any:
    """Return the fact that `as_plain` has written.

    Raises:
        KeyError, TypeError, ValueError, AttributeError: it was written otherwise.
    """
    return FORMS[word].read(time, content)
