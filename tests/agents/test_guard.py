"""Guards following orders of the DVA.

The guard walks one metre a second, gets ready in 10 s, looks for 3 s and deals with an event in 20
s; its post is at (1.4, 12), the west end of a straight corridor.
"""

import math

import numpy as np
import pytest
from helpers.dva.scripted_dva import GUARD, POST, WALKER, PretendedDva

from dva_sim.agents.habits import GuardWorkHabits
from dva_sim.agents.people.guard import GuardAgent
from dva_sim.agents.people.guard_protocol import AWARD_WITHIN, MAX_ANNOUNCED, GuardProtocol
from dva_sim.agents.people.profiles import GuardProfile, Walker
from dva_sim.kernel.config import validate
from dva_sim.kernel.resources import find
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.protocol import messages as m
from dva_sim.worlds.hazards import CLEAR, KINDS, Conditions, make_hazard

STAND_OFF, STAND_BY_FOR = GuardWorkHabits().stands_off_m, GuardWorkHabits().stands_by_s
FAR, FARTHER, NEAR = (21.4, 12.0), (31.4, 12.0), (6.4, 12.0)  # 20, 30 and 5 m from the post [m]
WALLED_IN = (1000.0, 1000.0)  # no way leads there


@pytest.fixture
def dva() -> PretendedDva:
    return PretendedDva()


@pytest.fixture
def guard(dva: PretendedDva) -> GuardAgent:
    return dva.guard()


def at(guard: GuardAgent) -> tuple[float, float]:
    return guard.x, guard.y


# --- confirm ---------------------------------------------------------------------------


def test_a_guard_goes_there_looks_and_says_what_it_saw_before_it_says_done(dva, guard):
    for event, there, finding in ((1, {"fire"}, "confirmed"), (2, set(), "refuted")):
        dva.there = there
        assert dva.order(event, FAR) == m.OK
        dva.run_for(60.0)
        assert dva.progress(event) == ["departed", "arrived", finding, "done"]


def test_a_guard_sets_out_10_s_after_the_order_and_sees_a_place_from_2_m(dva, guard):
    start = dva.now
    dva.order(1, FAR)
    dva.run_for(60.0)
    assert dva.when(1, "departed") - start == pytest.approx(10.0, abs=0.1)
    assert dva.when(1, "arrived") - dva.when(1, "departed") == pytest.approx(18.0, abs=1.0)
    assert dva.when(1, "refuted") - dva.when(1, "arrived") == pytest.approx(3.0, abs=0.1)


def test_who_finds_no_way_says_so_and_waits(dva, guard):
    dva.order(1, WALLED_IN)
    dva.run_for(11.0)
    assert dva.progress(1) == ["failed"]
    assert guard.activity == "waiting"


def test_who_cannot_get_past_what_is_in_the_way_says_so_in_the_story_too(dva, guard):
    dva.order(1, FAR)
    dva.run_for(15.0)
    walk = guard.walking._walk
    assert walk is not None
    walk.blocked()
    dva.run_for(1.0)
    assert dva.progress(1) == ["departed", "failed"]
    story = [moment.what for moment in dva.stage.recorder.timeline]
    assert any("gives up" in what for what in story)


def test_only_the_dva_gives_orders(dva, guard):
    codes = []
    stranger = dva.stage.device("operator", 1)
    place = dva.position(FAR)
    for body in (
        m.Order(1, "fire", place, None),
        m.Relocation(place),
        m.TaskAnnouncement(1, "fire", place, 0.5, 2.0),
        m.TaskAward(1),
        m.OrderProgress(1, "done"),
    ):
        stranger.ask(GUARD, body, lambda reply: codes.append(reply.code))
    dva.run_for(60.0)
    assert codes == [m.NOT_PERMITTED] * 5
    assert at(guard) == POST
    assert dva.received == []


def test_a_guard_drives_no_robots(dva, guard):
    body = m.Order(1, "fire", dva.position(FAR), "02:00:00:01:00:01")
    assert dva.say(GUARD, body) == m.NOT_SUPPORTED


# --- the newest order holds ------------------------------------------------------------


