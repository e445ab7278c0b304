"""A model of the user's that breaks a promise is found out, each fault by its own line."""

import math

import pytest
from helpers.wording import unnamed

from dva_sim.cli import checks
from dva_sim.kernel.errors import ConfigError
from dva_sim.testing.models import check_model
from dva_sim.testing.promises import tried

COIN = """\
import math, random
from dva_sim.kernel.measure import Measure, text
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.models import Model, OwnScenario

calls = []

class Coins(OwnScenario):
    throws: int = 20

class Coin(Model):
    scenario = Coins
    columns = {"runs": (Measure("heads", "coins that fell so", low=0, high=20), text("last", "x"))}

    def complete(self, scenario, error):
        if scenario.throws < 1:
            raise error("nobody throws", ("throws",))
        return scenario

    def simulate(self, scenario, seed):
        return Streams(seed)["coin"].integers(0, 2, min(scenario.throws, 20)).tolist()

    def rows(self, recording, with_tracks=False):
        return {"runs": [{"heads": sum(recording), "last": "head" if recording[-1] else "tail"}]}
"""


def coin(tmp_path, *changes):
    text = COIN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "coin.py").write_text(text)
    return f"{tmp_path}/coin.py:Coin"


def test_a_model_that_keeps_its_promises_is_told_nothing(tmp_path):
    outcome = tried(check_model, coin(tmp_path), {})
    assert (outcome.broken, outcome.warnings) == ((), ())


def test_the_shipped_example_keeps_its_promises():
    assert tried(check_model, "alarm_queue.py:AlarmQueue", {}).broken == ()
    assert checks.check(["model", "alarm_queue.py:AlarmQueue"], []) == 0


ROWS = '"heads": sum(recording), '


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('Streams(seed)["coin"].integers(0, 2, min(scenario.throws, 20)).tolist()',
         "[random.randint(0, 1) for _ in range(9)]", "comes to something else with the same seed"),
        ("Streams(seed)", 'calls.append(seed) or Streams(len(calls))',
         "comes to something else with the same seed: seed 3"),
        (ROWS, '"heads": math.inf, ', "has an infinite number: heads = inf in row 1 of 'runs'"),
        (ROWS, '"heads": -1, ', "leaves the bounds of a column: heads = -1 in row 1 of 'runs'; b"),
        (ROWS, '"heads": "many", ', "has no number in a column of numbers: heads = 'many'"),
        (ROWS, f'{ROWS}"tails": 1, ', "has a column that it does not declare: tails = 1 in row 1"),
        (ROWS, "", "lacks a measure that a study may ask for: heads"),
        ('"head" if recording[-1] else "tail"', "1", "has something else than words in a column"),
        ("}]}", "}] * 2}", "has not one row for a run: 2 in table 'runs'"),
        ("}]}", '}], "throws": []}', "has a table that it does not declare: throws"),
        ("scenario.throws < 1", "scenario.throws < 0",
         "fails in a run that its rehearsal let through: IndexError: list index out of range"),
        ("def simulate(self, scenario, seed):\n",
         "def simulate(self, scenario, seed):\n        scenario.__dict__['throws'] += 1\n",
         "changes its scenario: "),
        ("    throws: int = 20", "    throws: int = 20\n    def __reduce__(self):\n"
         "        return (type(self), ())", "raises: "),
    ],
)  # fmt: skip
def test_a_broken_promise_is_told_in_a_plain_line(tmp_path, old, new, expected):
    outcome = tried(check_model, coin(tmp_path, (old, new)), {})
    assert any(line.startswith(expected) for line in outcome.broken), outcome.broken


def test_a_model_that_heeds_no_seed_earns_a_warning(tmp_path):
    outcome = tried(check_model, coin(tmp_path, ("Streams(seed)", "Streams(1)")), {})
    (warning,) = outcome.warnings
    assert not unnamed(warning, "same", "seed")


def test_a_scenario_that_cannot_be_is_told_before_anything_is_tried(tmp_path):
    with pytest.raises(ConfigError, match="nobody throws; --set"):
        tried(check_model, coin(tmp_path), {"throws": 0})


def test_the_example_waits_as_long_as_erlang_says():
    """M/M/2 at a load of 0.6: the mean wait is C(2, 1.2) / (2/120 - 1/100) = 67.5 s."""
    from dva_sim.simulation import scenario as scenarios
    from dva_sim.simulation.models import model_of

    document = scenarios.load("alarm-queue")
    model = model_of(document)
    scenario = model.build(document, {"alarms": 100_000})
    waits = [model.tables(scenario, s, False)["runs"][0]["wait_mean_s"] for s in range(2)]
    assert math.isclose(sum(waits) / 2, 67.5, rel_tol=0.03)
