"""People who work at a site and leave it when the alarm sounds or danger shows."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from helpers.worlds.hall_with_people import People, hall, two_rooms

from dva_sim.agents.habits import LeavingHabits
from dva_sim.agents.people import evacuation
from dva_sim.agents.people.bystander import START_GAP_M, BystanderAgent, draw_places, nothing_seen
from dva_sim.agents.people.evacuation import (
    PERIOD,
    UNTENABLE,
    choose_escape,
    clean_air,
    refuges_of,
    strain,
)
from dva_sim.agents.people.profiles import BystanderProfile, Occupant
from dva_sim.agents.population import Trait
from dva_sim.kernel.config import validate
from dva_sim.kernel.resources import find
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.worlds.hazards import CLEAR, Surroundings, make_hazard, pace_in_smoke, pace_in_water
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import load_site

LEAVING = LeavingHabits()
EAST, WEST = (39.0, 1.5), (1.0, 1.5)
SPEED, PREMOVEMENT = 1.2, 20.0


class Building(People):
    """A corridor of 40 m with a way out at each end, and some bystanders."""

    def __init__(self, site=None, refuges=(EAST, WEST)) -> None:
        super().__init__(site or hall(40, 3))
        self.refuges, self.story, self.bystanders = refuges, [], []

    def bystander(
        self,
        place=(10.0, 1.5),
        places=None,
        moves: bool = False,
        air: Callable = clean_air,
        sees: Callable = nothing_seen,
        premovement: float = PREMOVEMENT,
        speed: float = SPEED,
    ) -> BystanderAgent:
        walking = self.add(place, speed=speed)
        made = BystanderAgent(
            f"bystander-{len(self.bystanders) + 1}",
            self.clock,
            Occupant(speed, premovement, moves, Trait(median=30.0)),
            walking,
            planner=self.planner,
            places=places or [place],
            refuges=self.refuges,
            rng=np.random.default_rng(len(self.bystanders)),
            air=air,
            sees=sees,
            leaves=lambda: self.world.remove(walking.body),
            tell=self.story.append,
        )
        made.start()
        self.bystanders.append(made)
        return made

    def pass_time(self, until: float) -> None:
        self.run_until(lambda: False, until)


def from_then_on(start, conditions, where=lambda x, y: True):
    def air(x, y, time):
        return conditions if time >= start and where(x, y) else CLEAR

    return air


@pytest.fixture
def building() -> Building:
    return Building()


# --- alarm -----------------------------------------------------------------------------


def test_who_hears_the_alarm_gets_ready_walks_to_the_nearer_exit_and_is_out(building):
    one = building.bystander((10.0, 1.5))
    building.pass_time(5.0)
    assert one.activity == "working"
    one.alarm(5.0)
    building.pass_time(24.9)
    assert (one.activity, one.leaves_at) == ("alarmed", 25.0)
    building.pass_time(27.0)
    assert one.activity == "evacuating"
    building.pass_time(60.0)
    assert one.activity == "safe"
    assert math.dist((one.x, one.y), WEST) < LEAVING.through_m
    assert building.story == ["leaves", "is out"]
    assert building.world.people == []


def test_the_time_to_get_out_of_an_empty_corridor_is_premovement_and_distance_by_speed():
    """The bound of hand calculation, for twenty people who each walk alone."""
    rng, profile = np.random.default_rng(5), BystanderProfile()
    late = []
    for _ in range(8):
        who = Occupant.draw(profile, rng)
        building = Building()
        one = building.bystander((15.0, 1.5), speed=who.speed, premovement=who.premovement)
        one.alarm(0.0)
        building.run_until(lambda: one.activity == "safe", 600.0)  # noqa: B023
        late.append(one.out_at - (who.premovement + (14.0 - LEAVING.through_m) / who.speed))
    assert min(late) > -0.3  # nobody is faster than possible, but for one look in five a second
    assert max(late) < 2.5
    assert np.mean(late) < 1.5


def test_a_second_alarm_makes_nobody_later_or_earlier(building):
    one = building.bystander()
    one.alarm(0.0)
    building.pass_time(10.0)
    one.alarm(10.0)
    assert one.leaves_at == 20.0


@pytest.mark.system
def test_25_people_in_a_room_need_the_time_that_its_door_takes_and_no_less():
    """1.2 m: SFPE's 1.3 persons/s per metre of 0.9 m would be 21 s, 1.9 per metre of 1.2 m 11 s."""
    building = Building(two_rooms(1.2, width=9.0, height=7.0), refuges=[(8.0, 3.5)])
    rng = np.random.default_rng(3)
    spots = [(x, y) for x in np.arange(0.5, 4.2, 0.6) for y in np.arange(0.5, 6.6, 0.6)]
    people = [
        building.bystander(spots[i], premovement=1.0, speed=float(rng.normal(1.34, 0.2)))
        for i in rng.permutation(len(spots))[:25]
    ]
    for one in people:
        one.alarm(0.0)
    building.run_until(lambda: all(p.activity == "safe" for p in people), 120.0)
    last = max(p.out_at for p in people)
    assert 11.0 < last < 21.0 + 10.0


