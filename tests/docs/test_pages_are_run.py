"""Commands and code of tutorials and guides work in an empty folder and print what is shown."""

import re

import pytest
from helpers import page_runs
from helpers.network.emulated_link import need_link
from helpers.paths import ROOT

PAGES = [*page_runs.pages("tutorials"), *page_runs.pages("how-to")]
LENGTH = {"tutorials": (700, 1200), "how-to": (100, 550)}  # words


OVER_A_LINK = ("bad-link", "own-transport")  # real packets: Linux, and the rights to make networks


WHOLE_STUDIES = ("first-answer", "own-study", "own-policy")


@pytest.mark.system
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(
            page, id=page.stem, marks=[pytest.mark.soak] if page.stem in WHOLE_STUDIES else []
        )
        for page in PAGES
    ],
)
def test_a_page_does_what_it_says(page, tmp_path):
    if page.stem in OVER_A_LINK:
        need_link()
    printed = page_runs.run(page, tmp_path)
    if page.parent.name == "tutorials":
        report = "".join(path.read_text() for path in tmp_path.glob("*/report.html"))
        assert numbers_in(page) - numbers_in_text(printed + report) == set()


def numbers_in(page):
    """Measured numbers in the sentences and tables of a page: those with a decimal point."""
    text = page.read_text(encoding="utf-8").replace("\n", " ")
    prose = re.sub(r"```.*?```", "", text)
    return numbers_in_text(re.sub(r"<!--.*?-->", "", prose)) - GIVEN


def numbers_in_text(text):
    """Numbers with a decimal point, without sign."""
    return set(re.findall(r"(?<![\d.])\d+\.\d+(?![\d.])", text))


GIVEN = {"0.3"}  # [s] after which a drive ends: a rule of the console


def test_sections_of_the_report_that_the_first_tutorial_names_are_in_its_template():
    page = (ROOT / "docs/tutorials/first-answer.md").read_text(encoding="utf-8")
    named = re.findall(
        r"^\*\*(What this depends on|The answer in numbers|Every configuration)", page, re.M
    )
    templates = ROOT / "dva_sim/experiments/report"
    texts = [p.read_text() for p in templates.rglob("*") if p.suffix in (".j2", ".py", ".yaml")]
    assert len(named) == 3
    assert [name for name in named if not any(name in text for text in texts)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_a_readable_length_and_is_in_the_index(page):
    words = len(page.read_text(encoding="utf-8").split())
    least, most = LENGTH[page.parent.name]
    assert least <= words <= most
    index = (page.parent / "index.md").read_text(encoding="utf-8").splitlines()
    assert page.stem in index


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda page: page.stem)
def test_every_block_says_its_language_and_every_exception_its_reason(page):
    text = page.read_text(encoding="utf-8")
    assert len(re.findall(r"^```", text, re.MULTILINE)) == 2 * len(page_runs.blocks_of(page))
    for block in page_runs.blocks_of(page):
        assert re.fullmatch(r"(parse, \S.*|exit \d+|add \S.*|copy \S+|)", block.order, re.DOTALL)


def test_a_line_that_is_not_printed_is_found():
    printed = "one  two\n3 runs in 5.2 s\nlast"
    assert page_runs.lines_missing("one two\n3 runs in ...\n", printed) == []
    assert page_runs.lines_missing("3 runs in ...\none two", printed) == ["one two"]
    assert page_runs.lines_missing("4 runs in ...", printed) == ["4 runs in ..."]
