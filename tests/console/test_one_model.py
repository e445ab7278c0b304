"""One story shows the same rows in an own run, attached, at a foreign DVA, and in a recording."""

from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import pytest
from helpers.console.declared_lines import checked
from helpers.console.recorded_console import RecordedPage
from helpers.console.remote_console import NotedBench, RemotePage
from helpers.console.simulated_phone import FIRE, PhonePage

from dva_sim.console.replay.player import Player
from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.console.wire.actions import ACTIONS, ActionPlace
from dva_sim.protocol.devices import FORGET_AFTER
from dva_sim.recordings.reading import read_recording

Line = dict[str, Any]
Rows = dict[str, dict[str, Any]]  # by label, number or text
PLACES = {
    "own run": ActionPlace.WORLD,
    "attached": ActionPlace.REMOTE,
    "foreign": ActionPlace.REMOTE,
    "recorded": ActionPlace.REPLAY,
}
OTHERS = list(PLACES)[1:]
SETTLES = 2.6  # consoles ask every 2 s who is there [s]
MISSED = 16.0  # by then the DVA has lost a robot, and the consoles have heard of it [s]
TEAM = ("robot-1", "robot-2", "guard-1", "guard-2", "console-1", "supervise-1")
MAY_DIFFER = {"heard_s": 2.1, "beats_hz": 0.35, "emergency.at_ms": 20, "session_age_s": 0.6}
"""Greatest differences of numbers: heartbeats are counted, and messages arrive, at other times."""


def why(reason: str, **fields: str) -> dict[tuple[str, str], str]:
    """Return exceptions: a reason for each of the fields, whose names are given by part."""
    return {(part, field): reason for part, names in fields.items() for field in names.split()}


UNTOLD = why(
    "no message tells it",
    robots="battery by_hand lost queue refused stop_reason timeouts emergency.released_by"
    " watchdog_left_s",
    devices="commands_hz level refused picture_age_s round_trip_s",
) | why("who sits where is known to the console with that seat", robots="emergency.by")
ATTACHED = (
    UNTOLD
    | why("the own run draws the pictures itself", robots="camera")
    | why(
        "a command is for its robot alone",
        robots="commands_hz set_speed_mps set_turn_rate_radps",
    )
)
EXCEPTIONS = {
    "attached": ATTACHED,
    "foreign": ATTACHED
    | why("nobody has let this console supervise", devices="revocable")
    | why("the origin of an unknown site is where somebody was first", events="room x_m y_m")
    | why("the room is unknown", alarms="row"),
    "recorded": UNTOLD
    | why(
        "commands are counted as they are made, not as they take effect",
        robots="commands_hz",
    )
    | why(
        "a replay asks nobody what robots can show",
        robots="sensors",
        devices="camera sensors",
    )
    | why("what people do about alarms is in no message", alarms="row")
    | why("nobody can act", devices="revocable"),
}


class Carrier:
    """A console, as a page sees it.

    Attributes:
        lines: Lines that the page got.
        take: Takes a line of the page.
        at: Rows at each moment of the story, by what they are about.
    """

    def __init__(self, lines: list[Line], take: Callable[[Line], object]):
        self.lines = lines
        self.take = take
        self.at: dict[str, dict[str, Rows]] = {}
        take({"do": "look", "logs": {}, "tables": ["devices"]})

    def newest(self, kind: str) -> Line:
        """The newest line of a kind; an empty one if there is none."""
        return next((line for line in reversed(self.lines) if line["k"] == kind), {"alarms": []})

    def labels(self) -> dict[int, str]:
        """Labels of all robots and guards by their numbers."""
        things = self.newest("scene")["things"]
        return {one["i"]: one["label"] for one in things if one["kind"] in ("robot", "guard")}

    def rows(self) -> dict[str, Rows]:
        """Return the present rows, by the thing that each describes."""
        labels = self.labels()
        robots = {labels[row["i"]]: {**row, "i": None} for row in self.newest("rows")["robots"]}
        for row in robots.values():
            emergency = row.pop("emergency") or {}
            row |= {f"emergency.{name}": about for name, about in emergency.items()}
        devices = {row["label"]: row for row in self.newest("devices")["devices"]}
        return deepcopy(
            {
                "robots": robots,
                "people": {
                    labels[row["i"]]: {"doing": row["doing"]}
                    for row in self.newest("rows")["people"]
                },
                "devices": {label: devices[label] for label in TEAM if label in devices},
                "events": {row["number"]: row for row in self.newest("events")["events"]},
                "alarms": {row["text"]: {} for row in self.newest("alarms")["alarms"]},
            }
        )

    def answer(self, what: str) -> Line:
        """The answer to an action that gives no arguments."""
        self.take({"do": what, "id": what, "client": "c1", "role": "supervise"})
        return next(line for line in self.lines if line["k"] == "done" and line["id"] == what)


def story(page: PhonePage) -> Iterator[str]:
    """Let it happen, and yield the name of each moment that is looked at."""
    page.let(4.0)
    yield "reported"
    assert page.do("event_assign", event=1, device="robot-2", role="supervise")[0]
    yield "assigned"
    page.sets_out(speed=0.5)
    yield "driven"
    assert page.do("emergency", robots=["robot-1"])[0]
    yield "stopped"
    assert page.do("release_emergency", robots=["robot-1"], role="supervise")[0]
    yield "released"
    assert page.do("event_false_alarm", event=1, reason="drill", role="supervise")[0]
    yield "closed"
    assert page.do("fault", robot="robot-2", what="freeze", on=True)[0]
    page.let(MISSED)
    yield "lost"
    page.let(FORGET_AFTER + MISSED)
    yield "lost for long"