# --- what they notice themselves -------------------------------------------------------


@pytest.mark.parametrize(
    "conditions",
    [
        CLEAR._replace(extinction=0.2),
        CLEAR._replace(heat_flux=0.7),
        CLEAR._replace(water=0.05),
        CLEAR._replace(temperature=45.0),
        CLEAR._replace(gas=0.0034, explosive=0.2),  # propane
        CLEAR._replace(gas=0.0088, explosive=0.2),  # methane
    ],
)
def test_who_notices_smoke_heat_water_or_the_smell_of_gas_gets_ready_without_an_alarm(
    building, conditions
):
    one = building.bystander(air=from_then_on(4.0, conditions))
    building.pass_time(10.0)
    assert one.activity == "alarmed"
    assert one.leaves_at == pytest.approx(4.0 + PREMOVEMENT, abs=PERIOD)
    assert building.story == ["notices danger"]


def test_who_feels_a_fire_waits_for_nothing(building):
    one = building.bystander(air=from_then_on(4.0, CLEAR._replace(heat_flux=1.2)))
    building.pass_time(6.0)
    assert one.activity == "evacuating"
    assert one.leaves_at == pytest.approx(4.0, abs=PERIOD)


def test_who_sees_flames_gets_ready_and_nobody_smells_carbon_monoxide(building):
    poisoned = from_then_on(0.0, CLEAR._replace(co=900.0))
    one = building.bystander((10.0, 1.5), air=clean_air)
    two = building.bystander((20.0, 1.5), air=poisoned)
    three = building.bystander((30.0, 1.5), air=poisoned, sees=lambda x, y, now: now >= 3.0)
    building.pass_time(6.0)
    assert [p.activity for p in (one, two, three)] == ["working", "working", "alarmed"]


def test_who_cannot_bear_it_leaves_at_once(building):
    one = building.bystander(air=from_then_on(4.0, CLEAR._replace(heat_flux=3.0)))
    building.pass_time(5.0)
    assert one.activity == "evacuating"


# --- the way out -----------------------------------------------------------------------


def test_the_nearer_exit_is_not_taken_through_what_nobody_endures(building):
    fire = from_then_on(0.0, CLEAR._replace(heat_flux=9.0), lambda x, y: x < 6.0)
    one = building.bystander((10.0, 1.5), air=fire)
    one.alarm(0.0)
    building.pass_time(70.0)
    assert one.activity == "safe"
    assert math.dist((one.x, one.y), EAST) < LEAVING.through_m
    assert one.dose.heat == 0.0


def test_who_finds_the_way_ahead_become_so_turns_round(building):
    fire = from_then_on(24.0, CLEAR._replace(heat_flux=9.0), lambda x, y: x < 3.0)
    one = building.bystander((10.0, 1.5), air=fire)
    one.alarm(0.0)
    building.pass_time(90.0)
    assert math.dist((one.x, one.y), EAST) < LEAVING.through_m
    assert one.dose.heat == 0.0


