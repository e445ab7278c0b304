"""The documentation as a whole: its build, its links, and the commands that its pages show."""

import re
import shlex
import subprocess
import sys

import generators
import pytest
from helpers.paths import ROOT
from typer.main import get_command

from dva_sim.cli.program import app, call

DOCS = ROOT / "docs"
WRITTEN = [
    path
    for path in (*DOCS.rglob("*.md"), *ROOT.glob("[apw]*/README.md"), *ROOT.glob("*/*/README.md"))
    if not (path.is_relative_to(DOCS) and str(path.relative_to(DOCS)) in generators.paths())
]
"""Pages that people have written."""


def calls_on(path):
    """Calls of the program on a page: lines of blocks, and inline code."""
    text = path.read_text(encoding="utf-8").replace("\\\n", "")
    blocks = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    lines = [line.removeprefix("$ ") for block in blocks for line in block.splitlines()]
    inline = re.findall(r"`(dva-sim [^`]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    found = [line for line in (*lines, *inline) if line.startswith("dva-sim ")]
    return [" ".join(line.partition(" #")[0].split()) for line in found]


CALLS = sorted({call_ for path in WRITTEN for call_ in calls_on(path)})


@pytest.mark.parametrize("words", CALLS)
def test_every_call_on_a_page_is_one_that_the_program_knows(words):
    """Names in capitals stand for something; options have to be right."""
    command, path = get_command(app), []
    given = re.split(r"[|>&;'\"]", words)[0].split()[1:]
    while given and hasattr(command, "get_command"):
        found = command.get_command(type(command).context_class(command), given[0])
        assert found is not None, f"no command {given[0]!r}"
        command, path = found, [*path, given.pop(0)]
    known = {option for param in command.params for option in (*param.opts, *param.secondary_opts)}
    options = [word.partition("=")[0] for word in given if word.startswith("-") and word != "-"]
    assert [option for option in options if option not in known | {"--help", "-h"}] == []


def test_the_commands_of_the_page_on_worlds_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    calls = calls_on(ROOT / "worlds/README.md")
    assert len(calls) == 3
    for words in calls:
        assert call(shlex.split(words)[1:]) == 0, words
    assert (tmp_path / "campus.png").exists()
    assert (tmp_path / "mine/office-block.geojson").exists()


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The documentation as web pages, built by a program of its own."""
    pytest.importorskip("sphinx", reason="the documentation is built by Sphinx: make docs")
    out = tmp_path_factory.mktemp("site")
    words = ["-m", "sphinx", "--fail-on-warning", "--quiet", "--fresh-env", str(DOCS), str(out)]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return out


@pytest.mark.system
def test_every_page_is_built_and_found(site):
    pages = [*generators.paths(), *(str(p.relative_to(DOCS)) for p in DOCS.glob("*/*.md"))]
    missing = [page for page in pages if not (site / page).with_suffix(".html").exists()]
    assert missing == []
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    assert [word for word in ("setteleop", "watchdog", "servrobot") if word not in index] == []


@pytest.mark.system
def test_the_site_loads_nothing_from_elsewhere(site):
    loads = re.compile(r'<(?:script|img|link|iframe)[^>]+(?:src|href)="(?:https?:)?//', re.I)
    styles = re.compile(r"(?:@import|url\()\s*['\"]?(?:https?:)?//", re.I)
    pages, sheets = list(site.rglob("*.html")), list(site.rglob("*.css"))
    assert len(pages) > 40
    assert [p.name for p in pages if loads.search(p.read_text(encoding="utf-8"))] == []
    assert [s.name for s in sheets if styles.search(s.read_text(encoding="utf-8"))] == []


@pytest.mark.system
def test_links_lead_to_pages_and_to_places_on_them(site):
    texts = {page: page.read_text(encoding="utf-8") for page in site.rglob("*.html")}
    ids = {page: set(re.findall(r'\bid="([^"]+)"', text)) for page, text in texts.items()}
    broken = []
    for page, text in texts.items():
        for link in re.findall(r'<a [^>]*href="([^"]+)"', text):
            target, _, place = link.partition("#")
            if re.match(r"[a-z]+:", link) or target.startswith("/"):
                continue
            file = (page.parent / target).resolve() if target else page
            stays_above = page.parent != file.parent and target.endswith("reference/index.html")
            if place and stays_above:
                broken.append(f"{page.relative_to(site)}: {link} is not the page of it")
            if not file.exists() or (place and file in ids and place not in ids[file]):
                broken.append(f"{page.relative_to(site)}: {link}")
    assert broken == []


def places_on(page):
    """Places that a link can lead to on a page as a file: its headings."""
    heads = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}


def test_links_of_pages_as_files_lead_to_what_is_there_without_a_build():
    broken, count = [], 0
    for page in [*WRITTEN, *ROOT.glob("*.md")]:
        text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
        for link in re.findall(r'\]\(([^)\s]+)(?:\s+"[^"]*")?\)', text):
            target, _, place = link.partition("#")
            if re.match(r"[a-z]+:", link):
                continue
            count += 1
            file = (page.parent / target).resolve() if target else page
            is_made = (
                file.is_relative_to(DOCS) and str(file.relative_to(DOCS)) in generators.paths()
            )
            if is_made or not file.exists() or (place and place not in places_on(file)):
                broken.append(f"{page.relative_to(ROOT)}: {link}")
    assert broken == []
    assert count > 100


def test_every_make_verb_and_script_on_a_page_is_there():
    verbs = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    texts = [path.read_text(encoding="utf-8") for path in WRITTEN]
    asked = {verb for text in texts for verb in re.findall(r"`make ([a-z-]+)", text)}
    scripts = {file for text in texts for file in re.findall(r"bin/python ([\w/]+\.py)", text)}
    assert len(asked) > 3
    assert asked - verbs == set()
    assert [file for file in scripts if not (ROOT / file).exists()] == []
