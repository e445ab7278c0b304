"""Options of plug-ins: what is taken, and what is said of what is not."""

import math

import pytest
from helpers.wording import unnamed

from dva_sim.kernel import options
from dva_sim.kernel.errors import ConfigError


def test_what_is_within_its_bounds_is_taken():
    assert options.number("gain", 2, above=0) == 2.0
    assert options.number("share", 1, least=0, most=1) == 1.0
    assert options.whole_number("window", 5, 1, 9) == 5
    assert options.one_of("objective", "eta", ("eta", "distance")) == "eta"
    assert options.some_of("kinds", ["fire"], ("fire", "flood")) == {"fire"}


@pytest.mark.parametrize(
    ("ask", "names"),
    [
        (lambda: options.number("x", 0, above=0), "'x' 0; number above 0"),
        (lambda: options.number("x", 2, least=0, most=1), "'x' 2; from 0 to 1"),
        (lambda: options.number("x", 1, least=0, below=1), "'x' 1; least 0, below 1"),
        (lambda: options.number("x", math.nan), "'x' nan; number"),
        (lambda: options.number("x", True, least=0), "'x' True; number least 0"),
        (lambda: options.whole_number("x", 1.0, 1, 9), "'x' 1.0; whole from 1 to 9"),
        (lambda: options.one_of("x", "c", ("b", "a")), "'x' 'c'; one a, b"),
        (lambda: options.some_of("x", "a", ("a",)), "'x' 'a'; list some"),
    ],
)
def test_what_is_not_gets_a_line_that_says_what_would_be_right(ask, names):
    with pytest.raises(ConfigError) as error:
        ask()
    assert unnamed(error.value, *names.split()) == []
    assert not str(error.value).endswith(" ")
