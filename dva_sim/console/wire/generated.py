"""Parts of the pages that are generated from the declarations.

    python -m dva_sim.console.wire.generated

writes `static/js/declared.js` (how long an answer is waited for, and limits), `static/js/lines.js`
(the types of all lines sent to pages).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from textwrap import wrap
from typing import Any, Final, Literal, NotRequired, get_args, get_origin, get_type_hints

from typing_extensions import is_typeddict

from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.arguments import FASTEST, LINK_LIMITS, MAX_PORT
from dva_sim.console.wire.audit_answers import AuditCheck, AuditMeasures
from dva_sim.console.wire.lines import ToPage
from dva_sim.recordings.audit_log import AuditRow

STATIC: Final = Path(__file__).parent.parent / "static"
GRACE: Final = 5.0  # the web process has answered before a page gives up [s]


def javascript() -> str:
    """Return constants of the pages."""
    patience = {
        name: round(1000 * (one.patience + GRACE))
        for name, one in ACTIONS.items()
        if one.has_answer
    }
    parts = {
        "PATIENCE_MS": patience,
        "FASTEST": FASTEST,
        "MAX_PORT": MAX_PORT,
        "MAX_PROCESSING_S": LINK_LIMITS["processing_s"][1],
    }
    head = "// Written by dva_sim/console/wire/generated.py.\n"
    return head + "".join(
        f"export const {name} = {json.dumps(value, indent=1)};\n" for name, value in parts.items()
    )


def line_types() -> str:
    """Return types of all lines sent to pages, of audit log replies, and of their parts."""
    declarations: dict[type, str] = {}
    for one in (*get_args(ToPage), AuditRow, AuditCheck, AuditMeasures):
        _declare(one, declarations)
    text = " | ".join(map(name_of, get_args(ToPage)))
    union = _typedef("A line sent to a page.", f"({text}) & {{s?: number}}", "ToPage")
    head = "// Written by dva_sim/console/wire/generated.py.\n"
    return head + "".join((*declarations.values(), union)) + "export {};\n"


def name_of(declared: type) -> str:
    """Return the pages' name for a declared type."""
    return declared.__name__.removesuffix("Line").removesuffix("Shown")


def _declare(declared: type, declarations: dict[type, str]) -> None:
    """Add a type behind all that it is made of."""
    if declared in declarations:
        return
    hints = get_type_hints(declared, include_extras=True)
    required = getattr(declared, "__required_keys__", hints)  # a dataclass has all
    fields = []
    for name, hint in hints.items():
        optional = name not in required
        inner = get_args(hint)[0] if get_origin(hint) is NotRequired else hint
        fields.append(f"{name}{'?' if optional else ''}: {_in_javascript(inner, declarations)}")
    about = (declared.__doc__ or "").strip().split("\n")[0]
    about = "" if about.startswith("dict(") else about  # which its own docstring is
    declarations[declared] = _typedef(about, f"{{{', '.join(fields)}}}", name_of(declared))


def _typedef(about: str, type_: str, name: str) -> str:
    text = f"@typedef {{{type_}}} {name}".replace(": ", ":~")  # a key and its type stay together
    wrapped = wrap(text, 96, subsequent_indent="  ", break_on_hyphens=False)
    lines = [*([about] if about else []), *(line.replace(":~", ": ") for line in wrapped)]
    return "/**\n" + "".join(f" * {line}\n" for line in lines) + " */\n"


_PLAIN: Final = {int: "number", float: "number", str: "string", bool: "boolean", Any: "any"}


def _in_javascript(hint: Any, declarations: dict[type, str]) -> str:
    """Return a type as pages write it."""
    if hint in _PLAIN:
        return _PLAIN[hint]
    if hint in (None, type(None)):
        return "null"
    if is_typeddict(hint):
        _declare(hint, declarations)
        return name_of(hint)
    inner = get_args(hint)
    if get_origin(hint) is Literal:
        return " | ".join(f"'{one}'" for one in inner)
    if get_origin(hint) in (dict, Mapping):
        return f"Record<string, {_in_javascript(inner[1], declarations)}>"
    if get_origin(hint) is list:
        of = _in_javascript(inner[0], declarations)
        return f"({of})[]" if " | " in of else f"{of}[]"
    return " | ".join(_in_javascript(one, declarations) for one in inner)


FILES: Final = {"js/declared.js": javascript, "js/lines.js": line_types}


def write(folder: Path = STATIC) -> None:
    """Write the files of the pages."""
    for name, text in FILES.items():
        (folder / name).write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    write()
