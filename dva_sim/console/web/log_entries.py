"""One line of a log of messages: what was asked, by whom, what came of it, in words and whole."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Final

from dva_sim.kernel.labels import visible
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError

if TYPE_CHECKING:
    from dva_sim.console.wire.pages import LogEntry

Names = Mapping[str, str]

UNANSWERED: Final = "none"  # in place of the code of a reply
_SHOWN: Final = 60  # characters of a payload in a line
_HEADER: Final = ("DestinationID", "MessageID", "SourceID", "Timestamp", "SessionID")


@dataclass(slots=True)
class Entry:
    """An exchange, read.

    Attributes:
        number: In its log, from 1.
        time: Arrival time by the run's clock [ms].
        data: The request, or the publication; the first bytes of one that is too long.
        reply: The answer, if there is one.
        service_us: Time that the answer took.
        published: True for a publication.
        kind: Kind of message, by the name of its element; `?` if unreadable.
        payload: Content in a few characters.
        header: Fields of its header, as far as readable.
        label: Label of a device that registers.
        code: Code of the reply; None without one.
        text: Text of the reply.
        sent: Size of the request [B]; greater than that of `data` if the rest is not known.
        renews: True for a registration that only repeats the one before.
    """

    number: int
    time: int
    data: bytes
    reply: bytes | None
    service_us: int | None
    published: bool
    kind: str = "?"
    payload: str = ""
    header: dict[str, str] = field(default_factory=dict)
    label: str = ""
    code: int | None = None
    text: str = ""
    sent: int = 0
    renews: bool = False

    @classmethod
    def of(cls, line: list[Any]) -> Entry:
        """Build an entry from an exchange; see `ExchangesLine`."""
        number, time, data, reply, took, published, *answered = line
        answer = None if reply is None else str(reply).encode("latin-1")
        request = str(data).encode("latin-1")
        entry = cls(number, time, request, answer, took, bool(published))
        entry.code, entry.text, entry.sent = answered or (None, "", len(request))
        entry._read()
        return entry

    @property
    def size(self) -> int:
        """So many bytes it keeps."""
        return len(self.data) + len(self.reply or b"")

    @property
    def is_cut(self) -> bool:
        """Return True if only the first bytes of the request are known."""
        return self.sent > len(self.data)

    @property
    def is_reply_cut(self) -> bool:
        """Return True if only the first bytes of the reply are known."""
        return self.reply is not None and not self.reply.rstrip().endswith(b"</msg>")

    def _read(self) -> None:
        self.header = header_of(self.data)
        try:
            body = decode(self.data).body
            self.kind, self.payload = kind_of(self.data), payload_of(body)
            self.label = visible(body.label) if isinstance(body, m.Registration) else ""
        except ProtocolError as error:
            self.kind = kind_of(self.data)
            self.payload = f"{self.sent} bytes" if self.is_cut else error.reason[:_SHOWN]
        if self.reply is not None:
            try:
                answer = decode(self.reply).body
            except ProtocolError:
                return
            if isinstance(answer, m.Reply):
                self.code = answer.code
                self.text = answer.text

    def brief(self, names: Names) -> LogEntry:
        """Return what a table shows of it."""
        header = self.header
        source = header.get("SourceID", "")
        to = header.get("DestinationID", "")
        return {
            "n": self.number,
            "t": self.time,
            "kind": self.kind,
            "payload": self.payload,
            "from": source,
            "from_label": names.get(source, ""),
            "to": to,
            "to_label": names.get(to, ""),
            "session": header.get("SessionID", ""),
            "code": self.code,
            "word": m.CODE_NAMES.get(self.code, str(self.code)) if self.code is not None else "",
            "text": self.text,
            "service_us": self.service_us,
            "published": self.published,
        }


_ELEMENT: Final = re.compile(rb"<(\w{1,64})\s*/?>")
_ENDS: Final = ("SessionID", "Timestamp")
_GROUPS: Final = frozenset({"Access", "Dispatch", "Event", "Mission", "Sensor", "TeleOp"})


def kind_of(data: bytes) -> str:
    """Return the kind of a message by its elements, so that a broken one has a kind as well.

    A message is named by the first element after its header, or by the one in that if it groups
    several kinds; without a payload it is called by its own element.
    """
    names = [name.decode() for name in _ELEMENT.findall(data[:1024])]
    kind = names[1] if len(names) > 1 and names[0] == "msg" else "?"
    after = max((names.index(name) for name in _ENDS if name in names), default=-1)
    inner = names[after + 1 :] if after >= 0 else []
    if kind != "SimpleMsg" or not inner:
        return kind
    return str(inner[1] if len(inner) > 1 and inner[0] in _GROUPS else inner[0])


def header_of(data: bytes) -> dict[str, str]:
    """Return the elements of a header as they stand, of a message that may be broken."""
    start = data[:1024]
    header = {}
    for name in _HEADER:
        match = re.search(rb"<%s>([^<]{0,64})</%s>" % (name.encode(), name.encode()), start)
        if match:
            header[name] = match[1].decode("utf-8", "replace").strip()
    return header


def payload_of(body: Any) -> str:
    """Summarise a message in a few characters: the values of its fields."""
    names = getattr(body, "_fields", None) or [one.name for one in fields(body)]
    text = ", ".join(
        f"{name} {_value(getattr(body, name))}"
        for name in names
        if getattr(body, name) not in (None, (), "")
    )
    return text if len(text) <= _SHOWN else text[: _SHOWN - 1] + "…"


def _value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, m.Position):
        return f"{value.latitude:.6f} {value.longitude:.6f}"
    if isinstance(value, tuple):
        return f"{len(value)}x" if len(value) > 2 else " ".join(_value(one) for one in value)
    return str(value)
