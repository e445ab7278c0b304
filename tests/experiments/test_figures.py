import numpy as np
import pytest
import synthetic_study
from matplotlib.figure import Figure

from dva_sim.experiments.cadence import Cadence
from dva_sim.experiments.effects import Factor, Part, View
from dva_sim.experiments.figures.commands import command_rate
from dva_sim.experiments.figures.effect import _band, _fit_to
from dva_sim.experiments.figures.ground import Ways
from dva_sim.experiments.figures.story import Events, fates, outcomes, responses
from dva_sim.experiments.figures.style import (
    _apart,
    colours,
    log_axis,
    panel_grid,
    panel_name,
    panels,
    place_of,
    styled,
)
from dva_sim.experiments.statistics import band

DELAY = Factor("link.delay_s", (0.0, 0.05, 0.1, 0.25, 0.5, 1.0))
PATTERN = Factor("pattern", ("req-rep", "pub-sub", "latest-wins"))
PROFILE = Factor("profile", ("default", "dissertation"))


@pytest.fixture(scope="module")
def view():
    runs = synthetic_study.columns(synthetic_study.drive_rows(2, 1))
    part = Part(runs, "drive", [PATTERN, DELAY, PROFILE])
    return View(part, "drive_time_s", PATTERN, DELAY, None, {"profile": "default"})


def test_lock_step_falls_behind_where_round_trip_and_processing_fill_the_period():
    wanted = Cadence(period_s=0.1, processing_s=0.05)
    assert wanted.boundary_s == pytest.approx(0.025)
    assert wanted.lock_step_rate(wanted.boundary_s) == pytest.approx(10.0)
    assert wanted.lock_step_rate(0.0) == pytest.approx(10.0)
    assert wanted.lock_step_rate(1.0) == pytest.approx(1 / 2.05)


def test_a_delay_lies_between_the_evenly_spaced_levels_around_it():
    assert place_of(DELAY, 0.025) == pytest.approx(0.5)
    assert place_of(DELAY, 0.75) == pytest.approx(4.5)


@pytest.mark.parametrize("delay", [-0.01, 1.5])
def test_a_boundary_outside_the_levels_has_no_place(delay):
    assert place_of(DELAY, delay) is None


def test_a_pattern_keeps_its_colour_when_another_is_left_out():
    assert colours(PATTERN)["req-rep"] == colours(Factor("pattern", ("req-rep",)))["req-rep"]


def test_a_panel_where_no_run_went_on_takes_nothing_from_the_others(view):
    runs = {**view.part.treated, "is_reference": np.zeros(len(view.part.treated["part"]), bool)}
    rate = np.where(runs["profile"] == "default", 8.0, np.nan)
    part = Part(runs | {"command_rate_hz": rate}, "drive", view.part.factors)
    both = View(part, "drive_time_s", PATTERN, DELAY, None, {})
    assert [panel["profile"] for panel in both.shown] == ["default", "dissertation"]
    with styled():
        assert command_rate(both, lambda panel: None) is not None


def test_names_of_lines_that_end_together_are_moved_apart_within_the_axes():
    placed = _apart([0.95, 0.96, 0.97], gap=0.1)
    assert np.diff(placed).min() == pytest.approx(0.1)
    assert max(placed) == pytest.approx(1.0)


def test_every_event_has_a_fate_even_one_nobody_foresaw():
    outcome = np.array(["confirmed", "confirmed", "expired", "open", "stolen"])
    kind = np.array(["robot", "guard", "robot", "none", "none"])
    assert fates(outcome, kind).tolist() == [
        "confirmed by a robot",
        "confirmed by a guard",
        "expired",
        "open at the end",
        "other",
    ]


def test_shares_of_outcomes_add_up_to_one(view):
    rows = synthetic_study.columns(synthetic_study.story_rows(4))
    events = Events(rows, "story", view)
    mask = events.under({"profile": "default"}, "req-rep", 1.0)
    assert mask.sum() == 8
    assert sum(events.shares(mask).values()) == pytest.approx(1.0)


