"""Mistakes in what describes persons, phones, strategies, sensors and profiles of robots."""

import math
from functools import partial

from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file
from helpers.worlds.delayed_loops import ROBOT, person

from dva_sim.agents.operator.strategies import load_strategy
from dva_sim.agents.population import Population
from dva_sim.agents.robot.profile import RobotProfile
from dva_sim.agents.robot.sensors import SensorConfig, make_ports
from dva_sim.agents.tilt import AccelerometerPart, PhoneProfile
from dva_sim.agents.tilt.filters import load_filter
from dva_sim.agents.tilt.mappings import load_mapping
from dva_sim.kernel.config import validate
from dva_sim.kernel.streams import Streams
from dva_sim.simulation import scenario as scenarios

HEAD = "from dva_sim.agents.operator.strategies import Oracle, Pursuit\n"
MAKES_AN_ORACLE = """
class Mine(Pursuit):
    def __new__(cls, person, reach):
        return Oracle(person, reach)
"""
NARROW = [[0.2, 0.05], [-0.2, 0.05], [-0.2, -0.05], [0.2, -0.05]]


def strategy(name, options):
    load_strategy(name, options)(person(), ROBOT)


def strategy_of_file(name):
    strategy(f"{name}:Mine", {})


def tilt_filter(name, options):
    load_filter(name, options)(1 / 34)


def mapping(name, options):
    load_mapping(name, options)()


def corners(*corners_m):
    validate(RobotProfile, {"corners_m": corners_m})


def sensors(*names):
    configs = [SensorConfig(name=name) for name in names]
    make_ports(configs, dict.fromkeys(names, lambda now: (0.0,)), Streams(1).fresh)


def drive_of(key, value):
    scenarios.build(scenarios.load("drive-to-event"), {key: value})


