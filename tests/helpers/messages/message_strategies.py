"""One strategy per body, by the types and names of its fields: all the protocol can say."""

from base64 import b64encode
from typing import Any, get_args, get_origin, get_type_hints

from hypothesis import strategies as st

from dva_sim.protocol import messages as m

UINT32 = 2**32 - 1
UINT64 = 2**64 - 1
ROBOT, TABLET = "70:1A:04:F9:81:D6", "56:2B:04:E4:56:D8"


def real(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda value: value + 0.0)  # -0.0 is written as 0.0


def characters(least: int, most: int) -> st.SearchStrategy[str]:
    # The two non-characters are not allowed in XML at all.
    allowed = st.characters(exclude_categories=["Cc", "Cs"], exclude_characters="\ufffe\uffff")
    return st.text(allowed, min_size=least, max_size=most)


def one_word(words: str) -> st.SearchStrategy[str]:
    return st.sampled_from(words.split())


ids = st.from_regex(r"\A[0-9A-F]{2}(:[0-9A-F]{2}){5}\Z")
clocks = st.from_regex(r"\A([01][0-9]|2[0-3])(:[0-5][0-9]){2}(\.[0-9]{1,9})?\Z")
numbers = st.integers(1, UINT32)
STRATEGIES: dict[str, st.SearchStrategy[Any]] = {
    "actor advised author device dva holder id_tag operator origin responder stopped_by": ids,
    "action activity device_type label name policy region sensor sensors unit": characters(1, 64),
    "note reason text": characters(0, 256),
    "age ago advised_in arrival_in bid_within closed_for decide_within held_for": real(0, 1e6),
    "service_time state_for stopped_for": real(0, 1e6),
    "confidence severity": real(0, 1),
    "speed turn_rate": real(-100, 100),
    "frequency": real(0, 1000),
    "heading": real(-1e6, 1e6),
    "latitude": real(-90, 90),
    "longitude": real(-180, 180),
    "values": real(-1e8, 1e8),
    "epoch event_id fact request_number": numbers,
    "answers decisions device_count free_responders": st.integers(0, UINT32),
    "mission_id newest open_events size": st.integers(0, UINT32),
    "code": st.integers(0, 999),
    "laps": st.integers(0, 1000),
    "request": st.binary(max_size=300).map(lambda data: b64encode(data).decode()),
    "reply": st.binary(max_size=300).map(lambda data: b64encode(data).decode()),
    "seen_tick tick": st.integers(0, 2**53 - 1),
    "session": st.integers(1, UINT64),
    "waypoints_left": st.integers(0, 64),
    "address": st.ip_addresses(v=4).map(str) | st.ip_addresses(v=4).map("{}:5556".format),
    "camera_url": st.text(
        st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=256
    ),
    "dispatch_mode": one_word("automatic ask_first"),
    "event_state": one_word(
        "pending assigned on_scene confirmed contained refuted escalated expired"
    ),
    "finding": one_word("detected confirmed refuted contained"),
    "kind": one_word("fire gas_leak flood"),
    "level": one_word("teleoperation missions both sensors"),
    "mission_state": one_word("none under_way waiting replanning done failed"),
    "mode": one_word("Idle Mission Teleoperation"),
    "released_by": one_word("person drive"),
    "role": one_word("look drive dispatch supervise"),
    "state": one_word("accepted declined departed arrived failed done"),
    "takeover": one_word("no ask force"),
    "task waits_for": one_word("confirm contain stand_by"),
}
BY_NAME = {name: strategy for names, strategy in STRATEGIES.items() for name in names.split()}
SIZES = {"waypoints": (1, 40), "values": (1, 40), "events": (0, 2)}


def held(hint: Any, name: str) -> st.SearchStrategy[Any]:
    """Strategy for the values of a field."""
    if get_origin(hint) is tuple:
        least, most = SIZES.get(name, (0, 3))
        part = held(get_args(hint)[0], name)
        return st.lists(part, min_size=least, max_size=most).map(tuple)
    if parts := get_args(hint):
        return st.one_of(*(held(part, name) for part in parts))
    if hint is type(None):
        return st.none()
    return BY_NAME[name] if hint in (str, int, float) else built(hint)


def built(kind: type) -> st.SearchStrategy[Any]:
    fields = get_type_hints(kind)
    return st.builds(kind, **{name: held(hint, name) for name, hint in fields.items()})


BODIES: dict[type, st.SearchStrategy[m.Body]] = {kind: built(kind) for kind in get_args(m.Body)}


def with_header(body: m.Body) -> st.SearchStrategy[m.Message]:
    session = st.none() if isinstance(body, m.Heartbeat) else st.integers(0, UINT64)
    return st.builds(m.Message, ids, numbers, ids, clocks, session, st.just(body))


messages = st.one_of(*BODIES.values()).flatmap(with_header)


def message(body: m.Body, session: int | None = 1425) -> m.Message:
    """A message with the header of the one printed in the specification."""
    return m.Message(ROBOT, 124, TABLET, "12:30:56", session, body)
