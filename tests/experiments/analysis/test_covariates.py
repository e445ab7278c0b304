"""A study's answer adjusted for what is known of persons and trials beforehand."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.studies import synthetic_results
from helpers.studies.small_study import STUDY, study_in

from dva_sim.experiments.analysis import stopping
from dva_sim.experiments.analysis.study_view import covariates_of, finding_of, view_of
from dva_sim.experiments.report.method import remarks
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.results import frame_of
from dva_sim.experiments.results.tables import design_row
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.parts import multiplied

KNOWN = "covariates: [caution_off]\n"
MEASURED = "measures: [caution_off, way_off_m]\n"


def rows(shift: float = 0.0, persons: int = 30) -> list[dict[str, Any]]:
    """Persons of whom a trait explains most of what REQ/REP costs them."""
    trait = np.random.default_rng(4).normal(shift, 1.0, persons)
    found = []
    for row in synthetic_results.drive_rows(persons, 1, missed=0.0):
        known = trait[row["person"]]
        slow = 20 * known if row.get("pattern") == "req-rep" else 0.0
        found.append(row | {"caution_off": known, "drive_time_s": row["drive_time_s"] + slow})
    return found


def study(*covariates: str) -> dict[str, Any]:
    whole: dict[str, Any] = synthetic_results.manifest(30, 1)["study"]
    return whole | {"covariates": list(covariates)}


def half_width(found: Any) -> float:
    return float((found.high - found.low)[-1] / 2)


def test_the_answers_band_is_adjusted_and_shorter():
    runs = synthetic_results.columns(rows())
    plain, ours = (finding_of(view_of(study(*names), runs)) for names in ((), ("caution_off",)))
    assert half_width(ours) < 0.7 * half_width(plain)
    assert ours.persons == plain.persons == 30


def test_a_covariate_whose_mean_cannot_be_zero_is_left_out_and_told(tmp_path):
    runs = synthetic_results.columns(rows(shift=3.0))
    view = view_of(study("caution_off"), runs)
    assert view.covariates == ()
    assert covariates_of(study("caution_off"), view.part) == ([], ["caution_off"])
    reported = reading(tmp_path, rows(shift=3.0)).warnings
    assert any("caution_off" in warning for warning in reported)


def reading(tmp_path: Path, table: list[dict[str, Any]]) -> Reading:
    whole = synthetic_results.manifest(30, 1)
    whole["study"] = study("caution_off")
    return synthetic_results.reading(tmp_path / "r", table, whole)


def remark(found: Reading) -> str:
    (reported,) = (text for text in remarks(found) if "control variates" in text)
    return reported


def test_the_report_says_what_it_is_adjusted_for_and_what_that_was_worth(tmp_path):
    many, few = (reading(tmp_path / str(n), rows(persons=n)) for n in (30, 8))
    assert "without" in remark(many)
    assert "too few persons" in remark(few)


def test_a_product_of_columns_is_one_covariate():
    assert multiplied("caution_off * way_off_m") == ["caution_off", "way_off_m"]
    runs = synthetic_results.columns([row | {"one": 1.0} for row in rows()])
    alone, product = (
        finding_of(view_of(study(name), runs)) for name in ("caution_off", "caution_off*one")
    )
    assert np.array_equal(alone.low, product.low)


def test_a_study_without_covariates_is_the_same_study_as_ever(tmp_path):
    assert "covariates" not in study_in(tmp_path).asked()
    assert "covariates" in study_in(tmp_path, text=STUDY + MEASURED + KNOWN).asked()


def test_a_study_stops_at_the_interval_that_it_shows():
    asked = load_study("how-late-at-250-ms", ["stop.most_persons=48"])
    found = [
        design_row(job) | _measured(job.person, job.levels["pattern"] == "req-rep")
        for job in cell_grid.jobs(asked)
    ]
    assert asked.stop is not None
    runs = frame_of(found)
    seen = stopping.half_widths(asked, asked.stop, runs)
    shown = finding_of(view_of(asked.asked(), runs))
    assert seen == pytest.approx((shown.high - shown.low) / 2)
    plain = asked.model_copy(update={"covariates": ()})
    assert seen[0] < 0.5 * stopping.half_widths(plain, asked.stop, runs)[0]


def _measured(person: int, is_slow: bool) -> dict[str, float]:
    rng = np.random.default_rng(person)
    trait, way, chance = rng.normal(), 9 * rng.normal(), rng.normal(size=2)
    late = 8 - 4 * trait + 0.5 * way + chance[0] if is_slow else 0.0
    return {"response_mean_s": 50 + chance[1] + late, "caution_off": trait, "way_off_m": way}
