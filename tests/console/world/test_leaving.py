"""The tables of a session are written whenever a participant of any kind leaves it."""

import pytest
from helpers.console.foreign_device import FOREIGN, LABEL, foreign_device
from helpers.console.simulated_phone import PhonePage

from dva_sim.console.world.kept_results import KeptResults
from dva_sim.experiments.results.results import Results
from dva_sim.protocol import messages as m
from dva_sim.ros.gateway import RosGateway

SHORT = 1.0  # before the end [s]
LONG = 150.0  # after that the DVA and the console have forgotten a participant that left [s]


class Phone:
    """A phone that drives by tilt."""

    operator, robot = "phone-1", "robot-1"

    def __init__(self, page):
        self._page = page
        assert page.register(label="mine")["ok"]

    def drives(self):
        assert self._page.permit()["ok"]
        assert self._page.calibrate()["ok"]
        assert self._page.do("start")[0]
        self._page.want(0.5)

    def stops(self):
        self._page.let_go()
        assert self._page.do("stop")[0]

    def leaves(self):
        self._page.let_go()
        line = {"id": "bye-1", "client": self._page.client, "do": "release"}
        self._page.actions.take(line)


class Seat(Phone):
    """A page that drives from a seat of the console."""

    operator = "console-1"

    def __init__(self, page):
        self._page = page

    def drives(self):
        self._page.sets_out(0.5)


class GuardPhone(Phone):
    """A phone whose owner plays a guard, and reports a fire instead of driving."""

    operator, robot = "guard-1", None

    def __init__(self, page):
        self._page = page
        assert page.do("guard_join", guard="guard-1")[0]

    def drives(self):
        x, y = self._page.world.run.field.guards[0].walking.place
        done, text = self._page.do("guard_report", kind="fire", x_m=x, y_m=y, severity="high")
        assert done, text


class RosClient:
    """A client of ROS that drives a robot of the run."""

    operator, robot = "ros-2", "robot-1"

    def __init__(self, page):
        self._page = page
        self._gateway = RosGateway(page.world.run.stage, lambda: page.world.seating.console)
        page.let(5.0)
        self._driver = self._gateway.driver()

    def _robot(self):
        return self._page.robot().device.id_tag

    def drives(self):
        answers = []
        self._driver.take(self._robot(), lambda *answer: answers.append(answer))
        self._page.until(lambda: answers)
        assert answers[0][0], answers
        self._driver.drive(self._robot(), 0.3, 0.0)

    def leaves(self):
        self._gateway.retire(self._driver)


class ForeignRobot(RosClient):
    """A robot of another make, driven by a client of ROS, that goes away."""

    robot = LABEL

    def __init__(self, page):
        self.device = foreign_device(page.world.run)
        self.device.serve(lambda message: m.Reply(message.message_id, m.OK, ""))
        self.device.register()
        super().__init__(page)

    def _robot(self):
        return FOREIGN

    def leaves(self):
        self.device.leave()


@pytest.mark.parametrize(
    ("kind", "moment", "rest"),
    [
        (Phone, "before", SHORT),
        (Phone, "while", SHORT),
        (Phone, "after", SHORT),
        (RosClient, "while", SHORT),
        *((kind, "while", LONG) for kind in (Phone, Seat, GuardPhone, ForeignRobot, RosClient)),
    ],
)
def test_all_tables_are_written(monkeypatch, tmp_path, kind, moment, rest):
    changes = ["guard.kind=person"]
    results = KeptResults(tmp_path / "out", "hands-on", changes, 1, False)
    page = PhonePage(monkeypatch, scenario=results.scenario.model_dump(mode="json"), measured=True)
    results.follow(page.world)
    page.let(1.0)
    participant = kind(page)
    if moment != "before":
        participant.drives()
        page.let(3.0)
    if moment == "after":
        participant.stops()
        page.let(1.0)
    participant.leaves()
    page.let(rest)
    page.world.recorder.tidy()
    results.write()
    results.close()
    found = Results.load(tmp_path / "out")
    assert not found.partial
    assert set(found.tables) >= {"runs", "people"}
    drives = moment != "before" and participant.robot is not None
    assert found.has("drives") == drives
    if drives:
        table = found.table("drives")
        assert set(table["operator_name"]) == {participant.operator}
        assert set(table["robot_name"]) == {participant.robot}
        assert participant.operator in found.table("operators")["operator_name"]