def test_a_newer_order_takes_the_place_of_the_older_of_which_nothing_more_is_said(dva, guard):
    dva.order(1, FARTHER)
    dva.run_for(20.0)
    assert dva.order(2, NEAR) == m.OK
    dva.run_for(60.0)
    assert dva.progress(1) == ["departed"]
    assert dva.progress(2) == ["departed", "arrived", "refuted", "done"]


def test_who_is_under_way_already_need_not_get_ready_again(dva, guard):
    dva.order(1, FARTHER)
    dva.run_for(20.0)
    start = dva.now
    dva.order(2, FAR)
    dva.run_for(1.0)
    assert dva.when(2, "departed") - start < 0.1


def test_who_is_getting_ready_when_a_newer_order_comes_goes_on_getting_ready(dva, guard):
    start = dva.now
    dva.order(1, FARTHER)
    dva.run_for(6.0)
    dva.order(2, FAR)
    dva.run_for(20.0)
    assert dva.when(2, "departed") - start == pytest.approx(10.0, abs=0.1)
    assert dva.progress(1) == []


def test_the_same_order_again_is_answered_ok_and_changes_nothing(dva, guard):
    dva.order(1, FAR)
    for _ in range(5):
        dva.run_for(4.0)
        assert dva.order(1, FAR) == m.OK
    dva.run_for(60.0)
    assert dva.progress(1) == ["departed", "arrived", "refuted", "done"]
    assert dva.when(1, "departed") < 12.0


def test_a_number_that_is_given_to_another_event_makes_another_order(dva, guard):
    """A DVA that could write nothing and was killed gives the same numbers again."""
    dva.order(1, FAR)
    dva.run_for(15.0)
    assert dva.order(1, NEAR) == m.OK
    dva.run_for(40.0)
    assert dva.progress(1)[-3:] == ["arrived", "refuted", "done"]
    assert at(guard) == pytest.approx(NEAR, abs=2.5)


def test_the_newest_order_holds_even_for_who_is_at_work_at_an_event(dva, guard):
    dva.there = {"fire"}
    dva.order(1, NEAR, "contain")
    dva.run_until(lambda: guard.activity == "containing")
    assert dva.order(2, FAR) == m.OK
    dva.run_for(100.0)
    assert dva.contained == []
    assert dva.progress(1) == ["departed", "arrived"]
    assert dva.progress(2) == ["departed", "arrived", "confirmed", "done"]


def test_who_is_called_away_while_looking_says_nothing_of_what_it_sees(dva, guard):
    dva.order(1, NEAR)
    dva.run_until(lambda: guard.activity == "looking")
    dva.order(2, FAR)
    dva.run_for(60.0)
    assert dva.progress(1) == ["departed", "arrived"]
    assert dva.progress(2) == ["departed", "arrived", "refuted", "done"]


def test_an_order_that_the_dva_calls_over_is_given_up_without_a_word(dva, guard):
    dva.order(1, FARTHER)
    dva.run_for(20.0)
    assert dva.say(GUARD, m.OrderProgress(2, "done")) == m.OK
    assert guard.activity == "walking"
    assert dva.say(GUARD, m.OrderProgress(1, "done")) == m.OK
    here = at(guard)
    dva.run_for(60.0)
    assert math.dist(at(guard), here) < 0.6  # who walks 1 m/s needs half a metre to stand
    assert guard.activity == "waiting"
    assert dva.progress(1) == ["departed"]


def test_a_guard_can_do_the_same_again_once_it_is_done(dva, guard):
    for _ in range(2):
        dva.order(1, NEAR)
        dva.run_for(60.0)
    assert dva.progress(1) == ["departed", "arrived", "refuted", "done"] * 2


# --- stand by, and contain -------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_nobody_who_stands_by_is_in_danger_a_metre_and_a_half_too_near(kind):
    hazard = make_hazard(kind, (0.0, 0.0), 0.0)
    assert max(hazard.danger_radius(10.0 * t) for t in range(720)) + 1.5 < STAND_OFF


def test_who_stands_by_stops_10_m_before_the_place_and_reports_its_departure_only(dva, guard):
    dva.order(1, FARTHER, "stand_by")
    dva.run_for(120.0)
    assert guard.activity == "standing by"
    assert STAND_OFF - 1.0 < math.dist(at(guard), FARTHER) <= STAND_OFF
    assert dva.progress(1) == ["departed"]


