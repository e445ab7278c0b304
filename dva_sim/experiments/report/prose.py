"""Sentences of a report from templates that read as text: captions, notes, how it was made."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

from dva_sim.kernel.wording import capital, listing, number, percent, quantity, signed

if TYPE_CHECKING:
    import jinja2


def caption(name: str, **facts: Any) -> str:
    """Render a section of `captions.txt.j2`: a line that is shown, and one that is folded away."""
    visible, _, folded = _sections("captions")[name].partition("\n\n")
    return "\n".join(filter(None, (_rendered(text, facts) for text in (visible, folded))))


def note(name: str, **facts: Any) -> str:
    """Render a section of `notes.txt.j2`."""
    return _rendered(_sections("notes")[name], facts)


def sentence(name: str, **facts: Any) -> str:
    """Render a section of `sentences.txt.j2`: the answer and its conditions."""
    return _rendered(_sections("sentences")[name], facts)


def paragraphs(name: str, **facts: Any) -> list[str]:
    """Render a template to paragraphs, one line each."""
    template = _environment(trim=True).get_template(f"{name}.txt.j2")
    texts = template.render(facts).split("\n\n")  # empty lines part paragraphs
    return [line for text in texts if (line := _in_a_line(text))]


def _in_a_line(text: str) -> str:
    """Return text without line breaks, which say nothing; a space that does not break stays."""
    return re.sub(r"[ \n]+", " ", text).strip(" ")


def _rendered(text: str, facts: dict[str, Any]) -> str:
    return _in_a_line(_compiled(text).render(facts))


@cache
def _compiled(text: str) -> jinja2.Template:
    return _environment().from_string(text)


_HEAD = re.compile(r"^== (\w+) ==\n", re.MULTILINE)


@cache
def _sections(name: str) -> dict[str, str]:
    """Return the texts of a template by the names above them."""
    environment = _environment()
    assert environment.loader is not None
    source, _, _ = environment.loader.get_source(environment, f"{name}.txt.j2")
    _, *parts = _HEAD.split(source)
    return {head: text.strip() for head, text in zip(parts[::2], parts[1::2], strict=True)}


@cache
def _environment(trim: bool = False) -> jinja2.Environment:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dva_sim.experiments.report"),
        trim_blocks=trim,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    filters = (capital, listing, number, percent, quantity, signed)
    environment.filters |= {f.__name__: f for f in filters}
    return environment
