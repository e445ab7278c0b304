"""Messages as elements: written and read as `protocol/dva.xsd` declares them.

The fields of a class are the children of its element, in their order. Every value passes a check
made from its type in the schema, so that what leaves here is valid by construction.

Valid values are written; values that the schema cannot hold raise `ProtocolError`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import lru_cache
from inspect import Parameter, signature
from operator import attrgetter
from typing import Any, Final, NamedTuple, get_args, get_type_hints

from lxml import etree

from dva_sim.protocol import limits
from dva_sim.protocol import messages as m
from dva_sim.protocol.errors import ProtocolError

Write = Callable[[Any], str]

_FORMS: Final = {
    "DeviceID": "like 70:1A:04:F9:81:D6",
    "Timestamp": "HH:MM:SS",
    "Address": "like 192.168.1.48 or with :port",
    "Name": "printable characters",
    "Text": "printable characters",
    "Url": "ASCII characters without spaces",
    "Base64": "characters of Base64",
}
"""Texts of each type in words, without their length."""


def bad(reason: str) -> ProtocolError:
    """Return the error to raise about a value that no message can hold."""
    return ProtocolError(m.BAD_MESSAGE, reason)


def writer(element: str, kind: str) -> Write:
    """Return a function that writes a value of a simple type as the text of an element."""
    limits_of_kind = limits.facets(kind)
    base = limits_of_kind["base"][0]
    if "enumeration" in limits_of_kind:
        words = limits_of_kind["enumeration"]
        return _text(element, "|".join(words), " or ".join(words))
    if base == "xs:string":
        if "maxLength" not in limits_of_kind:
            return _text(element, limits.pattern(kind), _FORMS[kind])
        least, most = limits.length(kind)
        form = f"{least} to {most} {_FORMS[kind]}" if least else f"up to {most} {_FORMS[kind]}"
        return _text(element, f"(?=(?s:.{{{least},{most}}})\\Z){limits.pattern(kind)}", form)
    return _integer(element, kind) if base in limits.WHOLE else _real(element, kind)


def _real(element: str, kind: str) -> Write:
    low, high = limits.bounds(kind)

    def write(value: float) -> str:
        if low <= value <= high:
            # float(), because a NumPy scalar's repr contains its type; + 0.0 turns -0.0, which
            # no reader expects of a speed, into 0.0.
            return repr(float(value) + 0.0)
        raise bad(f"{element} must be within {low:g} and {high:g}, not {value!r}")

    return write


def _integer(element: str, kind: str) -> Write:
    low, high = limits.bounds(kind)

    def write(value: int) -> str:
        if low <= value <= high:
            return f"{value:d}"
        raise bad(f"{element} must be within {low} and {high}, not {value!r}")

    return write


def _text(element: str, pattern: str, form: str) -> Write:
    match = re.compile(pattern).fullmatch

    @lru_cache(maxsize=256)
    def write(value: str) -> str:
        if match(value):
            return value.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        raise bad(f"{element} must be {form}, not {value!r}")

    return write


DECLARATION: Final = '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>'

_Element = etree._Element
_Read = Callable[[_Element], Any]


class _Field(NamedTuple):
    name: str
    read: _Read
    is_list: bool


class _Value(NamedTuple):
    write: Write
    read: _Read


class Form:
    """Serialisation of the messages of a class.

    Args:
        kind: Class of the messages.
        declared: Children of its element, as the schema declares them.
        around: Names of the elements around these, from the outermost in.
    """

    def __init__(self, kind: type, declared: list[_Element], *around: str) -> None:
        self._kind = kind
        self._fields: dict[str, _Field] = {}
        self._absent: dict[str, Any] = {}
        self._leaves: list[tuple[str, Write]] = []  # paths of attributes, and how each is written
        self._text = ""
        parameters = signature(kind).parameters
        for (name, hint), node in zip(get_type_hints(kind).items(), declared, strict=True):
            tag = node.get("name", "")
            least, most = limits.occurs(node)
            # The type inside an optional value or a list.
            kinds = [each for each in get_args(hint) if each not in (type(None), Ellipsis)]
            inner = _value_of(node, kinds[0] if kinds else hint)
            if most > 1:
                self._add("%s", [(name, _several(tag, inner.write, least, most))])
                self._absent[name] = ()
            elif not least:
                usual = parameters[name].default
                self._absent[name] = None if usual is Parameter.empty else usual
                self._add("%s", [(name, _optional(tag, inner.write, self._absent[name]))])
            elif isinstance(inner, Form):
                below = [(f"{name}.{path}", write) for path, write in inner._leaves]
                self._add(f"<{tag}>{inner._text}</{tag}>", below)
            else:
                self._add(f"<{tag}>%s</{tag}>", [(name, inner.write)])
            self._fields[tag] = _Field(name, inner.read, most > 1)
        for tag in reversed(around):
            self._text = f"<{tag}>{self._text}</{tag}>"
        self._writers = [write for _, write in self._leaves]
        self._values = _values_of([path for path, _ in self._leaves])

    def _add(self, text: str, leaves: list[tuple[str, Write]]) -> None:
        self._text += text
        self._leaves += leaves

    def write(self, body: Any) -> str:
        """Return a message as the elements around its fields, and these.

        Raises:
            ProtocolError: a value that the schema cannot hold.
        """
        values = zip(self._writers, self._values(body), strict=True)
        return self._text % tuple([write(value) for write, value in values])

    def read(self, element: _Element) -> Any:
        """Return the message of a validated element."""
        values = dict(self._absent)
        for child in element:
            name, read, is_list = self._fields[child.tag]
            value = read(child)
            values[name] = (*values.get(name, ()), value) if is_list else value
        return self._kind(**values)


def _values_of(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function that takes the values of these attributes from a message."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda body: tuple([attrgetter(name)(body) for name in names])


def _value_of(node: _Element, kind: Any) -> Form | _Value:
    """Return the form of an element's content."""
    if not limits.is_simple(node):
        return Form(kind, limits.children(node))
    write = writer(node.get("name", ""), node.get("type", ""))
    return _Value(write, _str if kind is str else lambda element: kind(element.text or ""))


