"""The answer level by level: why a difference may not be that of the two means beside it."""

import pytest
from helpers.studies import synthetic_results

from dva_sim.experiments.report.answer_table import answer_table
from dva_sim.kernel.wording import as_number, number

WHOLE = [(30.0, 50.0), (30.0, 60.0)]
ROUNDED = [(30.04, 50.06), (30.0, 60.0)]  # 50.1 and 30.0, but 20.0
ADJUSTED = "adjusted for covariates"


def table(tmp_path, means, *, leaves_out=False, covariates=()):
    """Tabulate 30 persons with certain means at two delays, of latest-wins and of REQ/REP."""
    rows = [
        row | {"drive_time_s": way + means[row["link.delay_s"] == 1.0][row["pattern"] == "req-rep"]}
        for row in synthetic_results.drive_rows(30, 1, missed=0.0)
        if not row["is_reference"] and row["link.delay_s"] in (0.5, 1.0)
        for way in [float(row["person"] % 3 - 1)]
    ]
    if leaves_out:
        rows = [r for r in rows if r["pattern"] != "req-rep" or r["person"] % 3]
    if covariates:
        rows = [
            r | {"drive_time_s": r["drive_time_s"] + 9 * off * (r["pattern"] == "req-rep")}
            | {"caution_off": off}
            for r in rows
            for off in [1.0 if r["person"] < 19 else -1.0]
        ]  # fmt: skip
    facts = synthetic_results.manifest(30, 1)
    facts["study"]["covariates"] = list(covariates)
    facts["study"]["factors"]["link.delay_s"] = [0.5, 1.0]
    return answer_table(synthetic_results.reading(tmp_path / "r", rows, facts))


@pytest.mark.parametrize(
    ("means", "changes", "said", "unsaid"),
    [
        (WHOLE, {}, "", "not that of the two means"),
        (ROUNDED, {}, "rounded separately", "within each person"),
        (WHOLE, {"leaves_out": True}, "within each person who has both.", "covariates"),
        (WHOLE, {"covariates": ["caution_off"]}, ADJUSTED, "rounded"),
    ],
)
def test_a_sum_that_is_not_right_to_the_eye_is_explained(tmp_path, means, changes, said, unsaid):
    found = table(tmp_path, means, **changes)
    assert (found.note != "") is (said != "")
    assert said in found.note
    assert unsaid not in found.note


@pytest.mark.parametrize("value", [75.5, -0.25, 1234.0, 0.0])
def test_what_is_printed_can_be_read_again(value):
    assert as_number(number(value)) == value
