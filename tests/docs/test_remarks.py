"""Remarks beside kept answers: they name what there is, and their numbers are measured."""

import csv
import gzip
import re
from collections import defaultdict

import numpy as np
import pytest
from generators import results
from helpers.paths import ROOT
from helpers.wording import unnamed

from dva_sim.experiments.report.kept_answers import read, read_manifest

TRACE = ROOT / "experiments/traces/commands-over-middleware.csv.gz"
WINDOW_S = (5.0, 13.0)
REMARKS = results.remarks()


@pytest.fixture(scope="module")
def runs():
    """Times of applied commands: when each was made and when applied `(n, 2)` [s], by run."""
    found = defaultdict(list)
    with gzip.open(TRACE, "rt", encoding="utf-8") as lines:
        for row in csv.DictReader(lines):
            key = row["middleware"], row["link"], row["person"]
            found[key] += [(row["made_s"], row["arrived_s"])] if row["arrived_s"] else []
    return {key: np.array(times, dtype=float) for key, times in found.items()}


def over(runs, measure, middleware, link):
    """Median of a measure over the runs of a cell."""
    return np.median(
        [measure(run) for (m, at, _), run in runs.items() if (m, at) == (middleware, link)]
    )


def longest_gap(run):
    arrived = np.sort(run[:, 1])
    return np.diff(arrived[(arrived >= WINDOW_S[0]) & (arrived <= WINDOW_S[1])]).max()


def age_in_force(run):
    order = np.argsort(run[:, 1])
    newest, arrived = np.maximum.accumulate(run[order, 0]), run[order, 1]
    at = np.arange(*WINDOW_S, 0.005)
    return np.median(at - newest[np.searchsorted(arrived, at, side="right") - 1])


def numbers(text):
    return re.findall(r"\d+\.\d+", text)


def test_remarks_are_about_hypotheses_and_cells_that_there_are():
    for study, remarked in REMARKS.items():
        answer = read(results.KEPT / f"{study}.json")
        assert set(remarked.get("measured", {})) <= {name for name, _ in answer.hypotheses}
        rows = {row[0] for row in answer.map[1:]} if answer.map else set()
        for row, cells in remarked.get("cells", {}).items():
            assert row in rows
            assert set(cells) <= set(answer.map[0])


def test_an_outage_over_tcp_is_longer_by_what_is_remarked(runs):
    text = REMARKS["middleware"]["measured"]["tcp-stays-out"]
    gaps = [over(runs, longest_gap, name, "outage") for name in ("pub-sub", "udp")]
    assert [float(n) for n in numbers(text)] == pytest.approx(gaps, abs=0.05)
    assert (gaps[0] - gaps[1]) / 2.0 == pytest.approx(0.25, abs=0.02)  # of an outage of 2 s


def test_mqtt_is_as_old_as_is_remarked(runs):
    text = REMARKS["middleware"]["measured"]["mqtt-doubles-the-age"]
    names = "mqtt-0", "mqtt-0-nodelay"
    (late, early), clean = (
        [over(runs, age_in_force, name, link) for name in names] for link in ("lossy", "clean")
    )
    expected = [f"{clean[0]:.2f}", f"{late:.2f}", f"{early:.2f}", f"{late / early:.1f}"]
    assert numbers(text) == expected
    assert abs(clean[0] - clean[1]) < 0.002


def test_runs_without_a_session_are_counted_in_the_table(runs):
    cells = REMARKS["drives-over-middleware"]["cells"]
    empty = defaultdict(int)
    for (middleware, link, _), run in runs.items():
        empty[middleware, link] += not len(run)
    none = {key: count for key, count in empty.items() if count}
    assert cells["Zenoh over UDP"] == {
        "lossy": f"{5 - none['zenoh-udp', 'lossy']} of 5 runs had a session"
    }
    assert {link for (name, link), count in none.items() if name == "dds" and count == 5} == set(
        cells["DDS"]
    )


def test_the_pages_show_remarks_beside_verdicts_and_in_the_table():
    for study, words in (
        ("middleware", ["a quarter of the outage", "1.6 times as old", "did not hold"]),
        ("drives-over-middleware", ["3 of 5 runs had a session", "no run had a session"]),
    ):
        answer = read(results.KEPT / f"{study}.json")
        page = results.study_page(study, answer.question, answer)
        assert unnamed(page, *words) == []
    claims = read_manifest("middleware", results.KEPT)["study"]["hypotheses"]
    page = results.study_page("middleware", "", read(results.KEPT / "middleware.json"))
    assert claims["tcp-stays-out"]["text"] in page  # as it was written before the run
