import pytest
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.analysis.robustness import robustness_of
from dva_sim.experiments.analysis.study_view import finding_of, view_of
from dva_sim.experiments.report.answer_conditions import repeated

EFFECTS = {
    ("pursuit", 0): 20.0,
    ("pursuit", 1): 5.0,
    ("adaptive", 0): 1.0,
    ("adaptive", 1): -4.0,
}


OWN = {"operator": {"strategy": "pursuit"}}


def read(effects, effect_s=20.0, rows=None, scenario=OWN):
    runs = synthetic_results.columns(synthetic_results.drive_rows(8, 2, effect_s, missed=0.0))
    study = synthetic_results.manifest(8, 2)["study"] | synthetic_results.CLAIMS
    view = view_of(study, runs)
    rows = synthetic_results.repeat_rows(effects) if rows is None else rows
    table = synthetic_results.columns(rows)
    return view, robustness_of(study, table, view, finding_of(view), scenario)


def test_shares_count_the_repeats_with_known_signs():
    _, found = read(EFFECTS)
    (stop,) = found.stops
    assert (stop.same_sign, stop.clear, stop.relevant, stop.negligible) == (2, 1, 1, 1)
    assert (found.persons, found.trials, found.sets) == (4, 2, 1)


def test_signs_are_compared_with_the_studys_own():
    _, found = read(EFFECTS | {("pursuit", 0): -30.0}, effect_s=-30.0)
    (stop,) = found.stops
    assert (stop.same_sign, stop.clear, stop.relevant, stop.negligible) == (1, 1, 1, 1)


def test_each_repeat_has_its_effect_and_an_interval_around_it():
    _, found = read(EFFECTS)
    (stop,) = found.stops
    for repeat in stop.repeats:
        effect = EFFECTS[repeat.strategy, repeat.parameters]
        assert repeat.mean == pytest.approx(stop.found + effect - EFFECTS["pursuit", 0])
        changed = repeat.mean - stop.found
        assert repeat.low <= stop.low + changed + 1e-9  # never surer than the study
        assert repeat.high >= stop.high + changed - 1e-9


def test_only_what_a_model_changes_is_counted_and_not_which_persons_repeated_it():
    _, near = read(EFFECTS)
    _, far = read(EFFECTS, effect_s=120.0)
    for before, after in zip(near.stops[0].repeats, far.stops[0].repeats, strict=True):
        assert after.mean - before.mean == pytest.approx(100.0)


def test_without_a_repeat_of_the_studys_own_model_each_stands_for_itself():
    _, found = read(EFFECTS, scenario={"operator": {"strategy": "two_point"}})
    means = [repeat.mean for repeat in found.stops[0].repeats]
    assert means == pytest.approx([effect + 0.15 for effect in EFFECTS.values()])


def test_a_repeat_without_a_pair_is_left_out():
    rows = synthetic_results.repeat_rows(EFFECTS)
    half = [r for r in rows if (r["parameters"], r["pattern"]) != (1, "req-rep")]
    _, found = read(EFFECTS, rows=half)
    assert len(found.stops[0].repeats) == 2


def test_the_studys_own_model_is_no_evidence_for_itself():
    for own, counted in (("pursuit", 2), ("adaptive", 3), ("two_point", 3)):
        _, found = read(EFFECTS, scenario={"operator": {"strategy": own}})
        (stop,) = found.stops
        assert stop.same_sign == counted
        assert [r.strategy for r in stop.repeats if r.is_own] == [own] * (own != "two_point")


def test_repeats_at_delays_at_which_nobody_was_watched_are_told():
    rows = [
        row
        | {"loop_delay_mean_s": 1.4, "delay_human_s": 0.2}
        | {"move_and_wait_share": float(row["operator.strategy"] == "adaptive")}
        for row in synthetic_results.repeat_rows(EFFECTS)
    ]
    _, found = read(EFFECTS, rows=rows)
    assert {(r.strategy, r.is_beyond) for r in found.stops[0].repeats} == {
        ("pursuit", True),
        ("adaptive", False),
    }
    text = repeated(found)[-1].replace("\N{NO-BREAK SPACE}", " ")
    assert unnamed(text, "1 of 3", "(33 %) are extrapolated") == []


def test_the_sentences_give_shares_and_reach():
    _, found = read(EFFECTS)
    what, text = (s.replace("\N{NO-BREAK SPACE}", " ") for s in repeated(found))
    assert unnamed(what, "4 persons", "2 trials") == []
    signs = ("delay 1 s the sign holds in 2 of 3 (67 %)", "in 1 of them", "−4.4 to 4.6 s")
    sizes = ("in 1 of 3 (33 %) the effect exceeds", "in 1 it is below", "adaptive (1 of 2)")
    assert unnamed(text, *signs, *sizes) == []


def test_a_study_without_repeats_has_none():
    runs = synthetic_results.columns(synthetic_results.drive_rows(4, 1))
    study = synthetic_results.manifest(4, 1)["study"]
    view = view_of(study, runs)
    assert robustness_of(study, {}, view, finding_of(view), OWN) is None
