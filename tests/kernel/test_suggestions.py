"""Messages for unknown names: the closest match, or the known names."""

import pytest
from helpers.wording import unnamed

from dva_sim.kernel.suggestions import either, guess, hint, listed, unknown


@pytest.mark.parametrize(
    ("given", "known", "meant"),
    [
        ("person", ["pattern", "persons"], "persons"),
        ("oracel", ["oracle", "pursuit"], "oracle"),
        ("Fire_Drill", ["fire-drill", "patrol-shift"], "fire-drill"),
        ("req-rep-vs-pubsub", ["req-rep-vs-pub-sub", "retry-livelock"], "req-rep-vs-pub-sub"),
        ("req-rep", ["req-rep-vs-pub-sub", "retry-livelock"], "req-rep-vs-pub-sub"),
        ("rnu", ["run", "new", "robot"], "run"),
        ("delay", ["delay_s", "delay_law", "jitter_s"], "delay_s"),
    ],
)
def test_a_slip_and_a_beginning_tell_which_name_was_meant(given, known, meant):
    assert guess(given, known) == meant


@pytest.mark.parametrize(
    ("given", "known"),
    [
        ("person", ["pattern", "parts"]),
        ("mean", ["median", "none"]),
        ("robot-9", ["robot-1", "robot-2"]),
        ("lng", ["log", "long-name"]),
        ("fire", ["fire-drill", "fire-and-flood"]),
        ("", ["a"]),
        ("x" * 10_000, ["persons"]),
    ],
)
def test_what_is_only_alike_is_no_guess(given, known):
    assert guess(given, known) is None


def test_without_a_guess_what_there_is_is_told_but_not_all_of_much():
    assert hint("zebra", ["a", "b"]) == "known: a, b"
    assert hint("zebra", [], "parts") == "parts: none"
    assert unnamed(listed(range(100)), "10, 11", "100") == []
    assert unnamed(unknown("policy", "dice", ["min_eta"]), "policy", "'dice'", "min_eta") == []
    assert "'min_eta'?" in unknown("policy", "min_ate", ["min_eta"])


def test_alternatives_are_listed_as_one_would_say_them():
    assert [either("a"), either("ab"), either("abc")] == ["a", "a or b", "a, b or c"]
