"""Lines of a console as they are declared: unknown, missing or of another type, a value fails."""

import json
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, Union, get_args, get_type_hints

from pydantic import TypeAdapter
from typing_extensions import is_typeddict

from dva_sim.cameras import lines as painted
from dva_sim.console.web.feed import PageFeed
from dva_sim.console.web.state import RunState
from dva_sim.console.wire import (
    audit_answers,
    events,
    lines,
    pages,
    records,
    rows,
    scenes,
    seats,
)

STRICT = {"extra": "forbid", "strict": True, "allow_inf_nan": False}
for module in (audit_answers, events, pages, records, rows, scenes, seats, painted):
    for declared in vars(module).values():
        if is_typeddict(declared):
            declared.__pydantic_config__ = STRICT


def kinds_of(declared: Any) -> dict[str, list[type]]:
    """The types of a union of lines, by the kinds of lines."""
    found: dict[str, list[type]] = {}
    for one in get_args(declared):
        found.setdefault(*get_args(get_type_hints(one)["k"]), []).append(one)
    return found


@cache
def _adapter(declared: Any, kind: str) -> TypeAdapter[Any]:
    return TypeAdapter(Union[*kinds_of(declared)[kind]])


def checked(line: Mapping[str, Any], declared: Any = lines.WorldLine) -> dict[str, Any]:
    """A line as it arrives at the other end, where it is as declared."""
    text = json.dumps(line)
    _adapter(declared, line["k"]).validate_json(text)
    arrived: dict[str, Any] = json.loads(text)
    return arrived


def at_page(sent: Iterable[Mapping[str, Any]], client: str) -> list[dict[str, Any]]:
    """Messages of the web process to a page that subscribes to everything."""
    state, messages = RunState(), []
    feed = PageFeed(state, client)
    for line in sent:
        if line["k"] in ("done", "bye"):
            continue
        if state.take(line) == "scene":
            labels = [thing["label"] for thing in line["things"][:1]]
            feed.watches = frozenset(thing["i"] for thing in line["things"])
            feed.looks.look({"dva": {}, **{label: {} for label in labels}}, ["devices"])
        while (text := feed.next()) is not None:
            message = json.loads(text)
            assert message.pop("s") == len(messages) + 1
            messages.append(checked(message, lines.ToPage))
    return messages
