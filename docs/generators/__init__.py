"""Pages that are written from the code and from kept results before each build."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from generators import (
    assumptions,
    catalogue,
    command_line,
    configuration,
    console,
    correspondences,
    evidence,
    exit_codes,
    glossary,
    json_output,
    measures,
    messages,
    plan_features,
    plugins,
    protocol,
    python_api,
    recordings,
    results,
    samples,
)

PAGES: dict[str, Callable[[], str]] = {
    "reference/command-line.md": command_line.page,
    "reference/python.md": python_api.page,
    "reference/scenario-keys.md": configuration.scenario_page,
    "reference/study-keys.md": configuration.study_page,
    "reference/profile-keys.md": configuration.profile_page,
    "reference/measures.md": measures.page,
    "reference/plugins.md": plugins.page,
    "reference/catalogue.md": catalogue.page,
    "reference/assumptions.md": assumptions.page,
    "reference/exit-codes.md": exit_codes.page,
    "reference/plan-features.md": plan_features.page,
    "reference/json-output.md": json_output.page,
    "reference/recordings.md": recordings.page,
    "reference/console.md": console.page,
    "reference/protocol.md": protocol.page,
    "reference/messages.md": messages.page,
    "reference/correspondences.md": correspondences.page,
    "reference/samples.md": samples.page,
    "reference/glossary.md": glossary.page,
    "explanation/evidence.md": evidence.page,
}
"""Pages by their path below docs, each with the function that returns its Markdown."""


def all_pages() -> Iterator[tuple[str, str]]:
    """Yield the path and the text of every generated page."""
    for path, page in PAGES.items():
        yield path, page()
    yield from results.pages()


def paths() -> list[str]:
    """Return the paths of all generated pages, without writing them."""
    return [*PAGES, *results.paths()]


def write(docs: Path) -> None:
    """Write every page and picture that has changed, and remove pages of studies that are gone."""
    for file in (docs / "results").glob("*.md"):
        if str(file.relative_to(docs)) not in paths():
            file.unlink()
    for path, text in all_pages():
        file = docs / path
        file.parent.mkdir(exist_ok=True)
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")
    picture = docs / evidence.PICTURE
    drawn = evidence.picture()
    if not picture.exists() or picture.read_bytes() != drawn:
        picture.write_bytes(drawn)
