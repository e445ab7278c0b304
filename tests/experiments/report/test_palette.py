"""All colours of all figures: told apart by the colour-blind, and without any colour in a print."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_rgb

import dva_sim.experiments.report.figures
from dva_sim.experiments.analysis.competing_risks import WAYS
from dva_sim.experiments.analysis.run_grid import Factor
from dva_sim.experiments.report.figures import palette
from dva_sim.experiments.report.figures.palette import FATES, LOOKS, STAGES, colours, looks
from dva_sim.network.patterns import PATTERNS

ROOM = Path(dva_sim.experiments.report.figures.__file__).parent.parent
# Machado, Oliveira & Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009) 1291, severity 1.
EYES = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
TO_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
WHITE = np.array([0.95047, 1.0, 1.08883])


def linear(colour):
    """Linear red, green and blue of an sRGB colour."""
    rgb = np.array(to_rgb(colour))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def seen(colour, eye="all cones"):
    """CIE L*, a*, b* of a colour as an eye sees it; L* is what a grey print shows."""
    xyz = TO_XYZ @ np.clip(EYES[eye] @ linear(colour), 0, 1) / WHITE
    f = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(colour):
    """Contrast ratio against white paper, as WCAG 2 defines it."""
    return 1.05 / (TO_XYZ[1] @ linear(colour) + 0.05)


def test_white_black_and_red_have_the_lightness_and_contrast_of_textbooks():
    assert seen("#ffffff") == pytest.approx([100, 0, 0], abs=0.02)
    assert seen("#ff0000") == pytest.approx([53.24, 80.09, 67.20], abs=0.05)
    assert contrast("#000000") == pytest.approx(21.0)


@pytest.mark.parametrize("eye", EYES)
def test_colours_of_lines_and_marks_differ_for_every_eye(eye):
    pairs = itertools.combinations([look.colour for look in LOOKS], 2)
    nearest = min(np.linalg.norm(seen(a, eye) - seen(b, eye)) for a, b in pairs)
    assert nearest > 14  # about 2 can just be told when side by side


def test_no_colour_is_without_a_mark_of_its_own():
    assert len({look.mark for look in LOOKS}) == len(LOOKS) == 15


def test_lines_and_marks_stand_out_from_white_paper_in_a_grey_print():
    assert max(seen(look.colour)[0] for look in LOOKS) < 77


@pytest.mark.parametrize("colour", [palette.INK, palette.SOFT, palette.WARNING, palette.HAZARD])
def test_text_has_the_contrast_of_small_print(colour):
    assert contrast(colour) > 4.5


STACKS = {
    "delay budget": list(STAGES.values()),
    "ways to end": [FATES[way] for way in WAYS],
}


@pytest.mark.parametrize("stack", STACKS.values(), ids=STACKS)
@pytest.mark.parametrize("eye", EYES)
def test_surfaces_of_a_stack_differ_for_every_eye_or_by_their_hatching(stack, eye):
    for a, b in itertools.combinations(stack, 2):
        apart = np.linalg.norm(seen(a.colour, eye) - seen(b.colour, eye))
        assert apart > 14 or a.hatch != b.hatch, (a, b)


@pytest.mark.parametrize("stack", STACKS.values(), ids=STACKS)
def test_neighbours_in_a_stack_differ_in_a_grey_print(stack):
    for a, b in itertools.pairwise(stack):
        assert abs(seen(a.colour)[0] - seen(b.colour)[0]) > 12 or a.hatch != b.hatch, (a, b)


@pytest.mark.parametrize("eye", EYES)
def test_below_and_above_zero_differ_for_every_eye_on_the_heat_map(eye):
    paint = colormaps[palette.DIVERGING]
    for size in (0.25, 0.5):
        below, above = (seen(paint(0.5 + sign * size)[:3], eye) for sign in (-1, 1))
        assert np.linalg.norm(below - above) > 25


def test_a_level_keeps_its_look_when_another_is_left_out_or_joins():
    alone = looks(Factor("pattern", ("req-rep",)))["req-rep"]
    mixed = looks(Factor("system", ("faster", "req-rep", "long-filter", "pub-sub")))
    assert mixed["req-rep"] == alone
    assert len(set(mixed.values())) == 4


def test_beside_patterns_nothing_has_a_colour_of_theirs():
    patterns = {c.lower() for c in colours(Factor("pattern", tuple(PATTERNS))).values()}
    fills = {fill.colour for fill in (*FATES.values(), *STAGES.values())}
    agents = {palette.look_of(kind).colour for kind in ("robot", "guard", "bystander")}
    others = set(colours(Factor("filter", tuple(f"filter-{n}" for n in range(9)))).values())
    rest = {colour.lower() for colour in (*agents, *others, *fills)}
    assert len(patterns) == len(PATTERNS)
    assert patterns & {palette.SINGLE_LOOK.colour.lower(), *rest} == set()
    assert palette.SINGLE_LOOK.colour.lower() not in rest


def test_policies_and_every_pattern_have_looks_that_no_other_of_them_has():
    policies = ("random", "nearest_idle", "min_eta", "priority_eta", "batch_optimal", "auction")
    policies += ("preemptive", "hazard_team", "operator_aware", "coverage", "preference", "oracle")
    factor = Factor("dispatch.policy", (*policies, "mine.py:Mine"))
    assert len(set(colours(factor).values())) == 13
    assert len({look.mark for look in looks(factor).values()}) == 13


def test_figures_bring_no_colour_of_their_own():
    """Otherwise the tests above would not cover all figures."""
    files = [*ROOM.glob("figures/*.py"), ROOM / "model_page.py"]
    colour = re.compile(r"#[0-9a-fA-F]{6}\b|cmap=\"|color=\"(?!none)[a-z]+\"")
    named = {path.name for path in files if colour.search(path.read_text(encoding="utf-8"))}
    assert named == {"palette.py"}
