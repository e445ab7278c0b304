"""Prompt display of results: fits a screen, and names the available queries."""

import pytest
from helpers.studies.small_study import cheap, run_study, study_in
from helpers.wording import unnamed

import dva_sim

LINES, CHARACTERS = 8, 800  # a screen of 80 x 24 has room for more than twice as many


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    run_study(study_in(folder), folder / "out", jobs=1, episode=lambda job: with_much(cheap(job)))
    return dva_sim.load(folder / "out")


def with_much(tables):
    """A row as wide as those of real runs."""
    row = {f"column_{number}": number for number in range(80)}
    return {"runs": [{**tables["runs"][0], **row}]}


@pytest.mark.parametrize(
    ("of", "expected"),
    [
        (lambda r: r, "42 runs in 9 configurations\nWhich is quicker?"),
        (lambda r: r.answer, "REQ/REP"),
        (lambda r: r.runs, "Frame of 42 rows"),
        (lambda r: r.reading, "Reading of"),
        (lambda r: dva_sim.compare(r, r), "8 cells in both"),
        (lambda r: dva_sim.compare(r, r).frame(), "Frame of 8 rows"),
        (
            lambda r: dva_sim.compare(r, r).judge("max(contacts) > 9")[0],
            "passed: max(contacts) > 9",
        ),
    ],
)
def test_results_and_what_comes_of_them_fit_a_screen(results, of, expected):
    shown = repr(of(results))
    assert expected in shown
    assert len(shown) <= CHARACTERS
    assert len(shown.splitlines()) <= LINES


def test_an_episode_tells_its_first_measures_its_tables_and_what_is_not_by_default():
    episode = dva_sim.episode("drive-to-event", set={"horizon_s": 2})
    shown = repr(episode)
    first, measures, *_, tables = shown.splitlines()
    assert unnamed(first, "Episode", "full", "seed 1") == []
    assert unnamed(measures, "measures: ", "confirmed no, ") == []
    assert unnamed(tables, "tables: ", "runs (1)", "events (1)") == []
    configured = repr(episode.scenario)
    assert unnamed(configured, "horizon_s=2", "camera") == ["camera"]
    assert max(len(shown), len(configured)) <= CHARACTERS
