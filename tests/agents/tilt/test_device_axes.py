"""The axes of a browser become those of the pipeline."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.agents.tilt.accelerometer import GRAVITY
from dva_sim.agents.tilt.device_axes import ORIENTATIONS, to_device_axes, to_tilt_axes

SIN = GRAVITY * math.sin(0.3)
COS = GRAVITY * math.cos(0.3)


@pytest.mark.parametrize("orientation", ORIENTATIONS)
def test_a_phone_that_lies_flat_means_nothing(orientation):
    assert to_tilt_axes((0.0, 0.0, GRAVITY), orientation) == (0.0, 0.0, GRAVITY)
    assert to_tilt_axes((0.0, 0.0, -GRAVITY), orientation, True) == (0.0, 0.0, GRAVITY)


@pytest.mark.parametrize(
    ("measured", "orientation", "forwards", "left"),
    [
        ((0.0, -SIN, COS), 0, SIN, 0.0),  # upright, its top edge down
        ((SIN, 0.0, COS), 0, 0.0, SIN),  # upright, its left edge down
        ((-SIN, 0.0, COS), 90, SIN, 0.0),  # turned counter-clockwise: its right edge is far
        ((0.0, -SIN, COS), 90, 0.0, SIN),  # and its top lies to the left
        ((SIN, 0.0, COS), 270, SIN, 0.0),  # turned clockwise: its left edge is far
        ((0.0, SIN, COS), 270, 0.0, SIN),
        ((0.0, SIN, COS), 180, SIN, 0.0),
    ],
)
def test_the_far_edge_down_is_forwards_and_the_left_edge_down_is_left(
    measured, orientation, forwards, left
):
    assert to_tilt_axes(measured, orientation) == pytest.approx((forwards, left, COS))
    inverted = tuple(-part for part in measured)
    assert to_tilt_axes(inverted, orientation, True) == pytest.approx((forwards, left, COS))


NUMBER = st.floats(-20, 20)


@given(st.tuples(NUMBER, NUMBER, NUMBER), st.sampled_from(ORIENTATIONS), st.booleans())
def test_there_and_back_is_the_same_to_the_last_bit(tilt, orientation, ios):
    assert to_tilt_axes(to_device_axes(tilt, orientation, ios), orientation, ios) == tilt
