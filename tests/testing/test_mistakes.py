"""Mistakes in calls of the checks of plug-ins, and classes that cannot be plug-ins."""

from operator import call
from pathlib import Path

from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file

from dva_sim import testing
from dva_sim.agents.operator.strategies import Pursuit
from dva_sim.cli import checks
from dva_sim.core.dispatch import MinEta
from dva_sim.simulation.run_measures import load_measure
from dva_sim.testing.files import schema_text
from dva_sim.worlds.hazards import make_hazard


def checked(words, options=()):
    checks.check(words.split(), list(options))


def measure_of_file(name):
    load_measure(f"{name}:Mine", Path())


def measure(body):
    head = "from dva_sim.kernel.measure import Measure\n"
    head += "from dva_sim.simulation.run_measures import RunMeasure\n"
    of_file(measure_of_file, "mine.py")(f"{head}class Mine(RunMeasure):\n    {body}\n")


def hazard_of_file(name):
    make_hazard(f"{name}:Mine", (0.0, 0.0), 0.0)


def hazard(words):
    head = f"from dva_sim.worlds.hazards import Hazard\nclass Mine(Hazard):\n    {words}\n"
    of_file(hazard_of_file, "mine.py")(f"{head}    def field(self, site): ...\n")


MISTAKES = [
    *mistakes(
        checked,
        ("link wifi", "check link"),
        ("link", ("delay_s=1",), "check link"),
        ("policy", "mine.py:Mine, auction,"),
        ("robot", "mine.py:Mine, pibot, servrobot"),
        ("study.yaml", ("margin=0",), "--set policies"),
    ),
    *mistakes(schema_text, ("sites", "'site'")),
    *mistakes(
        call,
        (lambda: testing.check_policy(MinEta, {"speed": 3}), "'MinEta' 'speed'"),
        (lambda: testing.check_policy(Pursuit), "'Pursuit' policy"),
        (lambda: testing.check_filter("mean"), "'mean'"),
        (lambda: testing.check_operator("oracle"), "sees nothing"),
    ),
    *mistakes(
        measure,
        ("def of(self, recording): return 1.0", "about Measure"),
        ("about = Measure('a b', 'x')\n    def of(self, r): return 1.0", "'a b';"),
        ("about = Measure('b_s', 'x')", "of(recording);"),
    ),
    *mistakes(
        hazard,
        ('reported_as = "quake"', "mine.py Mine"),
        ('reported_as, shows = "fire", ("dust",)', "mine.py Mine"),
    ),
]


@each_mistake(MISTAKES)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
