"""Scenario of one run: site, team, network, phone, events; units are in the keys."""

from dva_sim.simulation.scenario.contradictions import contradictions
from dva_sim.simulation.scenario.loading import FOLDER, build, check_policy, load, locate_files
from dva_sim.simulation.scenario.parts import (
    AccessConfig,
    DispatchConfig,
    EventConfig,
    PhoneConfig,
    RobotConfig,
)
from dva_sim.simulation.scenario.regions import RegionPlan, plan_of
from dva_sim.simulation.scenario.scenario import (
    Scenario,
    bystander_profile,
    guard_profile,
    phone_profile,
    population,
    robot_profiles,
    site_of,
)
from dva_sim.simulation.scenario.time_outs import (
    TRIPS_OF_A_START,
    command_timeout_s,
    mean_processing_s,
    request_timeout_s,
    start_needs_s,
    time_out_s,
)

__all__ = [
    "FOLDER",
    "TRIPS_OF_A_START",
    "AccessConfig",
    "DispatchConfig",
    "EventConfig",
    "PhoneConfig",
    "RegionPlan",
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
    "mean_processing_s",
    "phone_profile",
    "plan_of",
    "population",
    "request_timeout_s",
    "robot_profiles",
    "site_of",
    "start_needs_s",
    "time_out_s",
]
