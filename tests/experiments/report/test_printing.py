"""A report as PDF: the page as a browser prints it, the same bytes each time."""

import re

import pytest
from helpers.processes.command_line import ended
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.report import printing
from dva_sim.experiments.report.blocks import Folded, Verbatim, Words
from dva_sim.experiments.report.printing import browser, print_page
from dva_sim.experiments.report.report import _page, write_report


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
    blocks = [Words("Asked and run."), Folded("Manifest", (Verbatim(text),))]
    page, pdf = tmp_path / "page.html", tmp_path / "page.pdf"
    page.write_text(_page("What does it cost?", blocks), encoding="utf-8")
    print_page(page, pdf)
    assert len(re.findall(rb"/Type /Page\b", pdf.read_bytes())) > 2
