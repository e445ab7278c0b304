import numpy as np
import pytest
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.analysis.hypothesis_tests import judged
from dva_sim.experiments.report.hypothesis_tables import (
    comparison_table,
    hypothesis_table,
    verdict_lead,
)

PLAIN = {"part": "drive", "measure": "drive_time_s", "factor": "pattern"}
COST = PLAIN | {"contrast": ["req-rep", "latest-wins"], "over": "link.delay_s"}
SAME = PLAIN | {"contrast": ["pub-sub", "latest-wins"], "within": {"link.delay_s": 0.0}}


@pytest.fixture(scope="module")
def runs():
    """Request/reply costs 40 s more at 1 s of delay, and 2.5 s at 250 ms."""
    rows = synthetic_results.drive_rows(10, 2, effect_s=40.0, missed=0.0)
    return synthetic_results.columns(rows)


def study(**claims):
    return synthetic_results.manifest(10, 2)["study"] | claims


def test_a_comparison_is_made_at_each_level_it_runs_over(runs):
    found = judged(study(comparisons={"cost": COST}), runs).compared
    assert [c.at["link.delay_s"] for c in found] == [0.0, 0.05, 0.1, 0.25, 0.5, 1.0]
    last = found[-1]
    assert last.difference.mean == pytest.approx(40.0, abs=2.0)
    assert last.p == pytest.approx(2 / 2**10)  # of 10 persons all went the same way
    assert last.adjusted == pytest.approx(6 * last.p)  # the smallest of six
    assert last.correlation > 0.9


def test_the_table_of_comparisons_says_how_many_tests_there_are(runs):
    declared = study(comparisons={"cost": COST, "same": SAME | {"family": "aside"}})
    found = judged(declared, runs)
    table = comparison_table(found)
    assert len(table.rows) == 7
    assert table.rows[5][-1] == "✓ yes"
    assert "main: 6; aside: 1" in table.note


def test_a_comparison_of_levels_that_were_not_run_is_said_not_to_have_been(runs):
    found = judged(study(comparisons={"x": SAME | {"contrast": ["pub-sub", "tcp"]}}), runs)
    assert found.compared[0].difference is None
    assert comparison_table(found).rows[0][3] == "not run"


@pytest.mark.parametrize(
    ("persons", "smallest_s", "expected"),
    [
        (4, 50.0, ["too few persons (4)"] * 2),  # with four no permutation test shows anything
        (10, 0.001, ["too few persons (10)"] * 2),  # what matters is not ruled out
        (10, 50.0, ["? open", "? not shown"]),  # nothing that matters
    ],
)
def test_what_is_not_shown_is_for_want_of_persons_or_else_there_is_little(
    persons, smallest_s, expected
):
    rows = synthetic_results.drive_rows(persons, 2, effect_s=40.0, missed=0.0)
    same = SAME | {"smallest_effect_s": smallest_s}
    claims = {"h": {"direction": "above", "comparison": "same"}}
    found = judged(
        study(comparisons={"same": same}, hypotheses=claims), synthetic_results.columns(rows)
    )
    lead = verdict_lead(found.tested, "person", is_extrapolated=False, only_model="")
    assert ("too few" in lead) == ("few" in expected[0])
    cells = [hypothesis_table(found.tested).rows[0][-1], comparison_table(found).rows[0][-1]]
    assert [word for cell, word in zip(cells, expected, strict=True) if word not in cell] == []
    assert [len(cell) > len("? not shown") for cell in cells] == [
        "few" in word for word in expected
    ]


@pytest.mark.parametrize(
    ("claim", "verdict"),
    [
        ({"direction": "above", "margin": 20.0}, "held"),
        ({"direction": "above", "margin": 60.0}, "did not hold"),
        ({"direction": "below"}, "did not hold"),
        ({"direction": "same", "margin": 5.0}, "did not hold"),
        ({"direction": "same", "margin": 5.0, "comparison": "same"}, "held"),
        ({"direction": "above", "comparison": "same"}, "open"),
    ],
)
def test_a_hypothesis_is_judged_by_its_margin(runs, claim, verdict):
    declared = study(comparisons={"same": SAME}, hypotheses={"h": claim})
    (tested,) = judged(declared, runs).tested
    assert tested.verdict == verdict