@pytest.fixture(scope="module")
def carriers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Carrier]]:
    """The four carriers after the story, with their rows at each moment."""
    folder = tmp_path_factory.mktemp("carriers")
    with pytest.MonkeyPatch.context() as patch:
        page = PhonePage(
            patch, client="c1", bystander__count=0, events=FIRE, dispatch__mode="ask_first"
        )
        file = folder / "run.mcap"
        recorded = RecordedPage(page, file)
        attached = RemotePage(page, folder / "attached.sqlite")
        attached.system.bench = NotedBench(attached)
        foreign = RemotePage(page, folder / "foreign.sqlite", "look", number=901, scenario=None)
        live = {
            "own run": Carrier(page.lines, page.actions.take),
            "attached": Carrier(attached.lines, attached.actions.take),
            "foreign": Carrier(foreign.lines, foreign.actions.take),
        }
        moments: dict[str, float] = {}
        for moment in story(page):
            page.let(SETTLES)
            moments[moment] = page.world.clock.now
            for carrier in live.values():
                carrier.at[moment] = carrier.rows()
            page.let(0.1)  # else what is done next falls into the same moment
        recorded.finish()
        player = Player(RecordedRun(read_recording(file), "run.mcap"))
        told: list[Line] = []
        player.tell = lambda line, _="": told.append(checked(line))
        player.begin()
        replay = Carrier(told, player.take)
        for moment, time in moments.items():
            player.take({"do": "seek", "id": moment, "client": "c1", "t_ms": round(1000 * time)})
            replay.at[moment] = replay.rows()
        yield {**live, "recorded": replay}
        player.close()
        attached.keeper.close()
        foreign.keeper.close()


@pytest.fixture(params=OTHERS)
def other(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def alike(field: str, one: Any, two: Any) -> bool:
    """Return True for the same value, or times and rates that may differ a little."""
    if one is None or two is None:
        return one is two
    return one == pytest.approx(two, abs=MAY_DIFFER[field]) if field in MAY_DIFFER else one == two


def differences(one: dict[str, Rows], two: dict[str, Rows]) -> set[tuple[str, str]]:
    """Return in what fields rows differ; `row`: one of them is not there."""
    fields = {
        (part, field)
        for part, rows in one.items()
        for key in rows.keys() & two[part].keys()
        for field in rows[key].keys() | two[part][key].keys()
        if not alike(field, rows[key].get(field), two[part][key].get(field))
    }
    return fields | {(part, "row") for part in one if one[part].keys() != two[part].keys()}


def test_the_story_is_told(carriers):
    at = carriers["own run"].at
    states = {moment: rows["events"][1]["state"] for moment, rows in at.items()}
    modes = {moment: rows["robots"]["robot-1"]["mode"] for moment, rows in at.items()}
    assert (states["reported"], states["assigned"]) == ("pending", "assigned")
    assert states["closed"] == "refuted"
    assert (modes["reported"], modes["driven"]) == ("Idle", "Teleoperation")
    assert (modes["stopped"], modes["released"]) == ("Emergency", "Idle")
    silent = {moment: rows["robots"]["robot-2"]["silent"] for moment, rows in at.items()}
    assert (silent["closed"], silent["lost"], silent["lost for long"]) == (False, True, True)
    for moment in ("lost", "lost for long"):
        assert any("robot-2 is lost" in text for text in at[moment]["alarms"])


def test_all_show_the_same_but_for_what_they_cannot_know(carriers, other):
    own, there = carriers["own run"].at, carriers[other].at
    found = set().union(*(differences(own[moment], there[moment]) for moment in own))
    assert sorted(found) == sorted(EXCEPTIONS[other])


@pytest.mark.parametrize("part", ["robots", "people", "devices", "events", "alarms"])
def test_a_row_that_differs_is_found(carriers, part):
    rows = carriers["own run"].at["lost"] | carriers["own run"].at["assigned"]
    changed = deepcopy(rows)
    key = next(iter(changed[part]))
    changed[part][key]["doing"] = "something else"
    assert differences(rows, changed) == {(part, "doing")}
    del changed[part][key]
    assert differences(rows, changed) == {(part, "row")}


def test_all_show_robots_at_the_same_distance(carriers, other):
    ways = []
    for carrier in (carriers["own run"], carriers[other]):
        labels = carrier.labels()
        places = {labels[i]: (x, y) for i, x, y, *_ in carrier.newest("pos")["p"] if i in labels}
        (x, y), (x2, y2) = places["robot-1"], places["robot-2"]
        ways.append((x2 - x, y2 - y))
    assert ways[1] == pytest.approx(ways[0], abs=3)  # one may not know where its map lies [cm]


@pytest.mark.parametrize("name", PLACES)
def test_what_cannot_be_done_somewhere_is_refused_in_words(carriers, name):
    elsewhere = [
        what
        for what, action in ACTIONS.items()
        if PLACES[name] not in action.at and action.has_answer
    ]
    assert elsewhere
    for what in elsewhere:
        answer = carriers[name].answer(what)
        assert not answer["ok"], what
        assert len(answer["text"]) > 10, what
