"""The report of a study of transports, from SYNTHETIC numbers in which TCP is slower."""

from pathlib import Path

import pytest
from helpers.studies import synthetic_results
from helpers.studies.report_text import words
from helpers.wording import unnamed

from dva_sim.experiments.report.report import write_report
from dva_sim.kernel.measure import names_of
from dva_sim.simulation.measures.sessions import RUN_COLUMNS

pytestmark = pytest.mark.system

TRANSPORTS, CROWDS, PERSONS = ["udp", "tcp"], ["0", "8"], 6
STUDY = {
    "question": "Which transport?",
    "seed": 1,
    "persons": PERSONS,
    "replications": 1,
    "factors": {"transport": TRANSPORTS, "crowd": CROWDS},
    "parts": {"drive": {"scenario": "congested-link"}},
    "answer": {
        "part": "drive",
        "measure": "movement_time_s",
        "factor": "transport",
        "contrast": ["tcp", "udp"],
        "over": "crowd",
        "smallest_effect_s": 2.0,
    },
}


def row(cell: int, transport: str, crowd: str, person: int) -> dict[str, object]:
    """One run: TCP takes 40 s longer beside eight flows."""
    slow = 40.0 * (transport == "tcp" and crowd == "8")
    values = dict.fromkeys(names_of(RUN_COLUMNS), 1.0) | {
        "plugin_failures": 0.0,
        "movement_time_s": 80.0 + slow + person % 3,
    }
    if crowd == "0":
        values |= dict.fromkeys(("share_of_fair_down", "bulk_use_down", "jain_down"), float("nan"))
    design = {"part": "drive", "cell": cell, "config": f"c{cell}", "transport": transport}
    who = {"crowd": crowd, "is_reference": False, "person": person, "trial": 0, "seed": person}
    return design | who | values


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cells = [(t, c) for t in TRANSPORTS for c in CROWDS]
    rows = [row(n, t, c, p) for n, (t, c) in enumerate(cells) for p in range(PERSONS)]
    facts = synthetic_results.manifest(PERSONS, 1) | {
        "study": STUDY,
        "scenarios": {"drive": {"model": "transports", "bottleneck": {"rate_bps": 1e6}}},
    }
    folder = tmp_path_factory.mktemp("study") / "results"
    return write_report(synthetic_results.write(folder, {"runs": rows}, facts))


def test_the_report_finds_what_was_put_in(report):
    assert unnamed(words(report), "longer with TCP", "+40.0 s", "TCP flows each way 8") == []


def test_its_figures_show_what_a_transport_brings(report):
    drawn = {path.stem for path in (report.parent / "figures").glob("*.svg")}
    assert {path.stem for path in (report.parent / "figures").glob("*.csv")} == drawn
    assert drawn == {"answer", "differences", "brought"}


def test_conditions_and_sources_speak_of_the_shared_link(report):
    assert not unnamed(words(report), "shared link 1 Mbit/s", "in equal shares", "only abstracts")
