"""Frames over real sockets: what is packed is seen, and nothing else ends the operator."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.agents.camera import Frame, HazardSpot, Observation, SeenHazard, View

FIRE = SeenHazard("fire", 4.0, 5.0, 1.5)
FRAME = Frame(Observation(86_320, 1.0, 2.0, 0.5, 0.4, -0.1, (FIRE,)), 12.5)


def test_a_frame_has_the_size_of_a_picture_and_comes_back_whole() -> None:
    data = FRAME.pack(12_000)
    assert len(data) == 12_000
    assert Frame.unpack(data) == FRAME


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xd8\xff\xe0 a JPEG",
        b"[]",
        b"[[1, 2], 3]",
        b"[" * 100_000,
        json.dumps(([-1, 1, 2, 0, 0, 0, []], 0)).encode(),
        json.dumps(([2**60, 1, 2, 0, 0, 0, []], 0)).encode(),
        json.dumps(([5, float("nan"), 2, 0, 0, 0, []], 0)).encode(),
        json.dumps(([5, 1, 2, 0, 0, 0, [["fire"]]], 0)).encode(),
        json.dumps(([5, 1, 2, 0, 0, 0, 7], 0)).encode(),
    ],
)
def test_what_is_no_frame_is_none(data: bytes) -> None:
    assert Frame.unpack(data) is None


@given(st.binary(max_size=200))
def test_any_bytes_are_a_frame_or_none(data: bytes) -> None:
    assert Frame.unpack(data) is None or isinstance(Frame.unpack(data), Frame)


@pytest.mark.parametrize(
    ("kind", "depth", "seen"),
    [("gas_leak", 2.9, True), ("gas_leak", 3.1, False), ("fire", 50.0, True)],
)
def test_smoke_hides_everything_but_that_it_burns(kind: str, depth: float, seen: bool) -> None:
    view = View(math.radians(70), 6.0, lambda a, b: True, lambda a, b: depth)
    assert bool(view.look(0.0, 0.0, 0.0, [HazardSpot(kind, 3.0, 0.0, 0.5)])) is seen