def test_the_table_of_hypotheses_sets_claims_beside_what_came_out(runs):
    declared = study(
        hypotheses={"h": {"text": "Waiting costs.", "direction": "above", "margin": 2}}
    )
    row = hypothesis_table(judged(declared, runs).tested).rows[0]
    assert row[0] == "h: Waiting costs."
    assert unnamed(row[1], "delay 1\N{NO-BREAK SPACE}s", "above 2.0\N{NO-BREAK SPACE}s") == []
    assert row[5] == "✓ held"


def test_levels_that_a_comparison_does_not_name_are_averaged(runs):
    (found,) = judged(study(comparisons={"same": SAME}), runs).compared
    here = (runs["part"] == "drive") & (runs["link.delay_s"] == 0.0) & ~runs["is_reference"]
    both_profiles = {
        pattern: runs["drive_time_s"][here & (runs["pattern"] == pattern)].mean()
        for pattern in ("pub-sub", "latest-wins")
    }
    expected = both_profiles["pub-sub"] - both_profiles["latest-wins"]
    assert found.difference.mean == pytest.approx(expected, abs=1e-9)


def test_hypotheses_and_comparisons_of_a_family_share_its_chance_of_a_false_alarm(runs):
    claim = {"direction": "above", "margin": 2.0}
    alone = judged(study(hypotheses={"h": claim}), runs).tested[0]
    assert alone.adjusted == pytest.approx(alone.p)
    beside = judged(study(comparisons={"cost": COST}, hypotheses={"h": claim}), runs)
    assert beside.tested[0].p == alone.p
    assert beside.tested[0].adjusted == pytest.approx(7 * alone.p)  # the smallest of 6 + 1
    apart = study(comparisons={"cost": COST | {"family": "aside"}}, hypotheses={"h": claim})
    assert judged(apart, runs).tested[0].adjusted == pytest.approx(alone.p)


def test_what_speaks_against_hypotheses_is_adjusted_too(runs):
    """The true cost is 40 s: no claim of at least 41 s holds, and a few such refute no sooner."""
    claims = {f"h{n}": {"direction": "above", "margin": 41.0} for n in range(4)}
    found = judged(study(hypotheses=claims), runs).tested
    alone = judged(study(hypotheses={"h0": claims["h0"]}), runs).tested[0]
    assert 0.0 < alone.p_against < 1.0
    assert [t.against for t in found] == pytest.approx([min(1.0, 4 * alone.p_against)] * 4)


def lies_where_claimed(tested):
    """Return True for the claim that the printed interval lies within, and for its opposite."""
    margin, found = tested.hypothesis.margin, tested.difference
    return {
        "above": (found.low > margin, found.high < margin),
        "below": (found.high < -margin, found.low > -margin),
        "same": (
            -margin < found.low and found.high < margin,
            found.low > margin or found.high < -margin,
        ),
    }[tested.hypothesis.direction]


@pytest.mark.parametrize("family", [1, 5])
def test_a_verdict_and_its_interval_have_one_level(family):
    """Studies of known truth: the mean difference is 2 s; claims stand around it."""
    rng = np.random.default_rng(0)
    times = 50 + rng.gamma(2.0, 1.0, 12)
    rows = [
        {"part": "drive", "cell": cell, "person": person, "trial": 0, "seed": person}
        | {"pattern": pattern, "is_reference": False, "drive_time_s": times[person] * (cell == 0)}
        for person in range(12)
        for cell, pattern in enumerate(["req-rep", "latest-wins"])
    ]
    for row in rows:
        row["drive_time_s"] = row["drive_time_s"] or 50.0
    margins = np.linspace(0.5, 3.5, 13)
    seen = set()
    for direction in ("above", "below", "same"):
        for margin in margins:
            claims = {f"h{n}": {"direction": direction, "margin": margin} for n in range(family)}
            contrast = PLAIN | {"contrast": ["req-rep", "latest-wins"]}
            declared = {"factors": {"pattern": ["req-rep", "latest-wins"]}, "answer": contrast}
            for tested in judged(
                declared | {"hypotheses": claims}, synthetic_results.columns(rows)
            ).tested:
                within, beyond = lies_where_claimed(tested)
                expected = "held" if within else "did not hold" if beyond else "open"
                assert tested.verdict == expected, (direction, margin, tested)
                seen.add(tested.verdict)
    assert seen == {"held", "did not hold", "open"}
