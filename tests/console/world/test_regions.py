"""A console's own run of several DVAs: who serves which region, and robots that cross a border."""

from helpers.console.simulated_phone import PhonePage

from dva_sim.agents.robot.controller import Mode
from dva_sim.simulation.full.stage import id_of

BORDER = 6.0  # [m]; robots begin at 2 m and face east, guards are at 58 m
HALL = {
    "site": {"name": "hall"},
    "robot": {"count": 2},
    "guard": {"count": 2},
    "operator": {"count": 1},
    "dva": {
        "regions": {
            "west": {"polygon": [[0, 0], [BORDER, 0], [BORDER, 40], [0, 40]]},
            "east": {"rest": True},
        },
    },
    "horizon_s": 600,
}
WEST, EAST = id_of("dva", 1), id_of("dva", 2)
FIRES = [
    {"kind": "fire", "position": [3, 20], "at_s": 2, "reported": True},
    {"kind": "flood", "position": [50, 20], "at_s": 2, "reported": True},
]


def hall(monkeypatch, **changes) -> PhonePage:
    page = PhonePage(monkeypatch, scenario=HALL, **changes)
    page.are_open("p1", role="supervise")
    page.actions.take({"client": "p1", "do": "look", "logs": {}, "tables": ["devices"]})
    page.let(4.0)
    return page


def dvas(page):
    page.let(1.5)
    return {row["label"]: row["dva"] for row in page.lines_of("devices")[-1]["devices"]}


def regions(page):
    return {row["name"]: row["state"] for row in page.lines_of("rows")[-1]["regions"]}


def alarms(page):
    return {row["text"]: row["priority"] for row in page.lines_of("alarms")[-1]["alarms"]}


def events(page):
    return {row["kind"]: row for row in page.lines_of("events")[-1]["events"]}


def test_the_map_has_the_borders_within_the_site_and_a_place_for_each_name(monkeypatch):
    page = hall(monkeypatch)
    west, east = page.lines_of("scene")[-1]["site"]["regions"]
    for region in (west, east):
        ((one, other),) = region["borders_m"]
        assert {one[0], other[0]} == {BORDER}
        assert sorted((one[1], other[1])) == [0.01, 39.99]
    assert (west["name"], west["place_m"]) == ("west", [0.0, 40.0])
    assert (east["name"], east["place_m"]) == ("east", [BORDER, 40.0])


def test_the_table_names_the_dva_of_each_device(monkeypatch):
    table = dvas(hall(monkeypatch))
    assert {table[f"robot-{n}"] for n in (1, 2)} == {"dva-west"}
    assert {table[f"guard-{n}"] for n in (1, 2)} == {"dva-east"}
    assert not {"dva-west", "dva-east"} & table.keys()


def test_one_dva_has_neither_regions_nor_a_column(monkeypatch):
    page = PhonePage(monkeypatch)
    page.let(2.0)
    assert page.lines_of("rows")[-1]["regions"] == []
    assert page.lines_of("scene")[-1]["site"]["regions"] == []


