"""Options of plug-ins: what is taken, and what is said of what is not."""

import math

import pytest

from dva_sim.kernel import options
from dva_sim.kernel.errors import ConfigError


def test_what_is_within_its_bounds_is_taken():
    assert options.number("gain", 2, above=0) == 2.0
    assert options.number("share", 1, least=0, most=1) == 1.0
    assert options.whole_number("window", 5, 1, 9) == 5
    assert options.one_of("objective", "eta", ("eta", "distance")) == "eta"
    assert options.some_of("kinds", ["fire"], ("fire", "flood")) == {"fire"}


@pytest.mark.parametrize(
    ("ask", "wanted"),
    [
        (lambda: options.number("x", 0, above=0), "is 0; should be a number above 0"),
        (lambda: options.number("x", 2, least=0, most=1), "is 2; should be a number from 0 to 1"),
        (
            lambda: options.number("x", 1, least=0, below=1),
            "1; should be a number of at least 0, b",
        ),
        (lambda: options.number("x", math.nan), "is nan; should be a number"),
        (lambda: options.number("x", True, least=0), "is True; should be a number of at least 0"),
        (
            lambda: options.whole_number("x", 1.0, 1, 9),
            "is 1.0; should be a whole number from 1 to",
        ),
        (lambda: options.one_of("x", "c", ("b", "a")), "is 'c'; should be one of a, b"),
        (lambda: options.some_of("x", "a", ("a",)), "is 'a'; should be a list of some of a"),
    ],
)
def test_what_is_not_gets_a_line_that_says_what_would_be_right(ask, wanted):
    with pytest.raises(ConfigError) as told:
        ask()
    assert wanted in str(told.value)
    assert not str(told.value).endswith(" ")
