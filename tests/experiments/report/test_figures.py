from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.studies import synthetic_results
from helpers.studies.report_text import blank_pictures
from helpers.wording import unnamed
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from dva_sim.experiments.analysis.run_grid import Factor, RunGrid
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.answer_table import spread_table
from dva_sim.experiments.report.figures.answer_figure import AnswerFigure
from dva_sim.experiments.report.figures.commands import Brought, CommandAge
from dva_sim.experiments.report.figures.cut_bars import fit_to
from dva_sim.experiments.report.figures.delay_budget import DelayBudget, stages_of
from dva_sim.experiments.report.figures.distribution import Distributions
from dva_sim.experiments.report.figures.effect import Cadence, Differences, _band, _possible
from dva_sim.experiments.report.figures.heat_map import EffectField, HeatMap
from dva_sim.experiments.report.figures.legend import apart, columns_of
from dva_sim.experiments.report.figures.palette import SINGLE_LOOK
from dva_sim.experiments.report.figures.scatter import trend
from dva_sim.experiments.report.figures.style import (
    NO_RESULT_LABEL,
    is_to_scale,
    log_axis,
    panel_grid,
    panel_name,
    panels,
    place_of,
    styled,
)
from dva_sim.experiments.report.figures.tradeoff import TradeOff
from dva_sim.statistics import band

DELAY = Factor("link.delay_s", (0.0, 0.05, 0.1, 0.25, 0.5, 1.0))
PATTERN = Factor("pattern", ("req-rep", "pub-sub", "latest-wins"))
PROFILE = Factor("profile", ("default", "dissertation"))
DRAWN = ("delay_period_s", "delay_wait_s")  # of the delay budget, not of a table
blank = blank_pictures()  # for figures that are asked for their numbers, words and axes
NOTHING_ELSE = SimpleNamespace(scenario_of=lambda part: {"command": "unknown"})


def with_columns(view, **columns):
    """Replace some columns of the runs, none of which is a reference."""
    plain = {"is_reference": np.zeros(len(view.part.treated["part"]), bool)}
    part = RunGrid(view.part.treated | plain | columns, "drive", view.part.factors)
    return replace(view, part=part)


@pytest.fixture(scope="module")
def view():
    runs = synthetic_results.columns(synthetic_results.drive_rows(2, 1))
    part = RunGrid(runs, "drive", [PATTERN, DELAY, PROFILE])
    return StudyView(part, "drive_time_s", PATTERN, DELAY, None, {"profile": "default"})


def test_the_table_of_spreads_holds_both_sides_and_the_effect_at_every_stop():
    runs = synthetic_results.columns(synthetic_results.drive_rows(6, 3))
    part = RunGrid(runs, "drive", [PATTERN, DELAY, PROFILE])
    contrast = ("req-rep", "latest-wins")
    view = StudyView(part, "drive_time_s", PATTERN, DELAY, contrast, {"profile": "default"})
    rows = spread_table(view).rows
    assert len(rows) == 3 * 6
    assert {row[0] for row in rows[-3:]} == {"1\N{NO-BREAK SPACE}s"}
    lines = ["REQ/REP", "latest-wins PUB/SUB", "REQ/REP − latest-wins PUB/SUB"]
    assert [row[1] for row in rows[-3:]] == lines


def test_lock_step_falls_behind_where_round_trip_and_processing_fill_the_period():
    wanted = Cadence(period_s=0.1, processing_s=0.05)
    assert wanted.boundary_s == pytest.approx(0.025)


def test_a_delay_lies_between_the_evenly_spaced_levels_around_it():
    assert place_of(DELAY, 0.025) == pytest.approx(0.5)
    assert place_of(DELAY, 0.75) == pytest.approx(4.5)


@pytest.mark.parametrize("delay", [-0.01, 1.5])
def test_a_boundary_outside_the_levels_has_no_place(delay):
    assert place_of(DELAY, delay) is None


