"""Frames over real sockets: what is packed is seen, and nothing else ends the operator."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.agents.camera import Frame, Observation, SeenHazard

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
