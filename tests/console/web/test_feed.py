"""Feed of a page: the newest of what it lacks, at any polling rate."""

import json

from helpers.console.served_console import places, scene, seat
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.console.web.feed import PageFeed
from dva_sim.console.web.state import RunState
from dva_sim.console.wire.limits import OWN_KEPT, STORY_KEPT


def run_state(*lines):
    state = RunState()
    for line in lines:
        state.take(line)
    return state


def all_of(feed):
    found = []
    while (text := feed.next()) is not None:
        found.append(json.loads(text))
    return found


def opened(*lines):
    """A run of which so much was told, and a page that knows it."""
    state = run_state(scene(), *lines)
    feed = PageFeed(state, "c1")
    all_of(feed)
    return state, feed


def test_a_page_begins_with_all_there_is():
    state = run_state(
        scene(), places(100, [0, 1, 2, 3, 4]), {"k": "events", "t": 100, "events": []}
    )
    (snap,) = all_of(PageFeed(state, "c1"))
    assert (snap["k"], snap["s"], snap["t"]) == ("snap", 1, 100)
    assert snap["scene"]["scenario"] == "test"
    assert snap["state"]["pos"] == [[0, 1, 2, 3, 4]]
    assert snap["state"]["events"]["events"] == []


def test_a_page_that_opens_before_the_run_gets_the_scene_when_it_is_told():
    state = run_state()
    feed = PageFeed(state, "c1")
    assert all_of(feed)[0]["scene"] is None
    state.take(scene())
    assert [(m["k"], m["s"]) for m in all_of(feed)] == [("snap", 2)]


def test_only_who_moved_is_told():
    state, feed = opened(places(0, [0, 1, 1, 0, 0], [1, 5, 5, 0, 0]))
    state.take(places(100, [0, 2, 1, 0, 0], [1, 5, 5, 0, 0]))
    (line,) = all_of(feed)
    assert (line["t"], line["p"]) == (100, [[0, 2, 1, 0, 0]])


def test_a_page_that_slept_gets_all_who_moved_meanwhile_once():
    state, feed = opened(places(0, [0, 0, 0, 0, 0], [1, 0, 0, 0, 0], [2, 0, 0, 0, 0]))
    state.take(places(100, [0, 1, 0, 0, 0], [1, 0, 0, 0, 0], [2, 0, 0, 0, 0]))
    state.take(places(200, [0, 2, 0, 0, 0], [1, 9, 0, 0, 0]))
    (line,) = all_of(feed)
    assert line["t"] == 200
    assert sorted(line["p"]) == [[0, 2, 0, 0, 0], [1, 9, 0, 0, 0]]
    assert line["gone"] == [2]


def test_the_same_text_serves_all_who_are_equally_far():
    state = run_state(scene(), places(0, [0, 0, 0, 0, 0]))
    assert state.moved_since(0) is state.moved_since(0)
    assert state.snapshot() is state.snapshot()


def test_of_other_kinds_only_the_newest_is_told():
    state, feed = opened()
    for n in range(5):
        state.take({"k": "rows", "t": n, "clock": {"factor": n}})
    assert [(m["k"], m["t"]) for m in all_of(feed)] == [("rows", 4)]


def test_a_fast_kind_does_not_starve_the_others():
    state, feed = opened()
    seen = set()
    for n in range(8):  # a slow page: one message each time, and all kinds are new each time
        state.take(places(n, [0, n, 0, 0, 0]))
        for kind in ("rows", "hazards", "events"):
            state.take({"k": kind, "t": n})
        state.take({"k": "story", "t": n, "what": str(n)})
        seen.add(json.loads(feed.next())["k"])
    assert seen == {"d", "rows", "hazards", "events", "story"}


def test_the_story_comes_whole_or_as_a_snapshot():
    state, feed = opened()
    for n in range(3):
        state.take({"k": "story", "t": n, "what": str(n)})
    assert [m["what"] for m in all_of(feed)] == ["0", "1", "2"]
    for n in range(STORY_KEPT + 1):
        state.take({"k": "story", "t": n, "what": str(n)})
    (snap,) = all_of(feed)
    assert snap["k"] == "snap"
    assert snap["state"]["story"][-1]["what"] == str(STORY_KEPT)
    assert snap["state"]["story_from"] + len(snap["state"]["story"]) == state.story_count


SEAT = seat("c1", t=1, phase="driving", alert="secret", drives=[{"i": 4, "n": 1}])


def test_a_page_gets_its_own_seat_whole_and_those_of_others_in_short():
    state = run_state(scene())
    mine, theirs = PageFeed(state, "c1"), PageFeed(state, "c2")
    all_of(mine), all_of(theirs)
    state.take(SEAT)
    (line,) = all_of(mine)
    assert line["alert"] == "secret"
    (short,) = all_of(theirs)
    assert "alert" not in short
    assert (short["phase"], short["robots"]) == ("driving", [4])
    state.take(SEAT | {"t": 2, "drives": [{"i": 4, "n": 2}]})
    assert [m["t"] for m in all_of(mine)] == [2]
    assert all_of(theirs) == []  # nothing that others see of it is new


def test_lines_for_one_page_alone_are_bounded():
    feed = PageFeed(run_state(scene()), "c1")
    assert all(feed.put({"k": "pong", "at": n}) for n in range(OWN_KEPT))
    assert not feed.put({"k": "pong", "at": "too much"})
    assert [m["s"] for m in all_of(feed)] == list(range(1, OWN_KEPT + 2))


rows = st.dictionaries(st.integers(0, 5), st.integers(0, 3), max_size=6)


@given(st.lists(st.tuples(rows, st.booleans()), max_size=30))
def test_whenever_a_page_asks_it_then_knows_where_everybody_is(steps):
    state = run_state(scene())
    feed, here = PageFeed(state, "c1"), {}
    for t, (row, asks) in enumerate(steps):
        state.take(places(t, *([i, x, 0, 0, 0] for i, x in row.items())))
        if not asks:
            continue
        for message in all_of(feed):
            if message["k"] == "snap":
                here = {r[0]: r for r in message["state"]["pos"]}
            elif message["k"] == "d":
                here |= {r[0]: r for r in message["p"]}
                for index in message.get("gone", ()):
                    here.pop(index, None)
        assert here == {i: [i, x, 0, 0, 0] for i, x in row.items()}
