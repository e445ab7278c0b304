"""The count of statements, on which the size of rooms rests."""

import pytest
from statements import statements


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ("", 0),
        ('"""Words."""', 0),
        ("a = 1", 1),
        ("a = 1; b = 2", 2),
        ("a, b = 1, 2", 2),
        ("a, b = f()", 1),
        ("def f():\n    '''Words.'''\n    return 1", 2),
        ("if a:\n    b()\nelse:\n    c()", 3),
        ("class A:\n    x: int = 1", 2),
    ],
)
def test_statements_are_counted_however_they_are_written(source, count):
    assert statements(source) == count