def test_who_has_looked_from_near_and_shall_stand_by_goes_back_the_way_to_its_post(dva, guard):
    dva.order(1, FARTHER)
    dva.run_for(60.0)
    dva.order(1, FARTHER, "stand_by")
    dva.run_for(20.0)
    assert guard.activity == "standing by"
    assert STAND_OFF <= math.dist(at(guard), FARTHER) < STAND_OFF + 1.0


def test_who_stands_by_and_shall_contain_goes_at_once(dva, guard):
    dva.there = {"fire"}
    dva.order(1, FARTHER, "stand_by")
    dva.run_for(60.0)
    start = dva.now
    assert dva.order(1, FARTHER, "contain") == m.OK
    dva.run_for(60.0)
    assert dva.progress(1) == ["departed", "departed", "arrived", "contained", "done"]
    assert dva.when(1, "arrived") - start == pytest.approx(7.0, abs=1.0)
    assert dva.when(1, "contained") - dva.when(1, "arrived") == pytest.approx(20.0, abs=0.1)
    assert dva.contained == [("fire", pytest.approx(FARTHER, abs=1e-6))]


def test_who_has_confirmed_and_shall_contain_stands_there_already(dva, guard):
    dva.there = {"fire"}
    dva.order(1, FAR)
    dva.run_until(lambda: "done" in dva.progress(1))
    start = dva.now
    dva.order(1, FAR, "contain")
    dva.run_for(30.0)
    assert dva.when(1, "contained") - start == pytest.approx(20.0, abs=0.1)


def test_who_has_confirmed_and_shall_go_elsewhere_gets_ready_again(dva, guard):
    dva.order(1, FAR)
    dva.run_until(lambda: "done" in dva.progress(1))
    start = dva.now
    dva.order(2, FARTHER)
    dva.run_for(30.0)
    assert dva.when(2, "departed") - start == pytest.approx(10.0, abs=0.1)


def test_who_finds_nothing_to_contain_looks_and_refutes(dva, guard):
    dva.order(1, FAR, "contain")
    dva.run_for(60.0)
    assert dva.progress(1) == ["departed", "arrived", "refuted", "done"]
    assert dva.when(1, "refuted") - dva.when(1, "arrived") == pytest.approx(3.0, abs=0.1)
    assert dva.contained == []


def test_who_stands_by_for_a_quarter_of_an_hour_without_a_word_gives_up(dva, guard):
    dva.order(1, FAR, "stand_by")
    dva.run_for(30.0 + STAND_BY_FOR)
    assert dva.progress(1) == ["departed", "failed"]
    assert guard.activity == "waiting"


def test_who_has_stood_by_once_does_not_give_up_what_it_does_later(dva, guard):
    dva.order(1, FARTHER, "stand_by")
    dva.run_for(60.0)
    dva.order(1, FARTHER, "contain")
    dva.run_for(800.0)
    dva.order(2, FARTHER, "stand_by")
    dva.run_for(300.0)
    assert dva.progress(1) == ["departed", "departed", "arrived", "refuted", "done"]
    assert (dva.progress(2), guard.activity) == (["departed"], "standing by")


# --- wait elsewhere --------------------------------------------------------------------


def test_an_idle_guard_that_is_relocated_walks_there_and_waits(dva, guard):
    place = dva.position(FAR)
    assert dva.say(GUARD, m.Relocation(place)) == m.OK
    assert guard.activity == "getting ready"
    dva.run_for(60.0)
    assert at(guard) == pytest.approx(FAR, abs=0.2)
    assert guard.activity == "waiting"
    assert dva.received == []


def test_a_guard_tells_where_it_is_while_it_moves(dva, guard):
    seen = []
    hear = lambda data: seen.append(dva.device.read(data).body.activity)  # noqa: E731
    dva.network.subscribe(dva.device.id_tag, GUARD, "status|", hear)
    dva.say(GUARD, m.Relocation(dva.position(FAR)))
    dva.run_for(60.0)
    assert list(dict.fromkeys(seen)) == ["getting ready", "walking", "waiting"]


