"""The lint of docstrings finds each fault that it knows, and nothing in good prose."""

from pathlib import Path

import prose_lint
import pytest

FILE = Path("dva_sim/network/link.py")


@pytest.mark.parametrize(
    ("docstring", "rules"),
    [
        ("Return the age of the newest command [s].", []),
        (
            "Generators of a run.\n\n    Args:\n        half: Half the step.",
            [],
        ),
        ("What is asked.", ["question"]),
        ("Whether it holds.", ["question"]),
        ("Of the socket.", ["fragment"]),
        ("See `Pattern`.", ["see"]),
        ("Draw the luck of a run.", ["word"]),
        ("Start anew, as the robot is told.", ["word", "word"]),
        ("Do it.\n\n    Args:\n        size: Of each, with all headers [B].", ["argument"]),
    ],
)
def test_each_fault_is_found(docstring, rules):
    source = f'def f(size):\n    """{docstring}"""\n'
    assert [found.rule for found in prose_lint.findings_in(source, FILE)] == rules


def test_a_room_may_only_get_better():
    now = prose_lint.counted(
        [prose_lint.Finding("dva_sim/network", "question", "", "")] * 3
        + [prose_lint.Finding("dva_sim/kernel", "word", "", "")]
    )
    before = {"dva_sim/network": {"question": 2}, "dva_sim/kernel": {"word": 1}}
    assert prose_lint.worse(now, before) == [("dva_sim/network", "question")]
    assert prose_lint.worse(now, {}) != []
