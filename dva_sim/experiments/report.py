"""One page that answers a study: self-contained, and the same bytes whenever it is made again."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dva_sim.errors import DvaSimError
from dva_sim.experiments.blocks import Block, Heading, texts_of
from dva_sim.experiments.dispatch import figures as dispatch_figures
from dva_sim.experiments.effects import View
from dva_sim.experiments.figures import Drawn, draw_all
from dva_sim.experiments.figures.contrast import contrast
from dva_sim.experiments.figures.style import styled
from dva_sim.experiments.glossary import Marker, terms_in
from dva_sim.experiments.sections import blocks_of
from dva_sim.experiments.summary import Reading
from dva_sim.experiments.transports import figures as transport_figures
from dva_sim.experiments.unfinished import load_so_far

if TYPE_CHECKING:
    import jinja2
    from markupsafe import Markup

PAGE, PAPER, FIGURES = "report.html", "report.pdf", "figures"


def write_report(folder: Path, pdf: bool = False) -> Path:
    """Make `report.html` and `figures/` from what lies in a results folder.

    Of a study that is not finished, the page says what is known so far.

    Args:
        folder: Of the results.
        pdf: Make `report.pdf` too. One that is there already is made again in any case, so that
            it never says something else than the page.

    Raises:
        ConfigError: the folder holds no results.
        DvaSimError: the disk is full or refuses to be written.
    """
    reading = Reading(load_so_far(folder))
    drawn = _draw(reading)
    blocks = blocks_of(reading, drawn)
    question = str(reading.study.get("question", "A study without a question"))
    page = folder / PAGE
    try:
        _write_figures(folder / FIGURES, drawn)
        page.write_text(_page(question, blocks), encoding="utf-8", newline="\n")
        if pdf or (folder / PAPER).exists():
            from dva_sim.experiments.paper import write_pdf

            write_pdf(folder / PAPER, question, blocks)
    except OSError as error:
        page.unlink(missing_ok=True)  # half a page would pass for a whole one
        raise DvaSimError(
            f"the report cannot be written in {folder}: {error.strerror}; "
            f"mend that, then 'dva-sim report {folder}' makes it"
        ) from None
    return page


def _draw(reading: Reading) -> list[Drawn]:
    """All figures, first the one that answers."""
    if reading.view is None:
        return []
    return [*_answering(reading), *_others(reading, reading.view)]


def _answering(reading: Reading) -> list[Drawn]:
    view, finding = reading.view, reading.told
    if view is None or view.contrast is None or finding is None:
        return []
    with styled():
        drawn = contrast(finding, view.difference(view.panels[0], *view.contrast))
    return [drawn] if drawn is not None else []


def _others(reading: Reading, view: View) -> list[Drawn]:
    if reading.shifts is not None:
        return dispatch_figures.draw_all(reading.shifts)
    if reading.is_contest:
        return transport_figures.draw_all(view)
    return draw_all(reading)


def _write_figures(folder: Path, drawn: Sequence[Drawn]) -> None:
    """Each figure as vectors, as pixels, and as the numbers behind it; none of an older report."""
    folder.mkdir(exist_ok=True)
    made = {
        f"{figure.name}.{ending}": content
        for figure in drawn
        for ending, content in (("svg", figure.svg), ("png", figure.png), ("csv", figure.csv))
        if content
    }
    for stale in folder.iterdir():
        if stale.suffix in (".svg", ".png", ".csv") and stale.name not in made:
            stale.unlink()
    for name, content in made.items():
        (folder / name).write_bytes(content)


def _page(question: str, blocks: Sequence[Block]) -> str:
    """Fill the template."""
    sections = [block.text for block in blocks if isinstance(block, Heading) and block.level == 2]
    marker = Marker(terms_in(texts_of(blocks)))
    return _template(marker).render(question=question, blocks=blocks, sections=sections)


def _template(marker: Marker) -> jinja2.Template:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dva_sim.experiments"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {
        "data_uri": _data_uri,
        "explained": lambda text: _explained(text, marker),
        "kind": lambda block: type(block).__name__,
        "key": _key,
    }
    return environment.get_template("report.html.j2")


def _explained(text: str, marker: Marker) -> Markup:
    """With a link from each word that is said for the first time to what it means."""
    from markupsafe import Markup

    link = Markup('<dfn><a href="#{}" title="{}">{}</a></dfn>')
    pieces = [
        link.format(term.key, f"{term.means}.", piece) if term else Markup.escape(piece)
        for piece, term in marker.split(text)
    ]
    return Markup("").join(pieces)


def _key(text: str) -> str:
    """A heading as an identifier."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def _data_uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