def test_names_of_lines_that_end_together_are_moved_apart_within_the_axes():
    placed = apart([0.95, 0.96, 0.97], gap=0.1)
    assert np.diff(placed).min() == pytest.approx(0.1)
    assert max(placed) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("ends", "numbers"),
    [
        ((0.05, 0.7), ["0.05", "0.1", "0.2", "0.5"]),
        ((0.3, 0.45), ["0.3", "0.4"]),
        ((0.001, 10.0), ["0.001", "0.01", "0.1", "1", "10"]),
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
    runs = synthetic_results.columns(synthetic_results.drive_rows(2, 1))
    part = RunGrid(runs, "drive", [PATTERN, Factor("link.delay_s", (0.0, 0.25)), PROFILE])
    view = StudyView(part, "drive_time_s", PATTERN, None, None, {"link.delay_s": 0.25})
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
    _band(ax, _possible(band(few), 0.0, 240.0), SINGLE_LOOK, 0.0)
    heights = ax.collections[0].get_paths()[0].vertices[:, 1]
    assert (heights.min(), heights.max()) == (0.0, 240.0)
    assert "are cut" in fit_to(ax, few.ravel())
    assert ax.get_ylim() == pytest.approx((32.5, 97.5))


def test_narrow_bands_are_shown_whole():
    _, ((ax,),) = panels(1, 1, 3.0)
    many = np.linspace([40.0, 45.0], [60.0, 65.0], 24)
    _band(ax, band(many), SINGLE_LOOK, 0.0)
    before = ax.get_ylim()
    assert fit_to(ax, many.ravel()) == ""
    assert ax.get_ylim() == before


@blank
def test_bars_of_a_lower_panel_are_not_cut_by_the_first(view):
    runs, columns = view.part.treated, ("delay_uplink_s", "delay_downlink_s")
    longer = np.where(runs["profile"] == "dissertation", 3.0, 1.0)
    longer_there = with_columns(view, **{name: runs[name] * longer for name in columns})
    with styled():
        drawn = DelayBudget().draw(longer_there, NOTHING_ELSE)
    longest = max(ax.get_xlim()[1] for ax in drawn.figure.axes)
    rows = [row.split(",") for row in drawn.csv.decode().splitlines()]
    stages = [i for i, name in enumerate(rows[0]) if name.startswith("delay_")]
    highest = max(sum(float(row[i]) for i in stages) for row in rows[1:])
    assert highest > 6.0
    assert longest > highest


def two_factor_view(effect):
    """Robot minus guard at 4 x 3 settings, for 8 persons of whom none differs from the others."""
    rng = np.random.default_rng(1)
    ratio, mobilisation = Factor("ratio", (0.5, 1.0, 2.0, 4.0)), Factor("wait_s", (0.0, 20.0, 40.0))
    team = Factor("team", ("robot", "guard"))
    rows = [
        {"part": "d", "person": person, "trial": 0, "seed": person, "is_reference": False}
        | {"team": who, "ratio": r, "wait_s": w}
        | {"response_s": 60.0 + effect(r, w) * (who == "robot") + rng.normal(0, 0.5)}
        for person in range(8)
        for who in team.levels
        for r in ratio.levels
        for w in mobilisation.levels
    ]
    part = RunGrid(synthetic_results.columns(rows), "d", [team, ratio, mobilisation])
    return StudyView(part, "response_s", team, ratio, ("robot", "guard"), {})


@blank
@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (lambda ratio, wait: 10 * np.log2(ratio) - 0.5 * wait, "Thick line"),
        (lambda ratio, wait: 30.0 + wait, "zero nowhere"),
    ],
)
def test_the_heat_map_draws_the_line_where_the_effect_turns_round_if_it_does(effect, expected):
    with styled():
        drawn = HeatMap().draw(two_factor_view(effect), NOTHING_ELSE)
    assert expected in drawn.caption
    rows = drawn.csv.decode().splitlines()
    assert rows[0] == "wait_s,ratio,mean_s,band_low_s,band_high_s"
    assert len(rows) == 1 + 12


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [(1.0, 5.0, 3.0), (0.0, 6.0, 0.0), (-6.0, 0.0, 0.0), (-6.0, -1.0, -3.0), (np.nan, np.nan, 3.0)],
)
def test_a_field_is_coloured_only_where_its_band_excludes_zero(low, high, shown):
    mean = 3.0 if not low < -5 else -3.0
    field = EffectField(Factor("b", (1,)), {}, *(np.full((1, 1), x) for x in (mean, low, high)))
    assert field.shown[0, 0] == shown


def test_a_second_factor_of_two_levels_needs_no_heat_map(view):
    assert HeatMap().draw(view, NOTHING_ELSE) is None


@blank
def test_the_tradeoff_needs_an_exposure_that_varies():
    view = two_factor_view(lambda ratio, wait: 5.0)
    assert TradeOff().draw(view, NOTHING_ELSE) is None
    exposed = np.where(view.part.treated["team"] == "guard", 40.0, 2.0)
    part = RunGrid(view.part.treated | {"person_exposure_s": exposed}, "d", view.part.factors)
    with styled():
        drawn = TradeOff().draw(replace(view, part=part), NOTHING_ELSE)
    assert unnamed(drawn.title, "response time", "people in danger") == []


