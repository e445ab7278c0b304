"""Choice maps: the best choice by situation, over models of persons with known losses."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.studies.synthetic_results import columns

from dva_sim.experiments.analysis.choice_map import choice_map
from dva_sim.experiments.analysis.study_view import view_of
from dva_sim.experiments.report.choice_table import (
    beside_table,
    choice_table,
    facts_of,
    lead_of,
    regret_text,
)
from dva_sim.experiments.report.prose import caption, note

LINKS, MODELS, CHOICES = ("near", "far", "narrow"), ("steer", "wait"), ("ask", "tell", "pace")
HORIZON_S = 600.0
LOSSES = {  # mean over persons, by situation and choice: under `steer`, and under `wait`
    ("near", "ask"): (40.0, 60.0),
    ("near", "tell"): (40.0, 60.0),
    ("near", "pace"): (40.0, 60.0),
    ("far", "ask"): (70.0, 150.0),
    ("far", "tell"): (50.0, 80.0),
    ("far", "pace"): (55.0, 80.5),
    ("narrow", "ask"): (50.0, 70.0),
    ("narrow", "tell"): (600.0, 600.0),
    ("narrow", "pace"): (58.0, 69.0),
}
STUDY = {
    "factors": {"link": list(LINKS), "messaging": list(CHOICES), "steering": list(MODELS)},
    "treatments": {
        "steering": {
            "steer": {"operator.strategy": "pursuit"},
            "wait": {"operator.strategy": "move_and_wait"},
        }
    },
    "parts": {"drive": {"scenario": "drive-to-event"}},
    "answer": {
        "part": "drive",
        "measure": "drive_time_s",
        "factor": "messaging",
        "contrast": ["ask", "tell"],
        "over": "link",
        "within": {"steering": "steer"},
        "smallest_effect_s": 2.0,
    },
    "map": {"models": "steering", "notes": {"far": "nobody was watched"}},
}


ENDED = LOSSES | {("narrow", "tell"): (90.0, 90.0)}


def read(study=STUDY, losses=LOSSES, persons=6, measure="drive_time_s", noise=None):
    rng = np.random.default_rng(1)
    skills = rng.normal(0.0, 5.0, persons)

    def loss(mean, person, link):
        if mean >= HORIZON_S:
            return HORIZON_S
        chance = rng.normal(0.0, 0.2) if noise is None else noise()
        return mean + skills[person] + chance * (link != "near")

    rows = [
        {"part": "drive", "person": person, "trial": 0, "seed": person, "is_reference": False}
        | {"link": link, "messaging": choice, "steering": model}
        | {measure: loss(mean, person, link)}
        | {"contacts": person, "stop_share": 0.25 * (model == "wait")}
        | {"move_and_wait_share": 0.5 * (model == "wait" and (link == "far" or person == 0))}
        for (link, choice), means in losses.items()
        for model, mean in zip(MODELS, means, strict=True)
        for person in range(persons)
    ]
    view = view_of(study, columns(rows))
    assert view is not None
    return choice_map(study, replace(view, possible=(0.0, HORIZON_S)))


def test_regret_is_the_loss_beyond_the_best_for_the_same_persons():
    found = read()
    far = found.given.levels.index("far")
    ask = found.choice.levels.index("ask")
    assert found.regret[far, ask] == pytest.approx([20.0, 70.0], abs=0.5)
    assert found.least[far, ask] == pytest.approx(20.0, abs=0.5)
    assert found.worst[far, ask] == pytest.approx(70.0, abs=0.5)
    assert (found.regret.min(axis=1) == 0.0).all()


def test_every_mix_of_models_costs_no_more_than_the_worse_model():
    found = read()
    for share in np.linspace(0.0, 1.0, 11):
        mixed = (1 - share) * found.mean[..., 0] + share * found.mean[..., 1]
        assert (mixed - mixed.min(axis=1, keepdims=True) <= found.worst + 1e-9).all()


def test_what_differs_by_less_than_matters_is_as_good_as_the_best():
    found = read()
    assert found.best_of(0) == list(CHOICES)
    assert found.best_of(1) == ["tell"]  # `pace` costs 5 s under one of the models
    assert found.best_of(2) == ["ask"]


def test_the_choice_that_costs_least_where_it_costs_most_is_advised():
    found = read()
    assert found.advised == "pace"
    lead = lead_of(found)
    assert lead.index("pace, 8") < lead.index("ask 70") < lead.index("tell never finishes")
    assert "2 models" in lead


def test_a_choice_that_is_best_everywhere_leads():
    same = dict.fromkeys(LOSSES, (40.0, 60.0))
    assert "No difference" in lead_of(read(losses=same))
    assert "Nothing is better than pace" in lead_of(
        read(losses={key: (50.0 - 9 * (key[1] == "pace"),) * 2 for key in LOSSES})
    )


def with_losses(**changed):
    """The losses with those of some links replaced: a pair for each choice."""
    return LOSSES | {
        (link, choice): pair
        for link, pairs in changed.items()
        for choice, pair in zip(CHOICES, pairs, strict=True)
    }


def test_a_link_on_which_nothing_ever_arrives_settles_nothing():
    dead = with_losses(narrow=[(HORIZON_S, HORIZON_S)] * 3)
    found = read(losses=dead)
    table = choice_table(found, "drive")
    narrow = next(row for row in table.rows if row[0].startswith("narrow"))
    assert narrow[1:5] == ["never"] * 4
    assert "Nothing is better than tell" in lead_of(found)  # where anything was
    everywhere = read(losses=dict.fromkeys(LOSSES, (HORIZON_S, HORIZON_S)))
    assert "No run was finished" in lead_of(everywhere)


def test_what_is_done_under_one_model_alone_is_behind_without_end():
    some = with_losses(far=[(70.0, HORIZON_S), (50.0, 80.0), (55.0, 80.5)])
    found = read(losses=some)
    far = choice_table(found, "drive").rows[1]
    assert far[2].endswith(" to never")
    assert "ask never finishes, far" in lead_of(found)


def test_more_is_better_where_the_measure_says_so():
    rates = {key: (9.0, 8.0) if key[1] == "tell" else (2.0, 1.0) for key in LOSSES}
    answer = STUDY["answer"] | {"measure": "command_rate_hz", "smallest_effect_s": None}
    found = read(STUDY | {"answer": answer}, rates, measure="command_rate_hz")
    assert found.advised == "tell"
    assert found.worst[1].tolist() == pytest.approx([7.0, 0.0, 7.0], abs=0.5)


@pytest.mark.parametrize("seed", range(5))
def test_of_many_equal_choices_none_is_called_worse_for_being_unlucky(seed):
    ways = [f"way {n}" for n in range(14)]
    rng = np.random.default_rng(seed)
    losses = {(link, way): (50.0, 50.0) for link in LINKS for way in ways}
    factors = STUDY["factors"] | {"messaging": ways}
    answer = STUDY["answer"] | {"contrast": ways[:2], "smallest_effect_s": 0.1}
    study = STUDY | {"factors": factors, "answer": answer}
    found = read(study, losses, persons=12, noise=lambda: rng.normal(0.0, 3.0))
    assert not found.is_worse.any()


def test_the_table_says_what_never_arrives_and_what_rests_on_an_assumption():
    table = choice_table(read(), "drive")
    narrow = next(row for row in table.rows if row[0].startswith("narrow"))
    assert narrow[table.heads.index("tell")] == "never"
    far = next(row for row in table.rows if row[0].startswith("far"))
    assert far[-1] == "nobody was watched"


def few_links():
    factors = STUDY["factors"] | {"link": ["far", "narrow"]}
    losses = {key: value for key, value in LOSSES.items() if key[0] != "near"}
    return read(STUDY | {"factors": factors}, losses)


def test_where_choices_are_more_than_links_each_is_a_row():
    assert not read().is_tall
    found = few_links()
    table = choice_table(found, "drive")
    assert table.heads == ["messaging", "far", "narrow", "worst of these"]
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["tell"] == ["=", "never", "never"]
    assert rows["ask"][1] == "="
    assert rows["ask"][0].partition(" to ")[2] == rows["ask"][2]
    assert rows["by assumption"] == ["nobody was watched", "", ""]


def test_a_sentence_names_no_more_choices_than_can_be_read():
    losses = {
        (link, f"way {n}"): (50.0 + 10.0 * (n if link == "far" else 9 - n),) * 2
        for link in ("far", "narrow")
        for n in range(9)
    }
    ways = [f"way {n}" for n in range(9)]
    factors = STUDY["factors"] | {"link": ["far", "narrow"], "messaging": ways}
    answer = STUDY["answer"] | {"contrast": ways[:2]}
    lead = lead_of(read(STUDY | {"factors": factors, "answer": answer}, losses))
    assert lead.count("way ") == 6  # the best and five others
    assert "the 3 others by no less" in lead


def test_without_a_run_in_each_cell_there_is_no_map_yet():
    some = {key: value for key, value in LOSSES.items() if key != ("far", "pace")}
    assert read(losses=some) is None


def test_beside_the_regret_stand_the_loss_itself_and_what_drives_are_like():
    found = read(STUDY | {"map": {"models": "steering", "choosing": "wait"}})
    far = found.given.levels.index("far")
    tell = found.choice.levels.index("tell")
    assert found.median[far, tell] == pytest.approx([50.0, 80.0], abs=5.0)
    assert (found.beside["contacts"] == 2.5).all()
    assert found.waiting[far] == pytest.approx([1.0, 1.0, 1.0])
    assert found.waiting[found.given.levels.index("near")] == pytest.approx([1 / 6] * 3)
    rows = {tuple(row[:2]): row[2:] for row in beside_table(found, "drive").rows}
    assert rows["far", "tell"][2:] == ["2.5", "0.0 to 25", "100"]
    ask = found.choice.levels.index("ask")
    assert (found.high[far, ask] >= found.regret[far, ask]).all()
    assert float(rows["far", "ask"][1]) == pytest.approx(found.high[far, ask].max(), abs=1.0)
    assert (rows["far", "tell"][1], rows["narrow", "tell"][1]) == ("0.0", "never")
    assert len(rows) == len(LINKS) * len(CHOICES)


@pytest.mark.parametrize(("noise_s", "best"), [(0.2, "="), (40.0, "0.0 ?")])
def test_the_least_mean_is_called_equal_to_the_best_only_if_that_is_shown(noise_s, best):
    rng = np.random.default_rng(3)
    losses = with_losses(far=[(190.0, 190.0), (50.0, 50.0), (90.0, 90.0)])
    found = read(losses=losses, persons=4, noise=lambda: rng.normal(0.0, noise_s))
    far, tell = found.given.levels.index("far"), found.choice.levels.index("tell")
    assert found.regret[far, tell].tolist() == [0.0, 0.0]
    assert regret_text(found, far, tell) == best


@pytest.mark.parametrize(("under_wait", "is_shaded"), [(80.0, False), (83.0, True)])
def test_no_choice_is_shaded_that_is_the_best_under_some_model(under_wait, is_shaded):
    losses = with_losses(far=[(70.0, under_wait), (50.0, 80.2), (55.0, 90.0)])
    found = read(losses=losses, noise=lambda: 0.0)
    far, ask = found.given.levels.index("far"), found.choice.levels.index("ask")
    assert found.is_worse[far, ask]
    assert bool(found.is_shaded[far, ask]) is is_shaded
    assert regret_text(found, far, ask).startswith("0.0") is not is_shaded


def test_never_means_the_same_in_all_words_of_a_map():
    for found, is_said in ((read(), True), (read(losses=ENDED), False)):
        for words in (caption("map", **facts_of(found)), note("map", **facts_of(found))):
            assert bool(re.search(r"never\W+no run finished within 600", words)) is is_said
        every = [choice_table(found, "").rows, beside_table(found, "").rows, lead_of(found)]
        assert ("never" in str(every)) is is_said


def test_what_too_few_persons_leave_open_is_neither_equal_nor_free():
    rng = np.random.default_rng(4)
    found = read(persons=2)
    wide = replace(
        found, is_clear=np.zeros_like(found.is_clear), is_same=rng.random(found.is_same.shape) < 0
    )
    assert "too small to tell" in lead_of(wide)
    table = choice_table(wide, "drive")
    far = next(row for row in table.rows if row[0].startswith("far"))
    assert far[table.heads.index("ask")].endswith(" ?")
    assert far[1] == "nothing is shown to differ"
    assert wide.overall.max() > 500.0


def test_levels_that_change_more_than_persons_are_not_called_models_of_them():
    weather = {"steer": {"link.loss": 0.0}, "wait": {"operator.strategy": "move_and_wait"}}
    found = read(STUDY | {"treatments": {"steering": weather}})
    assert read().over == "models of the persons"
    assert "over 2 levels of steering" in lead_of(found)
    words = caption("map", **facts_of(found))
    assert "least to the greatest over 2 levels of steering" in words