def test_who_stands_there_already_does_not_even_get_ready(dva, guard):
    assert dva.say(GUARD, m.Relocation(dva.position((POST[0] + 0.9, POST[1])))) == m.OK
    assert guard.activity == "waiting"
    assert dva.say(GUARD, m.Relocation(dva.position((POST[0] + 1.1, POST[1])))) == m.OK
    assert guard.activity == "getting ready"


def test_a_guard_with_an_order_is_not_relocated(dva, guard):
    dva.order(1, FAR, "stand_by")
    assert dva.say(GUARD, m.Relocation(dva.position(NEAR))) == m.BUSY


def test_an_order_interrupts_a_relocation_and_the_newest_relocation_holds(dva, guard):
    dva.say(GUARD, m.Relocation(dva.position(FARTHER)))
    dva.run_for(15.0)
    assert dva.say(GUARD, m.Relocation(dva.position(FAR))) == m.OK
    dva.run_for(5.0)
    start = dva.now
    assert dva.order(1, NEAR) == m.OK
    dva.run_for(60.0)
    assert dva.when(1, "departed") - start < 0.1
    assert dva.progress(1)[-1] == "done"
    assert math.dist(at(guard), NEAR) <= 2.0 + 0.6  # seen from 2 m, and then to stand


# --- auctions --------------------------------------------------------------------------


def test_an_idle_guard_bids_what_guards_usually_need_to_get_ready_and_its_own_way(dva, guard):
    assert dva.announce(7, FAR) == m.OK
    [bid] = dva.bids()
    assert (bid.event_id, bid.arrival_in) == (7, pytest.approx(12.0 + 20.0, abs=0.5))


def test_who_is_under_way_to_another_post_bids_the_way_alone(dva, guard):
    dva.say(GUARD, m.Relocation(dva.position(FARTHER)))
    dva.run_for(20.0)
    dva.announce(7, FARTHER)
    left = math.dist(at(guard), FARTHER)
    assert dva.bids()[0].arrival_in == pytest.approx(left, abs=0.7)


def test_who_has_an_order_or_no_way_hears_of_an_auction_and_bids_nothing(dva, guard):
    assert dva.announce(7, WALLED_IN) == m.OK
    dva.order(1, FARTHER)
    assert dva.announce(8, FAR) == m.OK
    assert dva.bids() == []


def test_an_award_is_an_order_to_look_at_what_was_announced(dva, guard):
    dva.announce(7, FAR)
    assert dva.say(GUARD, m.TaskAward(7)) == m.OK
    assert dva.say(GUARD, m.TaskAward(7)) == m.OK  # said again
    dva.run_for(60.0)
    assert dva.progress(7) == ["departed", "arrived", "refuted", "done"]


def test_an_award_of_what_was_never_announced_is_refused(dva, guard):
    assert dva.say(GUARD, m.TaskAward(7)) == m.UNKNOWN_EVENT
    assert guard.activity == "waiting"


def test_an_award_is_no_reason_to_leave_an_order(dva, guard):
    dva.announce(7, FAR)
    dva.order(1, NEAR)
    assert dva.say(GUARD, m.TaskAward(7)) == m.BUSY
    dva.run_for(60.0)
    assert dva.progress(1)[-1] == "done"


# --- what is too much ------------------------------------------------------------------

FIRE_AT = 20.0  # the east half of the corridor burns from then on [s]


def hot(x: float, y: float, now: float) -> Conditions:
    return CLEAR._replace(heat_flux=4.0) if x > 15.0 and now > FIRE_AT else CLEAR


def test_who_comes_into_heat_tells_failed_and_goes_back_to_its_post(dva):
    guard = dva.guard(air=hot)
    dva.order(1, FARTHER, "contain")
    dva.run_until(lambda: guard.activity == "withdrawing")
    assert dva.progress(1) == ["departed", "failed"]
    assert guard.x == pytest.approx(15.5, abs=1.0)
    assert dva.order(2, NEAR) == m.BUSY
    dva.run_for(30.0)
    assert (guard.activity, dva.order(2, NEAR)) == ("waiting", m.OK)
    assert math.dist(at(guard), POST) < 1.0
    assert 0.0 < guard.dose.heat < 0.3


