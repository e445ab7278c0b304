"""Links on the pages lead to files and to headings, and files named on the map are there."""

import re

import generators
import pytest
from generators.protocol import SPECIFICATION
from helpers.paths import ROOT

GENERATED = {ROOT / "docs" / path for path in generators.paths()}
FOUND = [
    *ROOT.glob("*.md"),
    *ROOT.glob("docs/**/*.md"),
    *ROOT.glob("*/*.md"),
    *ROOT.glob("*/*/*.md"),
]
PAGES = sorted(
    page
    for page in {*FOUND} - GENERATED
    if page.relative_to(ROOT).parts[0] not in ("build", "results")
    and not page.relative_to(ROOT).parts[0].startswith(".")
)


def headings(page):
    """Anchors of a page: of its headings, as GitHub and the site make them, and explicit ones."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    plain = [re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles]
    return {*plain, *re.findall(r"^\(([\w-]+)\)=$", text, re.MULTILINE)}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_link_leads_to_a_file_and_to_a_heading(page):
    links = re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]+))?[^)]*\)", page.read_text(encoding="utf-8"))
    broken = []
    for link, place in links:
        if "://" in link or link.startswith("mailto:"):
            continue
        target = (page.parent / link).resolve() if link else page
        if target in GENERATED:
            continue  # the build of the site looks at these
        if not target.exists() or (
            place and target.suffix == ".md" and place not in headings(target)
        ):
            broken.append(f"{link}#{place}" if place else link)
    assert broken == []


def test_the_specification_is_the_one_that_the_site_shows():
    shown = generators.PAGES["reference/protocol.md"]()
    assert headings(SPECIFICATION) > {"sessions", "keys", "a-client"}
    assert shown.count("\n## ") == SPECIFICATION.read_text(encoding="utf-8").count("\n## ")


def test_every_module_that_the_map_names_is_there():
    text = (ROOT / "docs/explanation/architecture.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:dva_sim/)?[a-z_/]+(?:\.py|/))`", text)
    rooms = [ROOT, ROOT / "dva_sim", ROOT / "dva_sim/experiments"]
    assert len(named) > 50
    assert [name for name in named if not any((room / name).exists() for room in rooms)] == []
