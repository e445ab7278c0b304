"""A run looks the same beside its console, at a remote DVA, on that DVA's bench, and recorded."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from helpers.console.declared_lines import checked
from helpers.console.recorded_console import RecordedPage
from helpers.console.remote_console import NotedBench, RemotePage
from helpers.console.simulated_phone import FIRE, PhonePage

from dva_sim.console.replay.player import Player
from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.console.wire.actions import ACTIONS, ActionPlace
from dva_sim.recordings.reading import read_recording

END = 40.0  # of the run; by then a robot has been sent to the fire [s]
PLACES = {
    "beside": ActionPlace.WORLD,
    "elsewhere": ActionPlace.REMOTE,
    "on its bench": ActionPlace.REMOTE,
    "recorded": ActionPlace.REPLAY,
}


class Carrier:
    """A console, as a page sees it.

    Attributes:
        lines: Lines that the page got.
        take: Takes a line of the page.
    """

    def __init__(self, lines: list[dict[str, Any]], take: Callable[[dict[str, Any]], object]):
        self.lines = lines
        self.take = take

    def newest(self, kind: str) -> dict[str, Any]:
        """The newest line of a kind."""
        return next(line for line in reversed(self.lines) if line["k"] == kind)

    def robots(self) -> list[dict[str, Any]]:
        """The newest rows of the robots."""
        return list(self.newest("rows")["robots"])

    def labels(self) -> dict[int, str]:
        """Labels of all robots and guards by their numbers."""
        things = self.newest("scene")["things"]
        return {one["i"]: one["label"] for one in things if one["kind"] in ("robot", "guard")}

    def answer(self, what: str) -> dict[str, Any]:
        """The answer to an action that gives no arguments."""
        self.take({"do": what, "id": what, "client": "c1", "role": "supervise"})
        return next(line for line in self.lines if line["k"] == "done" and line["id"] == what)


@pytest.fixture(scope="module")
def carriers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Carrier]]:
    folder = tmp_path_factory.mktemp("carriers")
    with pytest.MonkeyPatch.context() as patch:
        world = PhonePage(patch, client="c1", bystander__count=0, events=FIRE)
        file = folder / "run.mcap"
        recorded = RecordedPage(world, file)
        elsewhere = RemotePage(world, folder / "elsewhere.sqlite")
        bench = RemotePage(world, folder / "bench.sqlite", number=901)
        bench.system.bench = NotedBench(bench)
        world.let(END)
        recorded.finish()
        player = Player(RecordedRun(read_recording(file), "run.mcap"))
        told: list[dict[str, Any]] = []
        player.tell = lambda line, _="": told.append(checked(line))
        player.begin()
        player.take({"do": "seek", "id": "seek", "client": "c1", "t_ms": round(1000 * END)})
        yield {
            "beside": Carrier(world.lines, world.actions.take),
            "elsewhere": Carrier(elsewhere.lines, elsewhere.actions.take),
            "on its bench": Carrier(bench.lines, bench.actions.take),
            "recorded": Carrier(told, player.take),
        }
        player.close()
        elsewhere.keeper.close()
        bench.keeper.close()


@pytest.fixture(params=list(PLACES)[1:])
def other(request: pytest.FixtureRequest, carriers: dict[str, Carrier]) -> Carrier:
    return carriers[request.param]


@pytest.fixture
def beside(carriers: dict[str, Carrier]) -> Carrier:
    return carriers["beside"]


def test_all_show_the_same_robots_and_guards(beside, other):
    assert set(other.labels().values()) == set(beside.labels().values())


def test_all_show_the_same_events(beside, other):
    shown = "number", "kind", "room", "state", "severity", "assigned", "over"
    rows = [
        [{key: row[key] for key in shown} for row in one.newest("events")["events"]]
        for one in (beside, other)
    ]
    assert rows[0]
    assert rows[1] == rows[0]


def test_all_show_robots_in_the_same_mode_and_hands(beside, other):
    rows = [
        {
            one.labels()[row["i"]]: (row["mode"], row["holder"])
            for row in one.newest("rows")["robots"]
        }
        for one in (beside, other)
    ]
    assert rows[1] == rows[0]


def test_all_show_everybody_at_the_same_place(beside, other):
    places = [
        {
            one.labels()[i]: (x, y)
            for i, x, y, *_ in one.newest("pos")["p"]
            if i in one.labels() and one.labels()[i].startswith("robot")
        }
        for one in (beside, other)
    ]
    assert places[1].keys() == places[0].keys()
    for label, place in places[0].items():
        assert places[1][label] == pytest.approx(place, abs=60), (
            label
        )  # status of a second ago [cm]


def test_alarms_are_the_same_wherever_somebody_can_act(carriers):
    texts = [
        [row["text"] for row in carriers[name].newest("alarms")["alarms"]]
        for name in ("beside", "elsewhere", "on its bench")
    ]
    assert texts[0]
    assert texts[1] == texts[2] == texts[0]


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