def of_links(view, count):
    """Runs with named links in place of delays."""
    names = ("ideal", "far", "wifi", "lossy", "narrow", "cellular-at-the-edge")[:count]
    runs = {**view.part.treated, "is_reference": np.zeros(len(view.part.treated["part"]), bool)}
    link = np.array([names[DELAY.levels.index(d)] for d in runs["link.delay_s"].tolist()])
    factors = [PATTERN, Factor("link", names), PROFILE]
    part = RunGrid(runs | {"link": link}, "drive", factors)
    contrast = ("req-rep", "latest-wins")
    return StudyView(part, "drive_time_s", PATTERN, factors[1], contrast, {"profile": "default"})


def of_steps(view):
    """Runs at six equally spaced delays."""
    even = Factor("link.delay_s", tuple(n / 5 for n in range(6)))
    delays = np.searchsorted(DELAY.levels, view.part.treated["link.delay_s"]) / 5
    part = RunGrid(view.part.treated | {"link.delay_s": delays}, "drive", [PATTERN, even, PROFILE])
    return replace(view, part=part, over=even, contrast=("req-rep", "latest-wins"))


def joined(axes):
    """Lines that join the six stops."""
    lines = [line for line in axes.lines if len(line.get_xdata()) == 6]
    return [line for line in lines if line.get_linestyle() == "-"]


@blank
def test_lines_lead_over_equal_steps_and_never_where_their_slope_would_mean_nothing(view):
    uneven = replace(view, contrast=("req-rep", "latest-wins"))
    with styled():
        axes = [
            Differences().draw(v, NOTHING_ELSE).figure.axes[0]
            for v in (of_steps(view), uneven, of_links(view, 6))
        ]
    assert [len(joined(ax)) > 0 for ax in axes] == [True, False, False]
    means = (0.0, 1.0, 2.0)
    for delays, leads in (((0.0, 0.5, 1.0), True), ((0.0, 0.1, 1.0), False)):
        ax = drawn_answer(answered(means, levels=delays)).figure.axes[0]
        assert (
            any(line.get_linestyle() == "-" and len(line.get_xdata()) == 3 for line in ax.lines)
            == leads
        )


@blank
def test_an_axis_that_is_logarithmic_says_so_and_has_a_tick_at_what_matters(view):
    wide = replace(view, contrast=("req-rep", "latest-wins"), smallest_effect=0.2)
    with styled():
        drawn = [kind().draw(wide, NOTHING_ELSE).figure for kind in (Differences, CommandAge)]
        times = wide.part.treated["drive_time_s"]
        slow = np.where(wide.part.treated["link.delay_s"] == 1.0, 10 * times, times)
        spread = Distributions().draw(with_columns(wide, drive_time_s=slow), NOTHING_ELSE).figure
    for figure in (*drawn, spread):
        ax = figure.axes[0]
        assert ax.get_yscale() in ("log", "symlog")
        assert "log scale" in ax.get_ylabel()
    assert {-0.2, 0.0, 0.2} <= set(drawn[0].axes[0].get_yticks())


@blank
@pytest.mark.parametrize(("persons", "boxes"), [(4, 0), (5, 2 * 6 * 3)])
def test_quarters_are_drawn_of_five_runs_and_not_made_up_of_fewer(persons, boxes):
    rows = synthetic_results.drive_rows(persons, 1)
    part = RunGrid(synthetic_results.columns(rows), "drive", [PATTERN, DELAY, PROFILE])
    whole = StudyView(part, "drive_time_s", PATTERN, DELAY, None, {"profile": "default"})
    with styled():
        figure = Distributions().draw(whole, NOTHING_ELSE).figure
    sides = [c for c in figure.axes[0].collections if isinstance(c, LineCollection)]
    upright = [s for c in sides for s in c.get_segments() if s[0][0] == s[1][0]]
    assert len(upright) == boxes  # two sides of each box


@blank
def test_panels_of_transports_that_are_logarithmic_say_so_in_their_titles(view):
    times = view.part.treated["drive_time_s"]
    known = with_columns(view, round_trip_p95_s=times / 100, command_rate_hz=times / 10)
    with styled():
        axes = Brought().draw(known, NOTHING_ELSE).figure.axes
    values = {ax.get_title("left"): ax.get_yscale() for ax in axes if ax.get_visible()}
    assert set(values.values()) == {"log", "linear"}
    assert [
        title for title, scale in values.items() if ("log scale" in title) != (scale == "log")
    ] == []


