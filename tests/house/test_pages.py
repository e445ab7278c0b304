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


def tables(text):
    """Tables of a text: for each the number of cells of each of its lines."""
    lines = [line.strip() for line in re.sub(r"```.*?```", "", text, flags=re.DOTALL).splitlines()]
    found = [[]]
    for line in lines:
        if line.startswith("|"):
            found[-1].append(len(re.findall(r"(?<!\\)\|", line)) - 1)
        elif found[-1]:
            found.append([])
    return [table for table in found if table]


@pytest.mark.parametrize(
    ("text", "counts"),
    [("| a | b |\n|---|---|\n| 1 | 2 |", [[2, 2, 2]]), ("| a |\n|---|\n| `x|` |", [[1, 1, 2]])],
)
def test_a_pipe_within_a_cell_counts_as_a_cell(text, counts):
    assert tables(text) == counts


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_line_of_a_table_has_as_many_cells_as_its_head(page):
    found = tables(page.read_text(encoding="utf-8"))
    assert [table for table in found if len(set(table)) > 1] == []


def test_every_generated_table_is_whole():
    broken = [
        path
        for path, text in generators.all_pages()
        if any(len(set(table)) > 1 for table in tables(text))
    ]
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