def _str(element: _Element) -> str:
    return element.text or ""


def _optional(tag: str, write: Write, absent: Any) -> Write:
    # A default value is left out, so that receivers of earlier versions understand the rest.
    def write_other(value: Any) -> str:
        return "" if value == absent else f"<{tag}>{write(value)}</{tag}>"

    return write_other


def _several(tag: str, write: Write, least: int, most: int) -> Write:
    def write_all(values: tuple[Any, ...]) -> str:
        if not least <= len(values) <= most:
            raise bad(f"{tag} must be there {least} to {most} times, not {len(values)}")
        return "".join([f"<{tag}>{write(value)}</{tag}>" for value in values])

    return write_all


# --- whole messages ----------------------------------------------------------------------

_CLASSES: Final = {kind.__name__: kind for kind in (*get_args(m.Body), *get_args(m.Content))}


def _form(node: _Element, *around: str) -> Form:
    """Return the form of an element that is called like its class."""
    name = node.get("name", "")
    return Form(_CLASSES[name], limits.children(node), *around, name)


def _bodies() -> Iterator[tuple[str, Form]]:
    """Yield all that a simple message may carry but replies, by name."""
    for payload in limits.parts("SimpleMsg"):
        name = payload.get("name", "")
        if name in _CLASSES:
            yield name, _form(payload)
        elif name != "reply" and not limits.is_simple(payload):
            yield from (
                (each.get("name", ""), _form(each, name)) for each in limits.children(payload)
            )


def _writers(nodes: list[_Element]) -> list[Write]:
    return [writer(node.get("name", ""), node.get("type", "")) for node in nodes]


_BODIES: Final = dict(_bodies())
_CONTENTS: Final = {node.get("name", ""): _form(node) for node in limits.parts("Reply")[3:]}
_REGISTRATION: Final = Form(m.Registration, limits.parts("Description"))
_DESTINATION, _NUMBER, _SOURCE, _CLOCK = _writers(limits.parts("Header"))
_SESSION: Final = writer("SessionID", "SessionID")
_ANSWERS, _CODE, _TEXT = _writers(limits.parts("Reply")[:3])
_WRITERS: Final[dict[type, tuple[str, Write]]] = {
    **{_CLASSES[name]: ("SimpleMsg", form.write) for name, form in _BODIES.items()},
    m.Reply: ("SimpleMsg", lambda body: _write_reply(body)),
    m.Registration: ("RegMsg", _REGISTRATION.write),
    m.Heartbeat: ("HBMsg", lambda body: ""),
    m.Emergency: ("EmergencyMsg", lambda body: ""),
}


def _write_reply(body: m.Reply) -> str:
    content_body = body.content
    content = (
        "" if content_body is None else _CONTENTS[type(content_body).__name__].write(content_body)
    )
    return (
        f"<reply><Answers>{_ANSWERS(body.answers)}</Answers><Code>{_CODE(body.code)}</Code>"
        f"<Text>{_TEXT(body.text)}</Text>{content}</reply>"
    )


def _write_session(message: m.Message) -> str:
    if type(message.body) is m.Heartbeat:
        if message.session is not None:
            raise bad("a heartbeat carries no session")
        return ""
    if message.session is None:
        raise bad("only a heartbeat carries no session; before one is granted it is 0")
    return f"<SessionID>{_SESSION(message.session)}</SessionID>"


def write(message: m.Message) -> str:
    """Return the message as XML.

    Raises:
        ProtocolError: a value that the schema cannot hold.
    """
    try:
        kind, write_body = _WRITERS[type(message.body)]
        return (
            f"{DECLARATION}<msg><{kind}>"
            f"<DestinationID>{_DESTINATION(message.destination)}</DestinationID>"
            f"<MessageID>{_NUMBER(message.message_id)}</MessageID>"
            f"<SourceID>{_SOURCE(message.source)}</SourceID>"
            f"<Timestamp>{_CLOCK(message.timestamp)}</Timestamp>"
            f"{_write_session(message)}{write_body(message.body)}</{kind}></msg>"
        )
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise bad(f"a value of the wrong type: {error}") from error


def _read_simple(payload: _Element) -> m.Body:
    if payload.tag == "reply":
        answers, code, text, *content = payload
        return m.Reply(
            int(_str(answers)),
            int(_str(code)),
            _str(text),
            _CONTENTS[content[0].tag].read(content[0]) if content else None,
        )
    element = payload if payload.tag in _BODIES else payload[0]
    body: m.Body = _BODIES[element.tag].read(element)
    return body


def read(root: _Element) -> m.Message:
    """Return the message in a validated tree: names, order, form and number were checked."""
    kind = root[0]
    destination, number, source, clock, *rest = kind
    body: m.Body
    match kind.tag:
        case "SimpleMsg":
            body = _read_simple(rest[1])
        case "RegMsg":
            body = m.Registration(*map(_str, rest[1:]))
        case "HBMsg":
            body = m.Heartbeat()
        case _:
            body = m.Emergency()
    session = int(_str(rest[0])) if rest else None
    return m.Message(_str(destination), int(_str(number)), _str(source), _str(clock), session, body)