def arrow_heads(axes):
    """Marks at the edges, and the numbers beside them."""
    heads = [line for line in axes.lines if line.get_marker() in ("^", "v", "<", ">")]
    texts = [t.get_text() for t in axes.texts if t.get_fontsize() == 7.5]
    marks = [(h.get_marker(), *map(float, h.get_xydata()[0])) for h in heads]
    return marks, texts


@blank
def test_a_bar_that_is_cut_has_an_arrow_head_and_its_true_bound_at_the_edge():
    wide = answered(low=np.array([-1.0, -40.0, -129.0]), high=np.array([1.0, 9.0, 294.0]))
    ax = drawn_answer(wide, spread=0.1).figure.axes[0]
    low, high = ax.get_ylim()
    marks, texts = arrow_heads(ax)
    assert marks == [("v", 1.0, low), ("v", 2.0, low), ("^", 2.0, high)]
    assert texts == ["−40.0", "−129", "294"]
    assert arrow_heads(drawn_answer(answered()).figure.axes[0]) == ([], [])


@blank
def test_bands_of_two_persons_are_cut_with_their_bounds(view):
    asked = replace(view, contrast=("req-rep", "latest-wins"), possible=(0.0, 300.0))
    with styled():
        drawn = Differences().draw(asked, NOTHING_ELSE)
    (ax, *_), rows = drawn.figure.axes, drawn.csv.decode().splitlines()
    heads = [h for h in ax.lines if len(h.get_xdata()) == 1 and h.get_label() == NO_RESULT_LABEL]
    bounds = [rows[0].split(",").index(f"band_{end}_s") for end in ("low", "high")]
    low, high = ax.get_ylim()
    ends = [
        np.clip([float(row.split(",")[i] or 0) for i in bounds], -300.0, 300.0)
        for row in rows[1:]
        if "default" in row
    ]
    assert len(heads) == sum(int(a < low) + int(b > high) for a, b in ends) > 0


@blank
def test_the_key_of_the_figure_that_answers_tells_open_from_little():
    many = answered((0.0, 5.0, 9.0), smallest_effect=2.0)
    few = replace(many, low=many.mean - 80.0, high=many.mean + 80.0, persons=4)

    def labels_of(found):
        drawn = drawn_answer(found)
        return [text.get_text() for text in drawn.figure.legends[0].get_texts()], drawn.caption

    assert labels_of(many)[0] == ["differs from zero", "too little to matter"]
    names, words = labels_of(few)
    assert [unnamed(name, "open: ", "persons (4)") for name in names] == [[]]
    assert words.startswith("Too few persons (4)")


def overlapping(figure, texts):
    """Pairs of texts that are drawn over each other."""
    figure.draw_without_rendering()
    boxes = [t.get_window_extent() for t in texts if t.get_text() and t.get_visible()]
    return [
        (a, b)
        for i, a in enumerate(boxes)
        for b in boxes[:i]
        if a.x0 < b.x1 and b.x0 < a.x1 and a.y0 < b.y1 and b.y0 < a.y1
    ]


@blank
def test_who_does_not_drive_has_no_delay_budget(view):
    runs = view.part.treated
    guards = runs["pattern"] == "pub-sub"
    stages = {k: np.where(guards, np.nan, v) for k, v in runs.items() if k.startswith("delay_")}
    with styled():
        figure = DelayBudget().draw(with_columns(view, **stages), NOTHING_ELSE).figure
    titles = [ax.get_title("left").rpartition(", ")[2] for ax in figure.axes]
    assert titles == ["REQ/REP", "latest-wins"] * 2


def test_what_a_command_stands_longer_while_a_request_is_open_is_the_patterns_cost(view):
    """At a phone of 10 Hz: every run made 100 commands, of which 20 went under REQ/REP."""
    runs, asks = view.part.treated, view.part.treated["pattern"] == "req-rep"
    in_force = np.where(asks, 0.25, 0.05)
    fates = {"sent": np.where(asks, 20, 100), "superseded": np.where(asks, 80, 0)}
    fates |= {"applied": fates["sent"]}
    known = {f"commands_{fate}": values for fate, values in fates.items()}
    changed = with_columns(view, delay_sampling_s=in_force, delay_pattern_s=0 * in_force, **known)
    stages = stages_of(changed)
    loop = sum(np.nan_to_num(runs[n]) for n in runs if n.startswith("delay_") and n not in DRAWN)
    grid = changed.part.laid_out(loop - runs["delay_sampling_s"] + in_force)
    np.testing.assert_allclose(sum(stages.values()), grid)  # as the columns add up
    for level, wait in (("req-rep", 0.2), ("latest-wins", 0.0)):
        where = {"pattern": level, "profile": "default"}
        period, waits = (changed.part.where(stages[name], where) for name in DRAWN)
        assert period == pytest.approx(np.full_like(period, 0.05))
        assert waits == pytest.approx(np.full_like(waits, wait))


