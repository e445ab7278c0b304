"""Frames over real sockets: what is packed is seen, and nothing else ends the operator."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.agents.observation import CLEAR, CameraFrame, Observation, SeenHazard
from dva_sim.agents.robot.field_of_view import FieldOfView, HazardSpot

FIRE = SeenHazard("fire", 4.0, 5.0, 1.5, 0.6, 1.0)
FRAME = CameraFrame(Observation(86_320, 1.0, 2.0, 0.5, 0.4, -0.1, (FIRE,), 2.5), 12.5)


def test_a_frame_has_the_size_of_a_picture_and_comes_back_whole():
    data = FRAME.pack(12_000)
    assert len(data) == 12_000
    assert CameraFrame.unpack(data) == FRAME


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xd8\xff\xe0 a JPEG",
        b"[]",
        b"[[1, 2], 3]",
        b"[" * 100_000,
        json.dumps(([-1, 1, 2, 0, 0, 0, [], 9], 0)).encode(),
        json.dumps(([2**60, 1, 2, 0, 0, 0, [], 9], 0)).encode(),
        json.dumps(([5, float("nan"), 2, 0, 0, 0, [], 9], 0)).encode(),
        json.dumps(([5, 1, 2, 0, 0, 0, [["fire"]], 9], 0)).encode(),
        json.dumps(([5, 1, 2, 0, 0, 0, [["fire", 1, 2, 3, math.inf, 1]], 9], 0)).encode(),
        json.dumps(([5, 1, 2, 0, 0, 0, 7, 9], 0)).encode(),
        json.dumps(([5, 1, 2, 0, 0, 0, [], math.nan], 0)).encode(),
        json.dumps(([5, 1, 2, 0, 0, 0, []], 0)).encode(),
    ],
)
def test_what_is_no_frame_is_none(data):
    assert CameraFrame.unpack(data) is None


@given(st.binary(max_size=200))
def test_any_bytes_are_a_frame_or_none(data):
    assert CameraFrame.unpack(data) is None or isinstance(CameraFrame.unpack(data), CameraFrame)


@pytest.mark.parametrize(
    ("shines", "depth", "seen"), [(False, 2.9, True), (False, 3.1, False), (True, 50.0, True)]
)
def test_smoke_hides_everything_but_what_shines(shines, depth, seen):
    view = FieldOfView(math.radians(70), 6.0, lambda a, b: True, lambda a, b: depth)
    spot = HazardSpot("fire", 3.0, 0.0, 0.5, shines)
    assert bool(view.look(0.0, 0.0, 0.0, [spot])) is seen


def test_a_hazard_of_1_m_across_looks_19_degrees_wide_from_3_m_and_9_5_from_6_m():
    view = FieldOfView(math.radians(70), 6.0, lambda a, b: True)
    for distance, degrees in ((3.0, 18.9), (6.0, 9.5)):
        (seen,) = view.look(0.0, 0.0, 0.0, [HazardSpot("gas_leak", distance, 0.0, 0.5)])
        assert math.degrees(seen.angle) == pytest.approx(degrees, abs=0.05)
        assert (seen.distance, seen.contrast) == (distance, 1.0)


def test_smoke_takes_contrast_by_its_optical_depth():
    view = FieldOfView(math.radians(70), 6.0, lambda a, b: True, lambda a, b: 0.5 * math.dist(a, b))
    (seen,) = view.look(0.0, 0.0, 0.0, [HazardSpot("gas_leak", 4.0, 0.0, 0.5)])
    assert seen.contrast == pytest.approx(math.exp(-2.0))


def test_where_no_smoke_is_in_sight_none_is_looked_at():
    def smoke(a: tuple[float, float], b: tuple[float, float]) -> float:
        raise AssertionError

    view = FieldOfView(1.2, 6.0, lambda a, b: True, smoke, hazy=lambda: False)
    assert view.visibility(1.0, 2.0, 0.7) == CLEAR


@pytest.mark.parametrize(("extinction", "far"), [(0.0, CLEAR), (0.5, 6.0), (3.0, 1.0)])
def test_visibility_is_3_over_the_extinction(extinction, far):
    view = FieldOfView(1.2, 6.0, lambda a, b: True, lambda a, b: extinction * math.dist(a, b))
    assert view.visibility(1.0, 2.0, 0.7) == pytest.approx(far)


def test_clean_air_beyond_a_wall_does_not_make_thick_smoke_thinner():
    """Smoke of 4 /m to x = 1 m, none beyond: over 6 m on average 0.67 /m."""
    depth = lambda a, b: 4.0 * (min(b[0], 1.0) - min(a[0], 1.0))  # noqa: E731
    assert FieldOfView(1.2, 6.0, lambda a, b: True, depth).visibility(
        0.0, 0.0, 0.0
    ) == pytest.approx(0.75)
