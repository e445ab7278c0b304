"""Both ends against each other: a robot of one DVA, served to ROS, is the ROS robot of another."""

import pytest
from helpers.ros.bridged_robot import BridgedRobot
from helpers.ros.served_world import ServedWorld

from dva_sim.protocol import messages as m
from dva_sim.ros.profile import RosFrames, RosLimits, RosProfile

pytestmark = pytest.mark.system

FRAMES = RosFrames(odometry="map", base="robot_1/base_link")


class Both(BridgedRobot):
    """The world behind the rosbridge server goes on whenever time passes here."""

    def __init__(self, world):
        self._world = world
        limits = RosLimits(odometry_within_s=2.0, watchdog_s=2.0)
        super().__init__(world, RosProfile(frames=FRAMES, limits=limits, enable="take_control"))

    def until(self, true):
        def both():
            self._world.pause(0.01)
            return true()

        super().until(both)


def test_a_driver_at_one_dva_drives_a_robot_of_another_through_ros():
    world = ServedWorld()
    robot = Both(world)
    try:
        robot.ready()
        robot.start()
        real = world.robot("robot-1")

        def drives():
            assert robot.drive(0.3, 0.0).code == m.OK
            return real.set_point.speed == pytest.approx(0.3) and real.is_moving

        robot.until(drives)
        place = robot.agent.body.x, robot.agent.body.y
        robot.until(lambda: not drives() or (robot.agent.body.x, robot.agent.body.y) != place)
        assert robot.ask(m.StopTeleOp()).code == m.OK
        robot.until(lambda: not real.is_moving)
        # The robot of the other DVA is given back when its client goes.
        robot.robot.close()
        robot.until(lambda: real.controller.grant is None)
    finally:
        robot.close()
        world.close()