def test_what_a_slow_robot_skips_of_the_commands_that_came_is_no_wait_of_the_pattern(view):
    """Latest-wins: all 100 went, the robot took 20 of them."""
    fates = {"sent": 100.0, "superseded": 80.0, "applied": 20.0}
    count = len(view.part.treated["part"])
    known = {f"commands_{fate}": np.full(count, value) for fate, value in fates.items()}
    changed = with_columns(view, delay_sampling_s=np.full(count, 0.25), **known)
    assert np.nanmax(stages_of(changed)["delay_wait_s"]) == 0.0


@pytest.mark.system
def test_names_of_six_links_stand_clear_of_each_other_beside_the_delay_budget(view):
    with styled():
        figure = DelayBudget().draw(of_links(view, 6), NOTHING_ELSE).figure
    axes = [ax for ax in figure.axes if ax.get_visible()]
    names = list(axes[0].get_yticklabels())
    assert [text.get_text() for text in names][::5] == ["ideal", "cellular-at-the-edge"]
    assert overlapping(figure, [*names, *(ax._left_title for ax in axes)]) == []


@pytest.mark.parametrize(
    ("lengths", "columns"),
    [([8, 13, 19], 3), ([8, 13, 19, 6, 19, 9, 11], 5), ([120, 3], 1), ([], 1)],
)
def test_a_key_has_as_many_columns_as_fit_the_width(lengths, columns):
    assert columns_of(lengths) == columns


def test_an_axis_says_when_its_levels_are_not_as_far_apart_as_their_places():
    assert is_to_scale(Factor("robot.count", (1, 2, 3)))
    assert is_to_scale(Factor("link", ("near", "far")))
    assert not is_to_scale(DELAY)


def test_the_trend_of_points_is_made_of_means_with_the_scatter_of_their_points():
    x = np.arange(48.0)
    middle, mean, half = trend(x, np.where(x % 2, 3.0, 1.0) + (x > 23))
    assert middle[:2] == pytest.approx([2.5, 8.5])
    assert mean == pytest.approx([2, 2, 2, 2, 3, 3, 3, 3])
    # Three at 1 and three at 3: a standard deviation of 1.0954 over 2.4495, times 2.5706.
    assert half == pytest.approx(np.full(8, 1.1496), abs=1e-4)


def test_eleven_points_are_too_few_for_a_trend():
    assert trend(np.arange(11.0), np.arange(11.0))[0].size == 0


# --- the figure that answers -------------------------------------------------------------------


ANSWER = {"levels": (0.0, 0.5, 1.0), "within": {}, "in_excess": False, "persons": 8}


def answered(means=(0.0, 5.0, 9.0), **changes):
    return synthetic_results.finding(means, 2.0, **(ANSWER | {"smallest_effect": None} | changes))


def drawn_answer(found, spread=1.0):
    """Persons whose spread is the band's width, or a share of it."""
    steps = spread * np.linspace(-1.0, 1.0, found.persons)[:, np.newaxis]
    with styled():
        differences = found.mean + steps * (found.high - found.low) / 2
        return AnswerFigure().contrast(found, differences)


@blank
def test_the_figure_that_answers_shows_the_band_and_fills_what_differs_from_zero():
    drawn = drawn_answer(answered())
    ax = drawn.figure.axes[0]
    marks = [line for line in ax.lines if line.get_marker() == "o"]
    filled, hollow = (m.get_xdata().tolist() for m in marks)
    assert (filled, hollow) == ([1, 2], [0])
    assert [text.get_text() for text in ax.texts] == ["0", "+5.0", "+9.0"]
    assert drawn.csv.decode().splitlines()[2] == "0.5,5,3,7"
    assert unnamed(drawn.caption, "Above zero REQ/REP", "mean of 8 persons") == []


@blank
def test_a_contrast_that_runs_over_nothing_has_one_mark():
    drawn = drawn_answer(answered((3.0,), over="", levels=(None,)))
    assert [text.get_text() for text in drawn.figure.axes[0].texts] == ["+3.0"]
    assert "band" not in drawn.caption


def test_without_an_interval_no_figure_answers():
    nothing = np.full(3, np.nan)
    assert drawn_answer(answered(low=nothing, high=nothing)) is None


@blank
def test_what_is_too_small_to_matter_is_grey_if_it_can_be_seen():
    assert "Grey" in drawn_answer(answered(smallest_effect=2.0)).caption
    assert "Grey" not in drawn_answer(answered(smallest_effect=0.01)).caption
