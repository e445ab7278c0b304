"""Control of a robot that is asked for before its connections stand."""

import pytest
from helpers.processes.patience import Patient
from helpers.ros.served_world import SOURCE

from dva_sim.console.world.world import ConsoleWorld
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.ros.gateway import RosGateway
from dva_sim.simulation.scenario import build

pytestmark = pytest.mark.system


class FarRobots(Patient):
    """Two robots behind a link, and a driver who has just heard of them."""

    def __init__(self):
        scenario = build(SOURCE, parse_changes(("link.delay_s=0.1",)))
        self.world = ConsoleWorld(scenario, "test", 1)
        self.clock = self.world.clock
        self.gateway = RosGateway(self.world.run.stage, lambda: self.world.seating.console)
        self.until(lambda: "robot_1" in self.gateway.robots)
        self.robot = self.gateway.robots["robot_1"].id_tag
        self.driver = self.gateway.driver()
        self.answers = []

    def take(self):
        self.driver.take(self.robot, lambda done, text: self.answers.append((done, text)))

    def revoke(self):
        """The permission ends while the robot is asked to be driven."""
        held = self.driver._person.robots
        self.until(lambda: self.robot in held and held[self.robot].phase == "starting")
        held[self.robot].revoked(held[self.robot].session)


@pytest.fixture
def far():
    far = FarRobots()
    yield far
    far.world.phones.close()


def test_a_permission_that_runs_out_before_the_drive_is_asked_for_again(far):
    far.take()
    far.revoke()
    far.until(lambda: far.answers)
    assert far.answers[0][0]
    assert far.driver.drive(far.robot, 0.3, 0.0) == ""


def test_a_client_that_is_gone_asks_no_more(far):
    far.take()
    far.revoke()
    far.driver.release_all()
    far.until(lambda: far.answers)
    assert not far.answers[0][0]
    assert not far.driver.is_driving
