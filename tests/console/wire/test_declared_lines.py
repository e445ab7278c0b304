"""Each line as it is declared: what a checker of them finds."""

import pytest
from helpers.console.declared_lines import checked
from pydantic import ValidationError

from dva_sim.console.wire.lines import ToPage

PLACES = {"k": "pos", "t": 5, "p": [[0, 1, 2, 3, 4]]}
CLOCK = {"factor": 1, "paused": False, "lag_s": 0.0, "given_up_s": 0.0, "held_by_lag": False}
ROWS = {"k": "rows", "t": 5, "clock": CLOCK, "link": None, "dropped": 0, "robots": []}
ROWS |= {"people": [], "order": None}


@pytest.mark.parametrize("line", [PLACES, ROWS])
def test_a_line_as_declared_arrives(line):
    assert checked(line) == line


@pytest.mark.parametrize(
    "line",
    [
        {**PLACES, "more": 1},
        {"k": "pos", "t": 5},
        {**PLACES, "t": 5.5},
        {**PLACES, "p": [[0, 1.5, 2, 3, 4]]},
        {**ROWS, "clock": {**CLOCK, "speed": 1}},
        {**ROWS, "clock": {**CLOCK, "lag_s": float("nan")}},
        {**ROWS, "people": [{"i": 0}]},
    ],
)
def test_a_line_with_an_unknown_a_missing_or_a_wrong_key_is_found(line):
    with pytest.raises(ValidationError):
        checked(line)


@pytest.mark.parametrize("kind", ["new", "snap"])
def test_a_kind_that_nobody_declared_is_found(kind):
    with pytest.raises(KeyError, match=kind):
        checked({"k": kind})
    with pytest.raises((KeyError, ValidationError)):
        checked({"k": kind}, ToPage)
