"""Parts of the pages and the documentation that are generated from the declarations.

    python -m dva_sim.console.wire.generated

writes `static/js/declared.js` (how long an answer is waited for, and limits) and, in a clone, the
table of actions in `docs/console.md`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

from dva_sim.console.wire.actions import ACTIONS, Action, ActionPlace, Audit
from dva_sim.console.wire.arguments import FASTEST, LINK_LIMITS, MOST_PORT
from dva_sim.console.wire.kinds import hints_of, words_of

STATIC: Final = Path(__file__).parent.parent / "static"
GRACE: Final = 5.0  # the web process has answered before a page gives up [s]
_PLACES: Final = {
    ActionPlace.WORLD: "world",
    ActionPlace.ATTACHED: "attached",
    ActionPlace.ROBOT: "robot alone",
    ActionPlace.REPLAY: "recording",
}


def javascript() -> str:
    """Constants of the pages."""
    patience = {
        name: round(1000 * (one.patience + GRACE))
        for name, one in ACTIONS.items()
        if one.has_answer
    }
    parts = {
        "PATIENCE_MS": patience,
        "FASTEST": FASTEST,
        "MOST_PORT": MOST_PORT,
        "MOST_PROCESSING_S": LINK_LIMITS["processing_s"][1],
    }
    head = "// Written by dva_sim/console/wire/generated.py.\n"
    return head + "".join(
        f"export const {name} = {json.dumps(value, indent=1)};\n" for name, value in parts.items()
    )


FILES: Final = {"js/declared.js": javascript}


def table() -> str:
    """The actions for `docs/console.md`."""
    head = "| action | | arguments | needs | where | audit log |\n|---|---|---|---|---|---|\n"
    return head + "".join(map(_row, ACTIONS.values()))


def _row(action: Action) -> str:
    needed = action.arguments.__required_keys__  # type: ignore[attr-defined]
    arguments = (
        f"`{name}`{'' if name in needed else '?'}: {words_of(hint)}"
        for name, hint in hints_of(action.arguments).items()
    )
    places = ", ".join(word for place, word in _PLACES.items() if place in action.at)
    kept = {Audit.OWN: "yes", Audit.DVA: "the DVA's row"}
    audit = f"no: {action.audit}" if isinstance(action.audit, str) else kept[action.audit]
    cells = (
        *(f"`{action.name}`", action.does, "; ".join(arguments)),
        *(action.role.name.lower(), places, audit),
    )
    return f"| {' | '.join(cells)} |\n"


def write(folder: Path = STATIC) -> None:
    """Write the files of the pages."""
    for name, text in FILES.items():
        (folder / name).write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    write()
    print(table(), end="")