def test_a_bad_place_is_walked_around_where_there_is_room():
    planner = Planner(hall(20, 10), 0.3)

    def is_bad(at):
        return math.dist(at, (10.0, 5.0)) < 1.5

    escape = choose_escape(planner, (2.0, 5.0), [(18.0, 5.0)], [is_bad])
    way = planner.path((2.0, 5.0), escape.goal, escape.avoid)
    assert escape.avoid
    assert not any(is_bad(at) for at in way)


def test_who_has_no_good_way_takes_the_nearest_that_is_not_deadly_and_else_waits():
    planner = Planner(hall(20, 10), 0.3)
    refuges = [(18.0, 5.0), (8.0, 5.0)]

    def bad(at):
        return at[0] > 5.0

    def deadly(at):
        return 5.5 < at[0] < 8.5

    escape = choose_escape(planner, (2.0, 5.0), refuges, [bad, lambda at: False])
    assert (escape.goal, escape.avoid) == ((8.0, 5.0), ())
    assert choose_escape(planner, (2.0, 5.0), refuges, [bad, deadly]) is None
    assert choose_escape(planner, (2.0, 5.0), [(500.0, 5.0)], [lambda at: False]) is None


def test_nobody_walks_through_flames_to_get_out_of_smoke():
    planner = Planner(hall(20, 10), 0.3)

    def flames(at):
        return math.dist(at, (10.0, 5.0)) < 1.5

    escape = choose_escape(planner, (2.0, 5.0), [(18.0, 5.0)], [lambda at: at[0] > 3.0, flames])
    way = planner.path((2.0, 5.0), escape.goal, escape.avoid)
    assert not any(flames(at) for at in way)


def test_nobody_sets_out_through_air_that_gets_worse_though_all_of_it_is_bad():
    """4 kW/m2 and more all the way east, more and more up to a fire; an exit in the west too."""
    planner = Planner(hall(40, 3), 0.3)

    def heat(at):
        return 1.0 + 0.1 * at[0]

    near, far = (39.0, 1.5), (1.0, 1.5)
    assert choose_escape(planner, (32.0, 1.5), [near], [heat, lambda at: False]).goal == near
    assert choose_escape(planner, (32.0, 1.5), [near, far], [heat, heat]).goal == far
    assert choose_escape(planner, (32.0, 1.5), [near], [heat, heat]) is None


def test_what_is_deadly_is_not_skipped_by_who_stands_in_thicker_smoke():
    planner = Planner(hall(40, 3), 0.3)

    def smoke(at):
        return 8.0

    def flames(at):
        return math.dist(at, (36.0, 1.5)) < 2.0

    east, west = (39.0, 1.5), (1.0, 1.5)
    assert choose_escape(planner, (32.0, 1.5), [east, west], [smoke, flames]).goal == west
    assert choose_escape(planner, (32.0, 1.5), [east], [smoke, flames]) is None


def test_an_exit_within_10_m_is_taken_through_smoke_that_gets_no_thicker():
    planner = Planner(hall(40, 3), 0.3)
    refuges = [(39.0, 1.5), (1.0, 1.5)]

    def smoke(at):
        return at[0] > 12.0

    assert choose_escape(planner, (30.0, 1.5), refuges, [smoke]).goal == (39.0, 1.5)
    strict = [smoke, lambda at: False]
    assert choose_escape(planner, (30.0, 1.5), refuges, strict).goal == (39.0, 1.5)
    assert choose_escape(planner, (26.0, 1.5), refuges, strict).goal == (1.0, 1.5)


def test_who_has_no_way_left_stands_still_and_leaves_when_there_is_one_again(building):
    """Flames on both sides from 23 to 60 s."""
    burns = CLEAR._replace(temperature=150.0, heat_flux=20.0)

    def air(x, y, time):
        return burns if 23.0 <= time < 60.0 and abs(x - 10.0) > 6.0 else CLEAR

    one = building.bystander((10.0, 1.5), air=air)
    one.alarm(0.0)
    building.pass_time(30.0)
    here = one.x
    assert (one.activity, one.walking.walks) == ("evacuating", False)
    building.pass_time(59.0)
    assert one.x == pytest.approx(here, abs=0.05)
    building.pass_time(60.0 + LEAVING.at_latest_s + 20.0)
    assert (one.activity, one.dose.heat) == ("safe", 0.0)