def test_who_was_to_look_and_is_driven_back_in_sight_of_it_has_seen_enough(dva):
    guard = dva.guard(air=hot)
    dva.there = {"fire"}
    dva.order(1, FAR)
    dva.run_for(60.0)
    assert dva.progress(1) == ["departed", "confirmed", "done"]
    assert math.dist(at(guard), POST) < 1.0


def test_who_was_to_look_and_sees_nothing_there_has_failed(dva):
    dva.guard(air=hot)
    dva.order(1, FAR)
    dva.run_for(60.0)
    assert dva.progress(1) == ["departed", "failed"]


@pytest.mark.parametrize(
    ("kind", "depth", "expected"),
    [
        ("gas_leak", 2.9, ["departed", "confirmed", "done"]),
        ("gas_leak", 3.1, ["departed", "failed"]),
        ("flood", 3.1, ["departed", "failed"]),
        ("fire", 3.1, ["departed", "confirmed", "done"]),
    ],
)
def test_who_is_driven_back_has_seen_a_fire_by_its_smoke_and_nothing_else_through_it(
    dva, kind, depth, expected
):
    dva.guard(air=hot, smoke=lambda a, b: depth)
    dva.there = {kind}
    dva.say(GUARD, m.Order(1, kind, dva.position(FAR), None))
    dva.run_for(60.0)
    assert dva.progress(1) == expected


def test_no_guard_walks_through_a_door_behind_which_nobody_survives(dva):
    def furnace(x: float, y: float, now: float) -> Conditions:
        return CLEAR._replace(temperature=300.0) if x > 15.0 else CLEAR

    guard = dva.guard(air=furnace)
    dva.order(1, FARTHER, "contain")
    dva.run_until(lambda: guard.activity == "withdrawing")
    assert 13.0 < guard.x < 15.0
    dva.run_for(30.0)
    assert (guard.activity, guard.dose.heat) == ("waiting", 0.0)
    assert dva.progress(1) == ["departed", "failed"]


def test_flames_keep_no_guard_from_where_the_stream_reaches_them(dva):
    """Within 2 m of a fire it is deadly; an extinguisher carries 3 m, half a metre is braking."""

    def flames(x: float, y: float, now: float) -> Conditions:
        return CLEAR._replace(heat_flux=20.0 if x > FARTHER[0] - 2.0 else 0.0)

    dva.guard(air=flames)
    dva.there = {"fire"}
    dva.order(1, FARTHER, "contain")
    dva.run_for(90.0)
    assert dva.progress(1) == ["departed", "arrived", "contained", "done"]


def test_a_guard_whose_way_out_turns_bad_turns_round(dva):
    """Its post, in the west, becomes unbearable when it is half way back to it."""

    def air(x: float, y: float, now: float) -> Conditions:
        bad = x > 15.0 if now < 30.0 else x < 6.0
        return CLEAR._replace(heat_flux=4.0) if bad and now > FIRE_AT else CLEAR

    guard = dva.guard(air=air, refuges=[(38.0, 12.0)])
    dva.order(1, FARTHER)
    dva.run_until(lambda: guard.activity == "withdrawing")
    dva.run_for(60.0)
    assert guard.activity == "waiting"
    assert math.dist(at(guard), (38.0, 12.0)) < 1.0
    assert guard.dose.heat < 0.3


def test_an_exit_in_smoke_is_a_way_out_beyond_which_the_air_is_clean(dva):
    smoky = CLEAR._replace(extinction=3.0, co=1000.0)
    guard = dva.guard(air=lambda x, y, now: smoky if now > FIRE_AT else CLEAR, refuges=[NEAR])
    dva.run_for(60.0)
    assert (guard.activity, dva.order(2, NEAR)) == ("waiting", m.OK)
    assert math.dist(at(guard), NEAR) < 1.0
    breathed = guard.dose.toxic
    dva.run_for(5.0)
    assert guard.dose.toxic == breathed > 0.0


def test_a_guard_whose_post_burns_goes_to_another_refuge(dva):
    guard = dva.guard(air=lambda x, y, now: hot(20.0 - x, y, now), refuges=[POST, (38.0, 12.0)])
    dva.run_for(90.0)
    assert guard.activity == "waiting"
    assert math.dist(at(guard), (38.0, 12.0)) < 1.0