MISTAKES = [
    *mistakes(
        Population().with_medians,
        ({"luck": 1.0}, "operator.traits 'luck' known: perceptual"),
        ({"margin": 0.0}, "operator.traits 'margin' 0.0;"),
    ),
    *mistakes(
        strategy,
        ("clever", {}, "'clever' adaptive move_and_wait oracle"),
        ("pursuit", {"gain": 2}, "'pursuit' 'gain' none"),
        ("predictor", {"gain": 2}, "'gain' inner quality"),
        ("predictor", {"quality": 1.5}, "'quality' 1.5; 0 1"),
        ("predictor", {"quality": math.nan}, "'quality' nan; 0 1"),
        ("predictor", {"quality": "nan"}, "'quality' 'nan'; 0 1"),
        ("predictor", {"inner": "oracle"}, "'inner' 'oracle'"),
        ("adaptive", {"closed": "oracle"}, "'closed' 'oracle'"),
        ("adaptive", {"closed": 5}, "'closed' 5;"),
        ("adaptive", {"closed": "nothing"}, "'nothing'"),
    ),
    *mistakes(
        of_file(strategy_of_file, "mine.py"),
        (f"{HEAD}class Mine(Pursuit, Oracle): ...\n", "Mine Oracle"),
        (HEAD + MAKES_AN_ORACLE, "Oracle"),
    ),
    *mistakes(
        tilt_filter,
        ("average", {}, "'average' median20-copy median20-inplace none one_pole mine.py:Mine"),
        ("median", {"size": 5}, "filter 'median' 'size' window"),
        ("median", {"window": 0}, "filter 'median' 'window' 0; 1 1000"),
        ("one_pole", {"time_constant_s": 0}, "filter 'one_pole' 'time_constant_s' 0; 60"),
        ("none", {"window": 3}, "filter 'none' 'window'"),
    ),
    *mistakes(
        mapping,
        ("relative", {}, "mapping 'relative' absolute differential leaky slew mine.py:Mine"),
        ("absolute", {"leak_s": 1}, "mapping 'absolute' 'leak_s' gain speed_gain dead_zone"),
        ("leaky", {"leak_s": 0}, "mapping 'leaky' 'leak_s' 0; above"),
        ("slew", {"slew_deg_s2": 0}, "mapping 'slew' 'slew_deg_s2' 0; above"),
        ("absolute", {"gain": -1}, "mapping 'absolute' 'gain' -1; above 0"),
        ("absolute", {"dead_zone": 1}, "mapping 'absolute' 'dead_zone' 1; 0, below"),
    ),
    *mistakes(
        partial(validate, PhoneProfile),
        ({"reference_mps2": [0, 0, 5]}, "reference_mps2"),
        ({"reference_mps2": [0, 0, -9.8]}, "reference_mps2"),
    ),
    *mistakes(
        partial(validate, AccelerometerPart),
        ({}, "noise_density_ug bandwidth_hz noise_mg"),
        ({"noise_density_ug": 100}, "noise_density_ug bandwidth_hz noise_mg"),
        ({"noise_mg": 1, "assumed": ["price"]}, "assumed 'price'"),
    ),
    *mistakes(
        partial(validate, RobotProfile),
        ({"max_speed_mps": 3.8}, "max_speed_mps 3.75"),
        ({"max_speed_mps": 1.3, "radius_m": 0.1}, "max_speed_mps 1.25"),
        ({"max_speed_mps": 0.7, "corners_m": NARROW}, "max_speed_mps 0.625"),
        ({"mass_kg": 0}, "mass_kg 0"),
        ({"battery": {"efficiency": 2}}, "battery.efficiency most"),
        ({"reverse": True}, "'reverse'"),
    ),
    *mistakes(
        corners,
        ([0.4, 0.1], [-0.2, 0.1], [-0.2, -0.1], "radius_m corner"),
        ([0.2, 0], [0, 0.2], "corners_m counter-clockwise"),
        ([0.2, 0.1], [0.2, -0.1], [-0.2, 0], "corners_m counter-clockwise"),
        ([0.2, 0], [0.02, 0.02], [0, 0.2], [-0.2, -0.2], "corners_m dents"),
        ([0.2, 0.1], [0.1, 0.1], [0.1, 0.05], [0.2, 0.05], "corners_m around"),
        ([0.2, 0.1], [0, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1], "corners_m dents"),
        ([0.2, 0], [0, 0.2], [-0.2, 0], "corners_m around"),
    ),
    *mistakes(
        partial(validate, SensorConfig),
        ({"name": "radar"}, "'radar' lidar temperature"),
        ({"name": "smoke", "rate_hz": 50}, "rate_hz 20"),
        ({"name": "smoke", "noise": -1}, "noise 0"),
        ({"name": "smoke", "faults": [{"kind": "lost"}]}, "faults at_s mean_time_s"),
        ({"name": "smoke", "faults": [{"kind": "late", "at_s": 1}]}, "lost stuck"),
        ({"name": "smoke", "colour": 1}, "colour"),
    ),
    *mistakes(sensors, ("smoke", "smoke", "sensor 'smoke'")),
    *mistakes(
        drive_of,
        ("operator.strategy", "clever", "'clever'"),
        ("phone.filter", "mean", "filter 'mean' median"),
        ("phone.mapping", "cubic", "mapping 'cubic' absolute"),
        ("phone.accelerometer", "adxl", "accelerometer 'adxl' 'adxl345'?"),
        ("phone.noise_mps2", 1, "phone 'noise_mps2'"),
        ("robot.processing_s", {"law": "gamma", "mean_s": 1}, "gamma needs cv"),
        ("robot.processing_s", {"law": "exponential", "mean_s": 1, "cv": 1}, "exponential no cv"),
        ("robot.processing_s", {"law": "normal", "mean_s": 1}, "robot.processing_s.law: constant"),
        ("robot.processing_s", {"law": "constant", "mean_s": -1}, "robot.processing_s.mean_s: 0"),
        (
            "robot.processing_s",
            {"law": "constant", "mean_s": 1, "c": 1},
            "'robot.processing_s.c'",
        ),
        ("robot.processing_s", "long", "robot.processing_s: number"),
        ("robot.processing_s", -1, "robot.processing_s: 0"),
    ),
]


@each_mistake(MISTAKES)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
