"""What one run consists of: site, team, network, phone, events; units are in the keys."""

from dva_sim.scenario.building import FOLDER, build, load
from dva_sim.scenario.names import check_policy, locate_files
from dva_sim.scenario.parts import EventConfig, RobotConfig
from dva_sim.scenario.profiles import (
    bystander_profile,
    guard_profile,
    phone_profile,
    population,
    robot_profiles,
    site_of,
)
from dva_sim.scenario.rules import AccessConfig, DispatchConfig
from dva_sim.scenario.scenario import Scenario

__all__ = [
    "FOLDER",
    "AccessConfig",
    "DispatchConfig",
    "EventConfig",
    "RobotConfig",
    "Scenario",
    "build",
    "bystander_profile",
    "check_policy",
    "guard_profile",
    "load",
    "locate_files",
    "phone_profile",
    "population",
    "robot_profiles",
    "site_of",
]
