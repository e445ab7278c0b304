"""Sentences of a report from templates that read as text: captions, notes, how it was made."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

from dva_sim.kernel.wording import capital, number, percent, quantity

if TYPE_CHECKING:
    import jinja2


def caption(name: str, **facts: Any) -> str:
    """Render a macro of `captions.txt.j2`: a line that is shown, and one that is folded away."""
    text = str(getattr(_template("captions").module, name)(**facts))
    shown, _, folded = text.strip().partition("\n\n")
    return "\n".join(filter(None, map(_in_a_line, (shown, folded))))


def note(name: str, **facts: Any) -> str:
    """Render a macro of `notes.txt.j2`."""
    return _in_a_line(str(getattr(_template("notes").module, name)(**facts)))


def paragraphs(name: str, **facts: Any) -> list[str]:
    """Render a template to paragraphs, one line each."""
    found = _template(name).render(facts).split("\n\n")
    return [line for text in found if (line := _in_a_line(text))]


def _in_a_line(text: str) -> str:
    """Without the breaks of lines, which say nothing; a space that does not break stays."""
    return re.sub(r"[ \n]+", " ", text).strip(" ")


@cache
def _template(name: str) -> jinja2.Template:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dva_sim.experiments.report"),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {f.__name__: f for f in (capital, number, percent, quantity)}
    return environment.get_template(f"{name}.txt.j2")
