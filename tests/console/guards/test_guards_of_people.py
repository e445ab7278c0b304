"""People play guards: they get orders, answer, walk and say what they find, by messages."""

import math

import pytest
from helpers.console.simulated_phone import FIRE, PhonePage

from dva_sim.core.events import State
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.scenario import build, load

TWO_GUARDS = {
    "client": "g1",
    "guard__kind": {2: "person"},
    "guard__mobilisation_s": 3000,
    "robot__count": 0,
    "bystander__count": 0,
    "events": FIRE,
}


@pytest.fixture
def page(monkeypatch):
    """Two guards, the second of them a person's, nobody else who could go, and a fire."""
    return PhonePage(
        monkeypatch,
        **TWO_GUARDS,
        dispatch__policy="nearest_idle",
    )


def guard(page, number=2):
    return page.world.run.field.guards[number - 1]


def line(page, client="g1"):
    return next(x for x in reversed(page.lines_of("guard")) if x["seat"] == client)


def ordered(page):
    """Wait until the person's guard has an order; stand near the fire so that it is the nearest."""
    assert page.do("guard_join", guard="guard-2")[0]
    page.until(lambda: guard(page).order is not None)
    page.let(0.2)
    return line(page)["order"]


def event(page):
    return (
        next(iter(page.world.run.dva.core.events.open.values()), None)
        or list(page.world.run.dva.core.events.closed.values())[-1]
    )


def beside(page, order):
    """A free place near the one of an order."""
    for n in range(64):
        x = order["x_m"] + 1.5 * math.cos(n / 10)
        y = order["y_m"] + 1.5 * math.sin(n / 10)
        if page.do("guard_place", x_m=x, y_m=y)[0]:
            return x, y
    raise AssertionError("no place is free")


def test_the_scene_says_whom_people_may_play(page):
    things = {t["label"]: t for t in page.lines_of("scene")[0]["things"] if t["kind"] == "guard"}
    assert things["guard-2"]["person"] is True
    assert "person" not in things["guard-1"]


def test_only_a_guard_of_people_can_be_joined_and_by_one_alone(page):
    assert not page.do("guard_join", guard="guard-1")[0]
    assert not page.do("guard_join", guard="robot-1")[0]
    assert not page.do("guard_join", guard=7)[0]
    assert page.do("guard_join", guard="guard-2")[0]
    done, text = page.do("guard_join", guard="guard-2", client="g2")
    assert not done
    assert "Somebody else" in text
    assert page.do("guard_leave")[0]
    assert page.do("guard_join", guard="guard-2", client="g2")[0]
    assert line(page)["guard"] is None


def test_a_person_answers_goes_and_confirms_by_the_protocol_of_all_guards(page):
    order = ordered(page)
    assert order["kind"] == "fire"
    assert order["room"] == "North office"
    assert order["answered"] is False
    assert order["distance_m"] > 1
    assert len(order["way_m"]) >= 2
    assert page.do("guard_answer", accept=True, reason="")[0]
    page.let(0.5)
    assert line(page)["order"]["answered"] is True
    x, y = beside(page, order)
    page.let(0.5)
    assert guard(page).walking.place == pytest.approx((x, y), abs=0.05)
    assert event(page).times["departed"] > 0
    assert page.do("guard_say", what="arrived")[0]
    page.let(0.5)
    assert event(page).state is State.ON_SCENE
    done, text = page.do("guard_say", what="confirmed")
    assert done, text
    page.let(1.0)
    reported = event(page).times
    assert reported["departed"] <= reported["arrived"] <= reported["confirmed"]
    words = b"".join(x[2] for x in page.heard if x[0] == guard(page).device.id_tag)
    for word in (b"accepted", b"departed", b"arrived", b"confirmed", b"done"):
        assert word in words


def test_a_refuted_event_is_over(page):
    ordered(page)
    assert page.do("guard_say", what="refuted")[0]
    page.let(1.0)
    assert event(page).state is State.REFUTED
    assert line(page)["order"] is None


