"""The page of the console's interface for programs: routes, roles and actions."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from pkgutil import iter_modules

from dva_sim.console import web
from dva_sim.console.wire.actions import ACTIONS, Action, ActionPlace, Audit
from dva_sim.console.wire.kinds import hints_of, words_of
from dva_sim.console.wire.roles import Role
from generators.markdown import code, prose, sentence, table
from generators.markdown import page as page_of

_HEAD = """\
A program uses the console as a page does: it reads what pages show and posts actions. It sends the
token that `dva-sim console` printed. Each action has an id of the client's choice; the same id
again does nothing twice, except an emergency.

```console
$ curl -H "Authorization: Bearer TOKEN" http://127.0.0.1:8765/api/state
$ curl -H "Authorization: Bearer TOKEN" -H "Content-Type: application/json" \\
       -d '{"id": "a-1", "action": "take", "arguments": {"robots": ["robot-1"]}}' \\
       http://127.0.0.1:8765/api/actions
```

The answer holds `ok` and `text`. Actions that take something of their own, such as `take` or
`guard_join`, also answer with a `key`: send it as `"key"` with each later action of that seat. A
seat without a request for ten minutes is given up. To drive, open `/ws/state`, whose first line
names the client and its key, then `/ws/drive?key=KEY`, and send `input` 25 times a second."""
_ROLES = {
    Role.LOOK: "sees everything, and may press the emergency stop",
    Role.PHONE: "drives one robot from a phone, or is a guard's phone",
    Role.DRIVE: "drives robots, and changes the link and the run",
    Role.DISPATCH: "also decides on events and alarms",
    Role.SUPERVISE: "also takes robots from their holders, and says who decides",
}
_PLACES = {
    ActionPlace.WORLD: "simulation",
    ActionPlace.REMOTE: "remote DVA",
    ActionPlace.ROBOT: "robot alone",
    ActionPlace.REPLAY: "recording",
}
_SOCKETS = {
    "WS /ws/state": "What pages show, a line of JSON for each change; the first names the client "
    "and its key.",
    "WS /ws/drive": "Actions and input of a client that drives; `key` is the client's key.",
}
_ROUTE = re.compile(r"`((?:GET|POST) [^`]*)`(?: and others)?[:;.]?\s*(.*)", re.DOTALL)
_AUDIT = {Audit.OWN: "yes", Audit.DVA: "row of the DVA"}


def page() -> str:
    """Return the page in Markdown."""
    return page_of(
        "Console interface",
        _HEAD,
        "## Routes",
        "Every route but `/healthz` and `/trust` needs a token.",
        table(["request", "answer"], ([code(each), text] for each, text in routes())),
        "## Roles",
        "Each may do what those before it may.",
        table(["role", "a client with it"], ([code(r.name.lower()), t] for r, t in _ROLES.items())),
        "## Actions",
        "An argument with `?` may be left out. Arguments that make no sense are answered with 400, "
        "an action above the role of the token with 403.",
        table(
            ["action", "meaning", "arguments", "role", "acts in", "in the audit log"],
            map(_row, ACTIONS.values()),
        ),
    )


def routes() -> list[tuple[str, str]]:
    """Return each request with what it answers, as the docstrings of its handlers say it."""
    found: dict[str, str] = {}
    for module in iter_modules(web.__path__):
        source = Path(web.__path__[0], f"{module.name}.py").read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.AsyncFunctionDef):
                match = _ROUTE.match(ast.get_docstring(node) or "")
                if match:
                    found[match[1]] = sentence(match[2])
    return sorted((found | _SOCKETS).items(), key=lambda each: each[0].partition(" ")[2])


def _row(action: Action) -> list[str]:
    needed = action.arguments.__required_keys__  # type: ignore[attr-defined]
    arguments = (
        f"`{name}`{'' if name in needed else '?'}: {prose(words_of(hint))}"
        for name, hint in hints_of(action.arguments).items()
    )
    audit = f"no: {action.audit}" if isinstance(action.audit, str) else _AUDIT[action.audit]
    return [
        code(action.name),
        sentence(action.does),
        "; ".join(arguments),
        action.role.name.lower(),
        ", ".join(word for place, word in _PLACES.items() if place in action.at),
        prose(audit),
    ]