def test_who_is_trapped_looks_for_a_way_after_2_4_8_and_then_every_16_seconds(monkeypatch):
    building, tries = Building(), []
    monkeypatch.setattr(evacuation, "choose_escape", lambda *_: tries.append(building.clock.now))
    one = building.bystander((10.0, 1.5), premovement=1.0)
    one.alarm(0.0)
    building.pass_time(70.0)
    assert np.diff(tries).tolist() == pytest.approx([2.0, 4.0, 8.0, 16.0, 16.0, 16.0])


def test_who_stands_in_smoke_may_go_through_it_to_clean_air():
    planner = Planner(hall(20, 3), 0.3)
    escape = choose_escape(
        planner, (5.0, 1.5), [(18.0, 1.5), (1.0, 1.5)], [lambda at: 4 < at[0] < 9]
    )
    assert escape.goal == (1.0, 1.5)


@pytest.mark.parametrize("what", sorted(set(CLEAR._fields) - {"gas"}))
def test_each_of_the_conditions_alone_can_be_too_much(what):
    assert strain(CLEAR, UNTENABLE) < 1.0
    most = getattr(UNTENABLE, what)
    assert strain(CLEAR._replace(**{what: most}), UNTENABLE) >= 1.0
    assert strain(CLEAR._replace(**{what: 0.99 * most}), UNTENABLE) < 1.0


@pytest.mark.parametrize(("gas", "limit"), [("methane", 0.044), ("propane", 0.017)])
def test_nobody_stays_where_the_gas_that_leaks_could_explode(gas, limit):
    """ISO/IEC 80079-20-1: the same share of two gases is harmless or not."""
    site = load_site("caparica")
    around = Surroundings(site, [make_hazard("gas_leak", (5.0, 12.0), 0.0, gas=gas)])
    for time in range(10, 1200, 10):
        air = around.at(5.0, 12.0, time)
        assert air.explosive == pytest.approx(air.gas / limit)
        assert (strain(air, UNTENABLE) >= 1.0) == (air.gas / limit >= 1.0)
    assert air.gas > 0.005


# --- dose and pace ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("conditions", "pace"),
    [
        (CLEAR._replace(extinction=0.9), pace_in_smoke(0.9)),
        (CLEAR._replace(water=0.3), pace_in_water(0.3)),
        (CLEAR._replace(extinction=0.9, water=0.3), pace_in_smoke(0.9) * pace_in_water(0.3)),
    ],
)
def test_smoke_and_water_slow_people_down_by_the_share_that_hazards_say(building, conditions, pace):
    one = building.bystander(air=from_then_on(0.0, conditions))
    one.alarm(0.0)
    building.run_until(lambda: one.activity == "safe", 200.0)
    assert one.out_at == pytest.approx(
        PREMOVEMENT + (9.0 - LEAVING.through_m) / (SPEED * pace), rel=0.1
    )


def test_a_dose_adds_up_and_who_has_too_much_stays_where_it_is():
    building = Building(refuges=[EAST])
    one = building.bystander(air=from_then_on(0.0, CLEAR._replace(heat_flux=10.0)))
    building.pass_time(200.0)
    rate = 10.0**1.9 / 4.2 / 60.0  # of heat per second, ISO 13571
    assert one.activity == "incapacitated"
    assert 1.0 <= one.dose.heat < 1.0 + rate * PERIOD
    assert one.x == pytest.approx(10.0 + SPEED / rate, abs=1.5)
    here = one.x
    one.alarm(200.0)
    building.pass_time(260.0)
    assert (one.x, one.activity) == (here, "incapacitated")


def test_without_hazards_nobody_looks_at_the_air_and_standing_people_cost_nothing(building):
    building.bystander()
    building.pass_time(100.0)
    assert building.clock.env.peek() == math.inf


# --- while nothing is wrong ------------------------------------------------------------