def test_what_is_declined_goes_to_others_and_the_reason_is_told(page):
    ordered(page)
    assert page.do("guard_answer", accept=False, reason="a broken <leg>")[0]
    page.let(2.0)
    assert line(page)["order"] is None
    assert any("a broken <leg>" in x["what"] for x in page.lines_of("story"))
    assert guard(page, 1)._protocol.order is not None


def test_where_nobody_sits_an_order_is_declined_after_half_a_minute(page):
    page.until(lambda: guard(page).order is not None)
    then = page.world.clock.now
    page.until(lambda: guard(page).order is None)
    assert 29.0 < page.world.clock.now - then < 32.0
    assert guard(page).activity == "nobody there"


def test_who_leaves_gives_its_order_back(page):
    ordered(page)
    assert page.do("guard_leave")[0]
    page.let(1.0)
    assert guard(page).order is None
    assert not guard(page).attended


def test_a_body_stands_where_the_person_says_and_others_see_it(page):
    assert page.do("guard_join", guard="guard-2")[0]
    post = guard(page).walking.place
    x, y = next(
        (x, y)
        for x in (post[0] + 1.0, post[0] - 1.0)
        for y in (post[1], post[1] + 1.0)
        if page.do("guard_place", x_m=x, y_m=y)[0]
    )
    page.let(2.5)
    at = {row[0]: row[1:3] for row in page.lines_of("pos")[-1]["p"]}
    number = line(page)["guard"]
    assert at[number] == [pytest.approx(100 * x, abs=3), pytest.approx(100 * y, abs=3)]
    known = page.world.run.dva.core.registry.entries[guard(page).device.id_tag].position
    frame = page.world.run.stage.site.frame
    assert frame.to_xy(known.latitude, known.longitude) == pytest.approx((x, y), abs=0.05)
    near = page.world.run.field.world.neighbours(x, y, 0.5)
    assert [body.name for body, _ in near] == ["guard-2"]


@pytest.mark.parametrize(
    ("x", "y"), [(math.nan, 1.0), (1e9, 1.0), (None, 2.0), ("1", 2.0), (True, 2.0), (10**400, 1)]
)
def test_a_place_that_is_none_is_refused(page, x, y):
    assert page.do("guard_join", guard="guard-2")[0]
    place = guard(page).walking.place
    assert not page.do("guard_place", x_m=x, y_m=y)[0]
    assert guard(page).walking.place == place


def test_nobody_stands_in_a_wall_or_in_somebody_else(page):
    assert page.do("guard_join", guard="guard-2")[0]
    x, y = guard(page, 1).walking.place
    done, text = page.do("guard_place", x_m=x, y_m=y)
    assert not done
    assert "person" in text
    assert page.do("guard_place", x_m=guard(page).x, y_m=guard(page).y)[0]


def test_a_person_reports_an_event(page):
    assert page.do("guard_join", guard="guard-2")[0]
    x, y = guard(page).walking.place
    before = len(page.world.run.dva.core.events.open)
    done, _ = page.do("guard_report", kind="gas_leak", x_m=x, y_m=y, severity="high")
    assert done
    page.let(0.5)
    found = [e for e in page.lines_of("events")[-1]["events"] if e["kind"] == "gas_leak"]
    assert len(page.world.run.dva.core.events.open) == before + 1
    assert found[0]["severity"] == "high"
    for wrong in ({"kind": "war"}, {"severity": 7}, {"x_m": math.inf}):
        about = {"kind": "fire", "x_m": x, "y_m": y, "severity": "low"} | wrong
        assert not page.do("guard_report", **about)[0]


def test_who_needs_help_is_seen_to(page):
    assert page.do("guard_join", guard="guard-2")[0]
    assert page.do("guard_say", what="help")[0]
    page.let(1.0)
    assert line(page)["doing"] == "needs help"
    assert any(b"needs help" in x[2] for x in page.heard if isinstance(x[2], bytes))
    assert page.do("guard_say", what="help")[0]
    page.let(1.0)
    assert line(page)["doing"] == "waiting"


