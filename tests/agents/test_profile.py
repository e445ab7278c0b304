"""Profiles of robots: what they say, and what they may not."""

import math

import pytest

from dva_sim.agents.robot.battery import BatteryProfile
from dva_sim.agents.robot.command_queue import ServiceLaw
from dva_sim.agents.robot.profile import RobotProfile, load_robot
from dva_sim.agents.robot.sensors import SensorConfig
from dva_sim.worlds.drives import DriveSpec


def test_the_service_robot_is_what_the_physics_has_by_itself():
    assert load_robot("servrobot").drive_spec() == DriveSpec()
    assert load_robot("servrobot").processing_s == 0.05


@pytest.mark.parametrize("profile", [RobotProfile(), BatteryProfile(), SensorConfig(name="lidar")])
def test_what_is_given_by_default_is_what_a_file_could_say(profile):
    assert type(profile).model_validate(profile.model_dump()) == profile


def test_the_model_car_is_slow_to_answer_and_cannot_turn_on_the_spot():
    car = load_robot("pibot")
    spec = car.drive_spec()
    service = car.processing_s
    assert isinstance(service, ServiceLaw)
    assert (service.mean_s, service.first_s) == (1.0, 3.0)
    assert spec.drive(spec).turning_radius == pytest.approx(0.26 / math.tan(math.radians(25)))
    assert spec.inner_radius == pytest.approx(0.10)


def test_a_drive_beside_its_profile_is_found_from_anywhere(tmp_path, monkeypatch):
    there, here = tmp_path / "there", tmp_path / "here"
    there.mkdir()
    here.mkdir()
    (there / "mine.yaml").write_text("drive: mine.py:Mine\noptions: {pace: 0.5}\n")
    (there / "mine.py").write_text(
        "from dva_sim.worlds.drives import Differential\n"
        "class Mine(Differential):\n"
        "    def __init__(self, spec, pace=1.0):\n"
        "        super().__init__(spec)\n"
        "        self.pace = pace\n"
    )
    monkeypatch.chdir(here)
    spec = load_robot("../there/mine.yaml").drive_spec()
    assert spec.drive(spec).drive.pace == 0.5
