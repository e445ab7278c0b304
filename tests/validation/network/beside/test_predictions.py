"""Bands around predictions, and the table of those of the shipped study."""

import csv

import pytest
from helpers.paths import ROOT

from dva_sim.experiments.study.loading import load_study
from dva_sim.simulation.middleware import build
from dva_sim.validation.network.beside.measured import asked_by
from dva_sim.validation.network.beside.predictions import (
    ALLOWANCES,
    KEPT,
    AskedCell,
    PredictedBand,
    predict_all,
    read_kept,
    rows_of,
    widened,
)

SCENARIO = build({"model": "middleware", "measure_s": 8})
LOSSY = {"model": "middleware", "set_up_s": 2, "measure_s": 3, "link": {"loss": 0.2}}


@pytest.mark.parametrize(
    ("measure", "band"),
    [
        ("age_in_force_p50_s", (0.1 * 0.98 - 0.005, 0.2, 0.3 * 1.02 + 0.005)),
        ("longest_gap_s", (0.1 * 0.98 - 0.010, 0.2, 0.3 * 1.02 + 0.010)),
        ("too_old_share", (0.09, 0.2, 0.31)),
        ("command_rate_hz", (0.0, 0.2, 0.3 * 1.02 + 0.125)),  # a command of 8 s
        ("up_bytes", (0.0, 0.2, 0.3 * 1.05 + 1500)),
    ],
)
def test_a_band_is_made_wider_by_what_the_model_leaves_out(measure, band):
    assert widened(PredictedBand(0.1, 0.2, 0.3), ALLOWANCES[measure], SCENARIO) == pytest.approx(
        band
    )


def test_bands_hold_what_repeats_of_the_model_show_and_are_the_same_again():
    choice = {"transport": {"name": "udp", "options": {}}}
    cell = AskedCell("a1", {"middleware": "udp"}, build(LOSSY | choice), (1, 2, 3))
    other = build(LOSSY | {"transport": {"name": "webrtc", "options": {}}})
    silent = AskedCell("b2", {"middleware": "webrtc"}, other, (1, 2, 3))
    first, second = (predict_all([cell, silent], 6, 1) for _ in range(2))
    assert first == second
    predicted, unknown = first
    band = predicted.bands["command_rate_hz"]
    assert band.low < band.predicted < band.high
    assert band.low < 16 < band.high
    assert not band.holds(20.5)
    assert unknown.bands == {}
    assert "WebRTC" in unknown.why
    assert [row["config"] for row in rows_of(first)] == ["a1"]


def test_of_the_shipped_study_all_that_is_predicted_is_kept():
    path = ROOT / "experiments/validation" / f"{KEPT}.csv"
    with path.open() as file:
        kept = {(row["middleware"], row["link"], row["seeds"]) for row in csv.DictReader(file)}
    asked = [cell for cell in asked_by(load_study("middleware")) if not cell.why_not]
    assert {(*cell.levels.values(), " ".join(map(str, cell.seeds))) for cell in asked} == kept
    for bands in read_kept().values():
        assert set(bands) == set(ALLOWANCES)
        assert all(band.low <= band.predicted <= band.high for band in bands.values())
