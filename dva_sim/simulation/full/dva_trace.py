"""Trace of the DVA's inputs and decisions: kept as lines of JSON, and replayed.

The DVA's decider is pure: the same messages at the same times, with the same random numbers, give
the same replies and the same orders. The first line holds what it was made from; each other line
a thing that happened to it, the random bits that were drawn, and what followed.
"""

from __future__ import annotations

import base64
import json
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, TypeVar, cast

from dva_sim.core.dva import Dva, Reaction
from dva_sim.core.sessions import Permissions, Send
from dva_sim.core.store import Store
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import Recorder
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.devices import ControlRoomRole
from dva_sim.protocol.errors import ProtocolError
from dva_sim.simulation.full.control_room import make_core
from dva_sim.simulation.full.stage import DVA, Stage
from dva_sim.simulation.scenario import Scenario, robot_profiles

REMEMBERED = 20_000  # maximum sent messages that may still be answered
OWN_CODE = ".py:"  # part of a name that refers to a user's class in a file

Sink = Callable[[str], object]
T = TypeVar("T", Reaction, list[Send])


class TracedDva:
    """Recording wrapper of the DVA core with the same interface.

    Args:
        core: Core that makes the decisions.
        sink: Callback for lines.
        stage: Stage of the run.
        memory: Store that it will recall, if any.
    """

    def __init__(self, core: Dva, sink: Sink, stage: Stage, memory: Store | None = None) -> None:
        self._core = core
        self._sink = sink
        self._bits: list[int] = []
        self._numbers: OrderedDict[Send, int] = OrderedDict()
        self._given = 0
        self._roles = dict(core.roles.known)
        permissions = core.sessions.permissions
        draw = permissions.draw
        permissions.draw = lambda: self._kept(draw())
        memory_text = None if memory is None else base64.b64encode(memory.copy()).decode()
        start = {
            "dva": DVA,
            "scenario": stage.scenario.model_dump(mode="json"),
            "seed": stage.seed,
            "sessions": permissions.count,
            "most_devices": core.registry.most,
            "memory": memory_text,
        }
        sink(json.dumps(start))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._core, name)

    def _kept(self, bits: int) -> int:
        self._bits.append(bits)
        return bits

    # --- what happens to it --------------------------------------------------------------

    def handle(self, message: m.Message, now: float) -> Reaction:
        """See `Dva`, as for all that follow."""
        values = {"do": "handle", "message": encode(message).decode(), "now": now}
        return self._decided(values, lambda: self._core.handle(message, now))

    def note(self, message: m.Message, now: float) -> list[Send]:
        """Handle a published message."""
        values = {"do": "note", "message": encode(message).decode(), "now": now}
        return self._decided(values, lambda: self._core.note(message, now))

    def delivered(self, send: Send, now: float, content: Any = None) -> list[Send]:
        """Take the answer OK, with its content, to an order."""
        entry = self._about(send, now, m.Reply(1, m.OK, "", content))
        return self._decided(entry, lambda: self._core.delivered(send, now, content))

    def refused_grant(self, send: Send, reply: m.Reply, now: float) -> list[Send]:
        """Take a refusal of a permission."""
        entry = self._about(send, now, reply)
        return self._decided(entry, lambda: self._core.refused_grant(send, reply, now))

    def undelivered(self, send: Send, now: float) -> list[Send]:
        """Take the news that an order was not answered."""
        return self._decided(
            self._about(send, now, None), lambda: self._core.undelivered(send, now)
        )

    def tick(self, now: float) -> list[Send]:
        """Handle the passing of time."""
        return self._decided({"do": "tick", "now": now}, lambda: self._core.tick(now))

    def go_on(self) -> list[Send]:
        """Continue after a recall."""
        return self._decided({"do": "go on"}, self._core.go_on)

    def dismiss(self, device: str, now: float) -> list[Send]:
        """Dismiss a device."""
        values = {"do": "dismiss", "device": device, "now": now}
        return self._decided(values, lambda: self._core.dismiss(device, now))

    def close(self) -> list[Send]:
        """End all sessions, as the DVA ends."""
        return self._decided({"do": "close"}, self._core.close)

    def check_access(self, now: float) -> None:
        """Do nothing: only a memory that was recalled asks for this from outside."""
        self._core.check_access(now)
        self._sink(json.dumps({"do": "recall", "now": now}))

    def _about(self, send: Send, now: float, reply: m.Reply | None) -> dict[str, Any]:
        data = None if reply is None else encode(_as_message(reply)).decode()
        number = self._numbers.get(send)
        if number is None:  # so many were sent since that it was forgotten: no replay goes on
            self._sink = _nowhere
        return {"do": "answer", "to": number, "reply": data, "now": now}

    def _decided(self, entry: dict[str, Any], decide: Callable[[], T]) -> T:
        self._bits = []
        entry |= self._new_roles()
        decision = decide()
        _, sends = _parts(decision)
        for send in sends:
            self._numbers[send] = self._given
            self._numbers.move_to_end(send)
            self._given += 1
        while len(self._numbers) > REMEMBERED:
            self._numbers.popitem(last=False)
        drawn = {"bits": self._bits} if self._bits else {}
        self._sink(json.dumps(entry | drawn | {"decided": _in_words(decision)}))
        return decision

    def _new_roles(self) -> dict[str, Any]:
        """Return the roles of control rooms if one has changed since the last line."""
        roles = self._core.roles.known
        if roles == self._roles:
            return {}
        self._roles = dict(roles)
        return {"roles": dict(roles)}


