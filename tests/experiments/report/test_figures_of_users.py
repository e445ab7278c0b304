import shutil
from pathlib import Path

import pytest
from helpers.studies import small_study, synthetic_results
from helpers.studies.report_text import blank_pictures, words, words_of
from helpers.wording import unnamed

import dva_sim
from dva_sim.cli import call
from dva_sim.experiments.report.figures.registry import load_figures
from dva_sim.experiments.report.report import write_report
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.errors import ConfigError

RISK = Path("experiments/figures/risk.py")
MINE = """
from dva_sim.experiments.report.figures import Numbers, ReportFigure, panels

class Mine(ReportFigure):
    name = "mine"
    title = "Mine"
    def draw(self, view, reading):
        figure, _ = panels(1, 1, 1.0)
        return self.finish(figure, "An empty frame.", Numbers())

class Broken(Mine):
    name = "broken"
    def draw(self, view, reading):
        return self.nowhere

class Named(Mine):
    name = "Answer 1"

class Answer(Mine):
    name = "answer"

class Untitled(Mine):
    title = ""
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    rows = [r for r in synthetic_results.drive_rows(2, 1) if r["profile"] == "default"]
    facts = synthetic_results.manifest(2, 1)
    facts["study"]["factors"] |= {"profile": ["default"]}
    tables = {"runs": [r for r in rows if r["link.delay_s"] in (0.0, 1.0)]}
    folder = synthetic_results.write(tmp_path_factory.mktemp("of") / "results", tables, facts)
    (folder.parent / "mine.py").write_text(MINE, encoding="utf-8")
    return folder


def mine(results, *names):
    return load_figures([f"mine.py:{name}" for name in names], results.parent)


@pytest.mark.system
def test_a_figure_of_a_user_comes_last_and_is_gone_where_nobody_names_it(results):
    assert "An empty frame." in words_of(results, figures=mine(results, "Mine"))
    page = (results / "report.html").read_text("utf-8").splitlines()
    assert 'id="mine"' in [line for line in page if '<figure id="' in line][-1]
    assert {p.suffix for p in (results / "figures").glob("mine.*")} == {".svg", ".png", ".csv"}
    assert "An empty frame." not in words_of(results)
    assert not list((results / "figures").glob("mine.*"))


def test_one_that_fails_is_left_out_and_told_of_on_the_page_and_as_an_error(results):
    with (
        blank_pictures(),
        pytest.raises(ConfigError, match=r"figure 'broken'.*: AttributeError.*made"),
    ):
        write_report(results, figures=mine(results, "Broken", "Mine"))
    text = words(results / "report.html")
    assert unnamed(text, "Figure 'broken'", "AttributeError", "An empty frame.") == []


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["Named"], "'Answer 1'; should be small letters"),
        (["Answer"], "'answer' is drawn already"),
        (["Mine", "Mine"], "'mine' is drawn already"),
        (["Untitled"], "has no title"),
        (["Nowhere"], "no class 'Nowhere'"),
    ],
)
def test_one_that_cannot_be_used_is_refused_in_a_line(results, names, expected):
    with pytest.raises(ConfigError, match=expected):
        mine(results, *names)


@pytest.mark.system
def test_a_command_draws_those_that_it_names(results, monkeypatch):
    monkeypatch.chdir(results.parent)
    page = results / "report.html"
    ways = (
        lambda: call(["report", str(results), "--figure", "mine.py:Mine"]),
        lambda: dva_sim.report(results, figure="mine.py:Mine"),
    )
    for way in ways:
        page.unlink(missing_ok=True)
        with blank_pictures():
            way()
        assert "An empty frame." in words(page)


def test_figures_are_no_part_of_what_a_study_asks(tmp_path):
    plain = small_study.study_in(tmp_path)
    with_one = load_study(plain.file, ["figures=[risk.py:Risk]"])
    assert with_one.figures == ("risk.py:Risk",)
    assert with_one.asked() == plain.asked()


def test_a_study_that_names_a_figure_that_there_is_none_of_fails_before_it_runs(tmp_path):
    study = small_study.study_in(tmp_path)
    with pytest.raises(ConfigError, match=r"file .nowhere\.py. not found"):
        dva_sim.run(study.file, tmp_path / "out", set={"figures": ["nowhere.py:Mine"]})
    assert not (tmp_path / "out" / "report.html").exists()


def test_the_worked_example_is_drawn_of_a_study(results):
    assert RISK.is_file()
    text = words_of(results, figures=load_figures(["risk.py:Risk"]))
    assert "How often" in text
    shutil.rmtree(results / "figures")
