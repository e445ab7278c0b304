"""Links on the pages lead somewhere, and files named on the map are there."""

import re

import pytest
from helpers.paths import ROOT

PAGES = sorted(
    [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("*/*.md"), *ROOT.glob("*/*/*.md")]
)
PAGES = [
    page for page in dict.fromkeys(PAGES) if not page.relative_to(ROOT).parts[0].startswith(".")
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_link_leads_to_a_file(page):
    links = re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8"))
    local = [link for link in links if "://" not in link and not link.startswith("mailto:")]
    assert [link for link in local if not (page.parent / link).exists()] == []


def test_every_module_that_the_map_names_is_there():
    text = (ROOT / "docs/ARCHITECTURE.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:dva_sim/)?[a-z_/]+(?:\.py|/))`", text)
    rooms = [ROOT, ROOT / "dva_sim", ROOT / "dva_sim/experiments"]
    assert len(named) > 50
    assert [name for name in named if not any((room / name).exists() for room in rooms)] == []