def _nowhere(_: str) -> None:
    """Forget devices and events that are no longer kept."""


def traced(core: Dva, sink: Sink, stage: Stage, memory: Store | None) -> Dva:
    """Return a core whose inputs and decisions are recorded; see `TracedDva`."""
    return cast(Dva, TracedDva(core, sink, stage, memory))


def _as_message(reply: m.Reply) -> m.Message:
    return m.Message(DVA, 1, DVA, "00:00:00", 0, replace(reply, text=reply.text[:256]))


def _parts(decision: Any) -> tuple[m.Reply | None, list[Send]]:
    return decision if isinstance(decision, tuple) else (None, decision)


def _in_words(decision: Any) -> list[str]:
    """Return the reply, if there is one, and the other messages."""
    reply, sends = _parts(decision)
    return [*([] if reply is None else [repr(reply)]), *map(repr, sends)]


# --- the same again ----------------------------------------------------------------------


class Decided(NamedTuple):
    """Line of a trace: an input, the decision then, and the decision now."""

    line: int
    what: str
    then: list[str]
    now: list[str]


def replay_dva(lines: Iterable[str | bytes], path: Path) -> Iterator[Decided]:
    """Replay the inputs of a trace to a fresh DVA, and yield both decisions on each.

    Args:
        lines: Lines of a trace.
        path: File of the lines, for error messages.

    Raises:
        ConfigError: this is no trace of a DVA; or it would have to run a class in a file.
    """
    again: _Again | None = None
    for number, line in enumerate(lines, 1):
        try:
            entry = json.loads(line)
            if again is None:
                again = _Again(entry)
            else:
                then = entry.get("decided", [])
                now = again.decide(entry)
                yield Decided(number, entry["do"], then, now)
        except _BROKEN as error:
            text = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise ConfigError(f"is no line of a DVA's trace: {text}", path, number) from error
    if again is None:
        raise ConfigError("is no line of a DVA's trace: it is empty", path, 1)


_BROKEN = ValueError, KeyError, IndexError, TypeError, AttributeError, ProtocolError


class _Again:
    """A DVA made from the first line of a trace."""

    def __init__(self, start: dict[str, Any]) -> None:
        scenario = Scenario.model_validate(start["scenario"])
        _refuse_own_code(scenario)
        # A core talks to nobody, and no command is sent.
        plain = scenario.model_copy(update={"pattern": "req-rep", "pattern_options": {}})
        stage = Stage(plain, start["seed"], cast(Any, None), Recorder(), attended=True)
        self._bits: deque[int] = deque()
        permissions = Permissions(self._draw, count=start["sessions"])
        self._core = make_core(stage, permissions)
        self._sends = list[Send]()
        self._core.registry.most = start["most_devices"]
        self._memory = start["memory"]

    def _draw(self) -> int:
        return self._bits.popleft() if self._bits else 0

    def decide(self, entry: dict[str, Any]) -> list[str]:
        """Apply the input again; return the decision now."""
        self._bits = deque(entry.get("bits", ()))
        if "roles" in entry:
            roles = {room: ControlRoomRole(role) for room, role in entry["roles"].items()}
            self._core.roles.known = roles
        if entry["do"] == "recall":
            self._recall(entry["now"])
            return []
        decision = self._decide(entry)
        self._sends += _parts(decision)[1]
        return _in_words(decision)

    def _decide(self, entry: dict[str, Any]) -> Any:
        core = self._core
        match entry["do"]:
            case "handle":
                return core.handle(decode(entry["message"].encode()), entry["now"])
            case "note":
                return core.note(decode(entry["message"].encode()), entry["now"])
            case "answer":
                return self._answered(self._sends[entry["to"]], entry["reply"], entry["now"])
            case "tick":
                return core.tick(entry["now"])
            case "go on":
                return core.go_on()
            case "dismiss":
                return core.dismiss(entry["device"], entry["now"])
            case "close":
                return core.close()
        raise ValueError(f"{entry['do']!r} does not happen to a DVA")

    def _answered(self, send: Send, reply_xml: str | None, now: float) -> list[Send]:
        if reply_xml is None:
            return self._core.undelivered(send, now)
        reply = decode(reply_xml.encode()).body
        assert isinstance(reply, m.Reply)
        if reply.code == m.OK:
            return self._core.delivered(send, now, reply.content)
        return self._core.refused_grant(send, reply, now)

    def _recall(self, now: float) -> None:
        with TemporaryDirectory() as folder:
            file = Path(folder) / "memory.sqlite"
            file.write_bytes(base64.b64decode(self._memory))
            store = Store(file)
            store.recall(self._core, now)
            store.close()


def _refuse_own_code(scenario: Scenario) -> None:
    """Refuse a class in a file, which runs only when somebody names it, never by a trace.

    Raises:
        ValueError: the DVA or its map would need one.
    """
    names = [scenario.dispatch.policy, *(r.drive for r in robot_profiles(scenario))]
    for name in names:
        if OWN_CODE in name:
            raise ValueError(f"{name} is a class in a file, and a trace runs none")
