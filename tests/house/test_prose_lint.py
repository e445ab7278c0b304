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
        ("The runs of a study.", ["verb"]),
        ("Nobody drives it any more.", ["verb"]),
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


def test_a_property_is_a_thing():
    source = (
        'class A:\n    @property\n    def age(self):\n        """The age of a command [s]."""\n'
    )
    assert list(prose_lint.findings_in(source, FILE)) == []


@pytest.mark.parametrize(
    ("docstring", "rules"), [("Robots of a scenario.", []), ("Whose turn it is.", ["question"])]
)
def test_docstrings_of_constants_are_read(docstring, rules):
    source = f'TURN = 1\n"""{docstring}"""\n'
    assert [found.rule for found in prose_lint.findings_in(source, FILE)] == rules


@pytest.mark.parametrize(
    ("comment", "rules"),
    [
        ("/** Age of a picture [ms]. */", []),
        ("/** @param {number} i */", []),
        ("/** Whether it holds. */", ["question"]),
        ("  /**\n   * What is held.\n   */", ["question"]),
    ],
)
def test_doc_comments_of_pages_are_read(comment, rules):
    found = prose_lint.findings_in(f"{comment}\nconst a = 1;\n", Path("a.js"))
    assert [each.rule for each in found] == rules