def test_nothing_is_contained_from_afar(page):
    order = ordered(page)
    done, text = page.do("guard_say", what="contained")
    assert not done
    assert "m away" in text
    beside(page, order)
    assert page.do("guard_say", what="contained")[0]
    page.let(1.0)
    assert page.world.run.field.contained


def test_without_an_order_there_is_nothing_to_say(page):
    for what in ("guard_answer", "guard_say", "guard_place"):
        assert not page.do(what, accept=True, what="arrived", x_m=1, y_m=1)[0]
    assert page.do("guard_join", guard="guard-2")[0]
    assert not page.do("guard_answer", accept=True, reason="")[0]
    assert not page.do("guard_say", what="arrived")[0]
    assert not page.do("guard_say", what="sung")[0]
    assert not page.do("guard_answer", accept=True, reason="x" * 201)[0]


def test_operators_are_people_by_number(monkeypatch):
    page = PhonePage(monkeypatch, operator__count=3, operator__kind={1: "person", 3: "person"})
    page.are_open("p1", "p2")
    page.let(1.0)
    labels = {e.device.label for e in page.world.run.dva.core.registry.entries.values()}
    assert {"console-1", "console-2", "operator-2"} <= labels
    assert not {"operator-1", "operator-3"} & labels


@pytest.mark.parametrize("part", ["guard", "operator"])
def test_a_person_who_is_not_there_is_told(part):
    with pytest.raises(ConfigError, match="kind"):
        build(load("hands-on"), {f"{part}.kind": {9: "person"}})


def test_what_is_as_usual_is_not_written(monkeypatch):
    written = build(load("hands-on"), {}).model_dump(mode="json")
    assert "kind" not in written["guard"]
    assert "kind" not in written["operator"]


@pytest.fixture
def own_way(monkeypatch):
    """A guard whom a person plays, where Ana is asked about every event first."""
    page = PhonePage(
        monkeypatch,
        **TWO_GUARDS,
        dispatch__mode="ask_first",
        dispatch__decide_within_s=6000,
    )
    assert page.do("room_join", client="desk", name="Ana", role="dispatch")[0]
    page.until(lambda: page.world.rooms.listener.events)
    return page


def test_a_guard_who_goes_of_their_own_accord_has_the_order_and_nobody_else_is_sent(own_way):
    page = own_way
    assert page.do("guard_join", guard="guard-2")[0]
    assert event(page).state is State.PENDING
    done = page.ask("guard_go", event=1)
    assert (done["ok"], done["text"]) == (True, "you go to event 1")
    page.let(1.0)
    assert event(page).state is State.ASSIGNED
    assert event(page).responder == guard(page).device.id_tag
    assert line(page)["order"]["answered"] is True
    assert guard(page).activity == "getting ready"
    assert guard(page, 1).activity == "waiting"
    assert [room["label"] for room in page.world.rooms.entries()] == ["Ana"]  # theirs is gone
    assert page.do("guard_say", what="arrived")[0]
    page.let(1.0)
    assert event(page).state is State.ON_SCENE


def test_who_goes_of_their_own_accord_plays_a_guard_and_names_an_event(own_way):
    done = own_way.ask("guard_go", event=1)
    assert (done["ok"], done["text"]) == (False, "Choose which guard you are first.")
    assert own_way.do("guard_join", guard="guard-2")[0]
    assert own_way.ask("guard_go", event=77)["text"] == "there is no event 77"


def test_a_guard_goes_once_and_a_refusal_of_the_dva_is_told_in_words(own_way):
    page = own_way
    assert page.do("guard_join", guard="guard-2")[0]
    assert page.ask("guard_go", event=1)["ok"]
    page.let(1.0)
    assert page.ask("guard_go", event=1)["text"] == "You are sent to event 1 already."
    assert page.do("guard_say", what="refuted")[0]
    page.let(1.0)
    done = page.ask("guard_go", event=1)
    assert not done["ok"]
    assert done["text"].startswith("event 1 is refuted")
    assert guard(page).wanted == 0
