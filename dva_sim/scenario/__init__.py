"""What one run consists of: site, team, network, phone, events; units are in the keys."""

from dva_sim.scenario.building import FOLDER, build, load
from dva_sim.scenario.contradictions import contradictions
from dva_sim.scenario.names import check_policy, locate_files
from dva_sim.scenario.parts import EventConfig, RobotConfig
from dva_sim.scenario.patience import (
    TRIPS_OF_A_START,
    command_timeout_s,
    request_timeout_s,
    time_out_s,
)
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
    "TRIPS_OF_A_START",
    "AccessConfig",
    "DispatchConfig",
    "EventConfig",
    "RobotConfig",
    "Scenario",
    "build",
    "bystander_profile",
    "check_policy",
    "command_timeout_s",
    "contradictions",
    "guard_profile",
    "load",
    "locate_files",
    "phone_profile",
    "population",
    "request_timeout_s",
    "robot_profiles",
    "site_of",
    "time_out_s",
]