def test_events_of_all_regions_are_shown_and_decided_on(monkeypatch):
    page = hall(monkeypatch, events=FIRES)
    page.until(lambda: len(events(page)) == 2)
    assert {row["number"] // 1_000_000 for row in events(page).values()} == {0, 1}
    for row in list(events(page).values()):
        asked = page.ask("event_note", event=row["number"], text="a note", role="dispatch")
        assert asked["ok"], asked
    page.let(1.0)
    assert {row["note"] for row in events(page).values()} == {"a note"}


def test_a_switch_of_dispatch_holds_at_every_dva(monkeypatch):
    page = hall(monkeypatch)
    assert page.ask("dispatch_mode", mode="ask_first", reason="", role="supervise")["ok"]
    page.let(1.0)
    modes = {dva.core.dispatcher.questions.asks for dva in page.world.run.dvas.values()}
    assert modes == {True}


def test_robots_of_all_regions_are_released_after_an_emergency(monkeypatch):
    page = hall(monkeypatch)
    move_to_the_east(page)
    assert page.ask("emergency")["ok"]
    page.let(3.0)
    assert page.ask("release_emergency", role="dispatch")["ok"]
    page.let(1.0)
    assert not any(robot.controller.latch.holds for robot in robots(page))


def test_a_dead_dva_is_an_alarm_until_its_region_is_its_own_again(monkeypatch):
    page = hall(monkeypatch, events=FIRES)
    page.until(lambda: len(events(page)) == 2)
    assert regions(page) == {"west": "served", "east": "served"}
    page.world.run.end_dva(1)
    page.let(8.0)
    assert regions(page) == {"west": "dead", "east": "served"}
    assert alarms(page)["Region west: dva-west is silent: nobody serves it"] == "critical"
    assert page.lines_of("rows")[-1]["server"]["hearing"] == "answers"
    page.let(12.0)
    assert regions(page) == {"west": "deputy", "east": "served"}
    text = "Region west: served by dva-east, its deputy, as dva-west is"
    assert alarms(page)[f"{text} silent"] == "high"
    assert {"fire", "flood"} == events(page).keys()
    assert set(dvas(page).values()) == {"dva-east"}
    records = []
    page.world.system.agent.on_record = records.append
    number = events(page)["flood"]["number"]
    asked = page.ask("event_note", event=number, text="a note", role="dispatch")
    assert asked["ok"], asked
    page.let(1.0)
    assert [record.action for record in records].count("note") == 1
    page.world.run.start_region_again(1)
    page.let(5.0)
    assert alarms(page)[f"{text} back, and may get it back"] == "high"
    refused = page.ask("give_back", region="west", role="supervise")
    assert (refused["ok"], refused["text"]) == (
        False,
        f"event {events(page)['fire']['number']} is assigned",
    )
    assert not page.world.recorder.broken


def test_a_region_is_given_back_to_its_own_dva(monkeypatch):
    page = hall(monkeypatch)
    page.let(2.0)
    page.world.run.end_dva(1)
    page.until(lambda: regions(page)["west"] == "deputy")
    assert not page.ask("give_back", region="west", role="supervise")["ok"]
    page.world.run.start_region_again(1)
    page.until(lambda: page.lines_of("rows")[-1]["regions"][0]["is_returnable"])
    assert page.ask("give_back", region="west", role="supervise")["ok"]
    page.until(lambda: regions(page) == {"west": "served", "east": "served"})
    assert not page.ask("give_back", region="north", role="supervise")["ok"]
    assert not page.world.recorder.broken


# --- borders ------------------------------------------------------------------------------------


def robots(page):
    return list(page.world.run.field.robots.values())


def move_to_the_east(page, number=0):
    """Drive a robot over the border, give it back, and let it be handed over."""
    page.sets_out(speed=1.0, robots=(number,))
    page.until(lambda: robots(page)[number].body.x > BORDER + 3.0)
    page.let_go()
    assert page.do("release")[0]
    page.until(lambda: robots(page)[number].device.dva == EAST)
    page.let(2.5)  # the console asks every 2 s who is where


def window(page):
    return [line for line in page.lines_of("robot") if line["i"] == 0][-1]


def test_a_border_ends_no_drive_and_closes_no_window(monkeypatch):
    page = hall(monkeypatch)
    page.actions.take({"client": "p1", "do": "watch", "robots": [0]})
    page.sets_out(speed=1.0)
    told = len(page.lines)
    page.until(lambda: robots(page)[0].body.x > BORDER + 7.0)
    assert {line["phase"] for line in page.lines[told:] if line["k"] == "seat"} == {"driving"}
    assert robots(page)[0].controller.mode is Mode.TELEOPERATION
    assert robots(page)[0].device.dva == WEST
    assert window(page)["hand"] is None
    assert window(page)["speed_mps"] > 0.4
    assert page.drive()["i"] == 0
    page.let_go()
    assert page.do("release")[0]
    page.until(lambda: robots(page)[0].device.dva == EAST)
    told = len(page.lines)
    page.let(3.0)
    assert dvas(page)["robot-1"] == "dva-east"
    assert not any(row["silent"] for row in page.lines_of("rows")[-1]["robots"])
    assert [line["i"] for line in page.lines[told:] if line["k"] == "robot"]
    assert not page.world.recorder.broken


def test_a_seat_goes_to_the_dva_of_the_robot_that_it_takes(monkeypatch):
    page = hall(monkeypatch)
    move_to_the_east(page)
    page.sets_out(speed=-1.0, then=2.0)
    assert dvas(page)["console-1"] == "dva-east"
    assert robots(page)[0].controller.mode is Mode.TELEOPERATION
    ok, text = page.do("take", robots=[1])
    assert (ok, text.partition(":")[0]) == (False, "one person drives in one region at a time")
    page.let_go()
    assert page.do("release")[0]
    assert page.do("take", robots=[1])[0]
    page.let(1.0)
    assert robots(page)[1].holder[0] == id_of("console", 1)
    assert not page.world.recorder.broken


def test_a_seat_learns_that_the_dva_of_a_robot_does_not_answer(monkeypatch):
    page = hall(monkeypatch)
    move_to_the_east(page)
    page.world.run.end_dva(2)
    ok, text = page.do("take", robots=[0])
    assert (ok, text) == (False, "the DVA does not answer")


def test_a_robot_is_taken_over_from_a_driver_in_another_region(monkeypatch):
    page = hall(monkeypatch)
    move_to_the_east(page)
    page.sets_out(speed=-0.2, then=1.0)
    page.are_open("p1", "c2", role="supervise")
    page.wanted = None
    asked = page.do("take_over", client="c2", robot=0, reason="mine", role="supervise")
    assert asked[0], asked
    page.let(1.0)
    assert robots(page)[0].holder[0] == id_of("console", 2)


def test_a_robot_goes_by_itself_to_an_event_in_another_region_than_the_console_is(monkeypatch):
    page = hall(monkeypatch, events=FIRES, dispatch__mode="ask_first")
    move_to_the_east(page)
    number = events(page)["flood"]["number"]
    asked = page.ask("mission", event=number, robot="robot-1", role="dispatch")
    assert asked["ok"], asked
    page.until(lambda: robots(page)[0].controller.mode is Mode.MISSION)
    page.until(lambda: "robot-1" in events(page)["flood"]["assigned"])
    assert not page.world.recorder.broken


# --- phones -------------------------------------------------------------------------------------


def test_a_phone_lists_the_robots_of_all_regions_and_drives_over_a_border(monkeypatch):
    page = hall(monkeypatch)
    move_to_the_east(page, number=1)
    phone = page.drives_by_tilt()
    listed = page.ask("phone_devices")["devices"]
    assert {row["label"] for row in listed if row["type"] == "Robot"} == {"robot-1", "robot-2"}
    page.until(lambda: robots(page)[0].body.x > BORDER + 3.0)
    assert robots(page)[0].controller.mode is Mode.TELEOPERATION
    assert page.phone()["registered"]
    phone.put_away()
    assert page.do("stop")[0]
    assert page.permit(1)["ok"]
    assert robots(page)[1].device.dva == EAST
    page.let(2.0)
    assert robots(page)[1].holder[0] == id_of("phone", 1)


def test_a_phone_at_a_wrong_address_stays_there(monkeypatch):
    page = hall(monkeypatch)
    asked = page.register(address="192.0.2.9:5555")
    assert (asked["ok"], asked["text"]) == (False, "no DVA answers at 192.0.2.9:5555")
    page.let(20.0)
    assert page.register()["ok"]