def test_who_is_hurt_takes_no_order_any_more_and_offers_nothing(dva):
    guard = dva.guard(air=lambda x, y, now: CLEAR._replace(co=4000.0 if x > 5.0 else 0.0))
    guard.dose.toxic = 0.299
    dva.order(1, FARTHER)
    dva.run_for(60.0)
    assert guard.dose.toxic > 0.3
    assert guard.activity == "hurt"
    assert dva.progress(1) == ["departed", "failed"]
    assert dva.order(2, NEAR) == dva.announce(3, NEAR) == m.BUSY
    assert dva.bids() == []


def test_who_is_incapacitated_stays_where_it_is_and_its_order_has_failed(dva):
    guard = dva.guard(air=lambda x, y, now: CLEAR._replace(heat_flux=80.0 if now > 20.0 else 0.0))
    dva.order(1, FARTHER)
    dva.run_for(40.0)
    assert guard.activity == "incapacitated"
    assert guard.dose.incapacitated
    assert dva.progress(1) == ["departed", "failed"]
    here = at(guard)
    dva.run_for(60.0)
    assert at(guard) == here
    assert dva.order(2, NEAR) == m.BUSY


def test_the_end_of_an_order_is_heard_by_who_takes_none(dva):
    dva.guard(air=hot)
    dva.order(1, FARTHER, "contain")
    dva.run_for(30.0)
    assert dva.say(GUARD, m.OrderProgress(1, "done")) == m.OK


# --- who they are ----------------------------------------------------------------------


def test_nine_guards_in_ten_have_set_out_after_80_s():
    """NFPA 1710: turnout within 80 s in 90 % of all cases; within 3 %."""
    file = load_yaml(find("guard", "agents/people"))
    profile = validate(GuardProfile, file.data, file.error)
    rng = np.random.default_rng(1)
    drawn = [Walker.draw(profile, rng).mobilisation for _ in range(20_000)]
    assert np.quantile(drawn, 0.9) == pytest.approx(80.0, rel=0.03)


def test_guards_walk_as_fast_as_weidmann_found_within_three_per_cent():
    rng = np.random.default_rng(1)
    speeds = [Walker.draw(GuardProfile(), rng).speed for _ in range(20_000)]
    assert np.mean(speeds) == pytest.approx(1.34, rel=0.03)
    assert np.std(speeds) == pytest.approx(0.26, rel=0.03)


# --- the decider alone -----------------------------------------------------------------


def decide(duty: GuardProtocol, body: m.Body, now: float = 0.0) -> int:
    return duty.handle(m.Message(GUARD, 1, duty.dva, "12:00:00", 0, body), now).code


def announcement(event: int) -> m.TaskAnnouncement:
    return m.TaskAnnouncement(event, "fire", m.Position(0.0, 0.0), 0.5, 2.0)


def test_an_announcement_is_forgotten_a_minute_after_the_time_for_bids():
    for wait, code in ((2.0 + AWARD_WITHIN, m.OK), (2.1 + AWARD_WITHIN, m.UNKNOWN_EVENT)):
        duty = GuardProtocol("02:00:00:00:00:01", 10.0)
        decide(duty, announcement(7))
        assert decide(duty, m.TaskAward(7), wait) == code


def test_of_many_announcements_the_newest_32_are_remembered():
    duty = GuardProtocol("02:00:00:00:00:01", 10.0)
    for event in range(1, 1001):
        decide(duty, announcement(event))
    assert MAX_ANNOUNCED == 32
    assert decide(duty, m.TaskAward(968)) == m.UNKNOWN_EVENT
    assert decide(duty, m.TaskAward(969)) == m.OK


def test_how_a_guard_walks_and_looks_does_not_depend_on_how_long_it_would_contain():
    usual = GuardProfile()
    slow = usual.model_copy(
        update={"extinguish_s": usual.contain_s.model_copy(update={"median": 9e9})}
    )
    one, other = (Walker.draw(p, np.random.default_rng(3)) for p in (usual, slow))
    assert (one.speed, one.mobilisation, one.look) == (other.speed, other.mobilisation, other.look)
    assert one.usual_mobilisation == WALKER.usual_mobilisation + 33.0 == 45.0