def test_those_who_move_around_change_between_their_places_and_others_stay(building):
    mover = building.bystander((10.0, 1.0), [(10.0, 1.0), (25.0, 1.0)], moves=True)
    other = building.bystander((5.0, 1.5))
    seen, done = [], []
    building.run_until(
        lambda: seen.append(round(mover.x)) or done.append(mover.activity), 400.0, 1.0
    )
    assert min(seen) == 10
    assert max(seen) == 25
    assert set(done) == {"working", "walking"}
    assert (other.x, other.y) == (5.0, 1.5)


def test_who_is_on_the_way_elsewhere_when_the_alarm_sounds_stops_and_leaves(building):
    one = building.bystander((10.0, 1.0), [(35.0, 1.0)], moves=True)
    building.run_until(lambda: one.activity == "walking", 100.0)
    one.alarm(building.clock.now)
    assert one.activity == "alarmed"
    building.run_until(lambda: one.activity == "safe", 200.0)
    assert one.out_at < 200.0


# --- who they are ----------------------------------------------------------------------


def test_premovement_is_log_normal_with_the_median_of_the_profile():
    file = load_yaml(find("bystanders", "agents/people"))
    profile = validate(BystanderProfile, file.data, file.error)
    rng = np.random.default_rng(1)
    drawn = [Occupant.draw(profile, rng) for _ in range(8000)]
    logs = np.log([o.premovement for o in drawn])
    assert np.exp(logs.mean()) == pytest.approx(60.0, rel=0.03)
    assert logs.std() == pytest.approx(0.6, rel=0.03)
    assert np.mean([o.speed for o in drawn]) == pytest.approx(1.34, rel=0.03)
    assert np.std([o.speed for o in drawn]) == pytest.approx(0.26, rel=0.03)
    assert np.mean([o.moves for o in drawn]) == pytest.approx(0.3, abs=0.02)


def test_people_work_in_rooms_not_in_corridors_and_not_on_top_of_each_other():
    site = load_site("caparica")
    taken: list[tuple[float, float]] = []
    for number in range(1, 61):
        rng = Streams(3).fresh(f"bystander-{number}/places")
        taken.append(draw_places(site, rng, 3, taken)[0])
    rooms = {site.room_at(*place) for place in taken}
    assert not any("corridor" in room for room in rooms)
    assert len(rooms) >= 8
    pairs = [(a, b) for i, a in enumerate(taken) for b in taken[:i]]
    assert min(math.dist(a, b) for a, b in pairs) >= START_GAP_M


def test_one_more_bystander_changes_nobody_elses_place():
    site = load_site("caparica")

    def places(count):
        taken: list[tuple[float, float]] = []
        for number in range(count):
            rng = Streams(3).fresh(f"bystander-{number}/places")
            taken.append(draw_places(site, rng, 1, taken)[0])
        return taken

    assert places(5) == places(9)[:5]


LARGE = [("office-block", {"seed": 1}), pytest.param("campus", {}, marks=pytest.mark.soak)]
LARGE += [pytest.param("office-block", {"seed": n}, marks=pytest.mark.soak) for n in (2, 3)]


@pytest.mark.parametrize(("name", "overrides"), [("caparica", {}), *LARGE])
def test_every_exit_is_reached_from_the_largest_free_floor(name, overrides):
    site = load_site(name, overrides)
    planner = Planner(site, 0.3)
    starts = [site.sample_free(np.random.default_rng(n), 0.3) for n in range(3)]
    refuges = refuges_of(site)
    reached = [[planner.distance(start, r) < math.inf for r in refuges] for start in starts]
    assert len(refuges) == len(site.exits) >= 2
    assert max(sum(of_one) for of_one in reached) == len(refuges)


def test_who_is_to_be_safe_stands_5_cm_within_an_exit_not_in_the_wall():
    site = load_site("caparica")
    for place, way in zip(refuges_of(site), site.exits, strict=True):
        assert math.dist(place, (way.x, way.y)) == pytest.approx(0.05)
        assert site.room_at(*place) != ""


def test_a_site_without_exits_is_left_for_the_posts_of_its_guards():
    site = dataclasses.replace(load_site("caparica"), exits=())
    assert refuges_of(site) == [(post.x, post.y) for post in site.guard_posts]
    assert refuges_of(hall(5, 5)) == []