def test_a_way_is_found_by_its_pattern_delay_and_profile(view):
    rows = synthetic_study.track_rows()
    ways = Ways(synthetic_study.columns(rows), view)
    (way,) = ways.under("pub-sub", 0.25)
    wanted = [
        (r["x_m"], r["y_m"])
        for r in rows
        if (r["pattern"], r["link.delay_s"], r["profile"]) == ("pub-sub", 0.25, "default")
        and not r["is_reference"]
    ]
    np.testing.assert_array_equal(way, wanted)
    assert len(ways.reference()) == 1


@pytest.mark.parametrize(
    ("ends", "numbers"),
    [
        ((0.05, 0.7), ["0.05", "0.1", "0.2", "0.5"]),
        ((0.3, 0.45), ["0.3", "0.4"]),
        ((0.02, 30.0), ["0.02", "0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10", "20"]),
    ],
)
def test_a_logarithmic_axis_has_plain_numbers_at_round_places_only(ends, numbers):
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], ends)
    log_axis(axes)
    figure.draw_without_rendering()
    low, high = axes.get_ylim()
    ticks = axes.yaxis.get_major_ticks()
    shown = [t.label1.get_text() for t in ticks if low <= t.get_loc() <= high]
    assert shown == numbers
    assert axes.yaxis.get_minorticklocs().size == 0


def test_four_settings_stand_two_by_two_with_the_answers_levels_first():
    runs = synthetic_study.columns(synthetic_study.drive_rows(2, 1))
    part = Part(runs, "drive", [PATTERN, Factor("link.delay_s", (0.0, 0.25)), PROFILE])
    view = View(part, "drive_time_s", PATTERN, None, None, {"link.delay_s": 0.25})
    assert [panel_name(panel).replace("\N{NO-BREAK SPACE}", " ") for panel in view.shown] == [
        "250 ms, default",
        "250 ms, dissertation",
        "0 ms, default",
        "0 ms, dissertation",
    ]
    _, axes = panel_grid(view, 3.0)
    assert [ax.get_subplotspec().rowspan.start for ax in axes] == [0, 0, 1, 1]


def test_bands_end_where_nothing_is_possible_and_do_not_flatten_the_lines():
    few = np.array([[40.0, 60.0], [80.0, 90.0]])  # two persons, so bands of hundreds of seconds
    _, ((ax,),) = panels(1, 1, 3.0)
    _band(ax, band(few), "black", "o", 0.0, (0.0, 240.0))
    heights = ax.collections[0].get_paths()[0].vertices[:, 1]
    assert (heights.min(), heights.max()) == (0.0, 240.0)
    assert "they are cut" in _fit_to(ax, few.ravel())
    assert ax.get_ylim() == pytest.approx((32.5, 97.5))


def test_narrow_bands_are_shown_whole():
    _, ((ax,),) = panels(1, 1, 3.0)
    many = np.linspace([40.0, 45.0], [60.0, 65.0], 24)
    _band(ax, band(many), "black", "o", 0.0, (0.0, 240.0))
    before = ax.get_ylim()
    assert _fit_to(ax, many.ravel()) == ""
    assert ax.get_ylim() == before


def test_nobody_who_never_came_has_a_panel_and_one_fate_needs_no_picture(view):
    rows = synthetic_study.columns(synthetic_study.story_rows(4))
    rows["responder_kind"] = np.full(len(rows["part"]), "robot")
    rows["outcome"] = np.full(len(rows["part"]), "confirmed")
    events = Events(rows, "story", view)
    assert list(events.kinds_of_times()) == ["Robot arrives", "Robot confirms"]
    assert outcomes(view, events) is None
    drawn = responses(view, events)
    assert f"all {len(events):,} were confirmed by a robot" in drawn.caption
