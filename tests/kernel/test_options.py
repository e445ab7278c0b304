"""Options of plug-ins: what is taken, and what is said of what is not."""

from dva_sim.kernel import options


def test_what_is_within_its_bounds_is_taken():
    assert options.number("gain", 2, above=0) == 2.0
    assert options.number("share", 1, least=0, most=1) == 1.0
    assert options.whole_number("window", 5, 1, 9) == 5
    assert options.one_of("objective", "eta", ("eta", "distance")) == "eta"
    assert options.some_of("kinds", ["fire"], ("fire", "flood")) == {"fire"}
