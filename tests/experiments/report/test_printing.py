"""A report as PDF: the page as a browser prints it, the same bytes each time."""

import re

import pytest
from helpers.processes.command_line import ended
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.report import printing
from dva_sim.experiments.report.blocks import First, Folded, Verbatim, Words
from dva_sim.experiments.report.figures.registry import draw_all
from dva_sim.experiments.report.printing import browser, print_page
from dva_sim.experiments.report.report import _page, blocks_of, write_report


@pytest.fixture
def results(tmp_path):
    """Results of which no run was completed."""
    facts = synthetic_results.manifest(2, 1, failures=[{"error": "no site"}])
    return synthetic_results.write(tmp_path / "r", {}, facts)


def prints(test):
    """Mark a test that starts a browser."""
    return pytest.mark.system(pytest.mark.skipif(not browser(), reason="no Chromium")(test))


def test_without_a_browser_one_line_says_how_to_print_the_page_which_is_made(results, monkeypatch):
    monkeypatch.setattr(printing, "BROWSERS", ("no-such-browser",))
    code, _, errors = ended("report", results, "--pdf")
    (line,) = errors.splitlines()
    assert code == 2
    assert unnamed(line, "Chromium", "Chrome", str(results / "report.html"), "print") == []
    assert (results / "report.html").exists()
    assert not (results / "report.pdf").exists()


def test_a_browser_that_prints_nothing_is_named_with_what_it_said(results, monkeypatch, tmp_path):
    program = tmp_path / "chromium"
    program.write_text("#!/bin/sh\necho no display >&2\nexit 3\n")
    program.chmod(0o700)
    monkeypatch.setattr(printing, "BROWSERS", (str(program),))
    with pytest.raises(printing.DvaSimError) as error:
        write_report(results, pdf=True)
    assert unnamed(str(error.value), str(program), "no display") == []


@prints
def test_a_pdf_is_made_when_asked_for_and_kept_up_to_date_to_the_byte(results):
    write_report(results)
    assert not (results / "report.pdf").exists()
    write_report(results, pdf=True)
    made = (results / "report.pdf").read_bytes()
    (results / "report.pdf").write_bytes(b"old")
    write_report(results)
    assert (results / "report.pdf").read_bytes() == made
    assert set(re.findall(rb"Date \(D:(\d+)", made)) == {b"20000101000000"}


@prints
def test_what_is_folded_on_the_page_is_printed(tmp_path):
    text = "\n".join(f"line {n}" for n in range(1500))
    assert pages_of(tmp_path, [Words("Asked and run."), Folded("Manifest", (Verbatim(text),))]) > 2


def pages_of(folder, blocks):
    page, pdf = folder / "page.html", folder / "page.pdf"
    page.write_text(_page("What does it cost to wait for each reply?", blocks), encoding="utf-8")
    print_page(page, pdf)
    return len(re.findall(rb"/Type /Page\b", pdf.read_bytes()))


@prints
def test_the_answer_with_its_figure_and_conditions_is_one_page_of_its_own(tmp_path):
    claims = {"robustness": synthetic_results.CLAIMS["robustness"]}
    facts = synthetic_results.manifest(6, 2)
    facts["study"] |= claims
    facts["scenarios"] = dict.fromkeys(("drive", "story"), synthetic_results.SCENARIO)
    rows = synthetic_results.drive_rows(6, 2, effect_s=20.0)
    repeats = synthetic_results.repeat_rows({("pursuit", 0): 5, ("adaptive", 1): -4})
    reading = synthetic_results.reading(tmp_path / "r", rows, facts, robustness=repeats)
    blocks = blocks_of(reading, draw_all(reading))
    (place,) = (n for n, block in enumerate(blocks) if isinstance(block, First))
    first = blocks[: place + 1]
    assert blocks[place].figure is not None
    assert len(blocks[place].depends) >= 3
    warned = [Words("A warning that takes two lines of the page, as warnings do. " * 2, "warning")]
    assert pages_of(tmp_path, warned * 3 + first) == 1
    assert pages_of(tmp_path, [*first, Words("Evidence.")]) == 2
