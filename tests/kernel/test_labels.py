"""Labels that people can tell apart."""

import pytest

from dva_sim.kernel.labels import HIDDEN, LONGEST, distinct, look_of, visible, with_id

ID = "02:00:00:09:00:09"


@pytest.mark.parametrize("plain", ["robot-1", "Janes Handy", "Zoë", "消防 2", "\U0001f525"])
def test_what_can_be_seen_stays(plain):
    assert visible(plain) == plain
    assert distinct(plain, ID, ["another"]) == plain


@pytest.mark.parametrize(
    "hidden",
    ["\u200b", "\u202e", "\u2066", "\ufeff", "\u00ad", "\u3164", "\ufe0f", "\U000e0041", "\u2028"],
)
def test_what_cannot_be_seen_is_an_escape(hidden):
    shown = visible(f"robot{hidden}-1")
    assert shown == f"robot{hidden.encode('unicode_escape').decode()}-1"
    assert distinct(f"robot{hidden}-1", ID, ["robot-1"]) == shown


@pytest.mark.parametrize(
    "alike", ["robot-1", " Robot-1", "robot\u00ad-1", "ｒｏｂｏｔ-1", "robot‑1"]
)
def test_of_two_that_look_the_same_one_has_its_id(alike):
    shown = distinct("robot-1", ID, [alike])
    assert (shown == f"robot-1 ({ID})") is (look_of(alike) == look_of("robot-1"))
    assert look_of(shown) != look_of(alike)


def test_who_gives_nothing_to_see_is_called_by_its_id():
    assert distinct("  ", ID, []) == ID


@pytest.mark.parametrize("long", ["x" * LONGEST, "\u202e" * LONGEST, "\U0001f525" * LONGEST])
def test_it_fits_into_a_message(long):
    assert len(distinct(long, ID, [])) <= LONGEST
    assert with_id(long, ID).endswith(f" ({ID})")
    assert len(with_id(long, ID)) <= LONGEST


def test_a_page_shows_escapes_of_what_turns_text_or_controls_a_terminal_and_keeps_its_lines():
    assert "a\u202eb\x1b[31m\n\u00a0\u2013".translate(HIDDEN) == "a\\u202eb\\x1b[31m\n\u00a0\u2013"
