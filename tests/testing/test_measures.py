"""A measure of the user's that breaks a promise is found out, each fault by its own line."""

import math
from types import MappingProxyType

import pytest

from dva_sim.cli import checks
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.measure import Measure
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import simulate
from dva_sim.simulation.run_measures import RunMeasure, load_measure
from dva_sim.testing.measures import check_measure
from dva_sim.testing.promises import tried


def measure(
    of, *, name="trial_time_s", meaning="mean time of the trials", models=("task",), **of_it
):
    """A measure of short tasks, which are the quickest runs."""
    about = Measure(name, meaning, **of_it)
    return type("Mine", (RunMeasure,), {"about": about, "models": models, "of": of})


def mean_time(self, trials):
    return sum(trial["trial_time_s"] for trial in trials) / len(trials)


def counts_calls(self, trials):
    self.calls = getattr(self, "calls", 0) + 1
    return float(self.calls)


def remembers_runs(self, trials):
    self.first = getattr(self, "first", trials[0]["trial_time_s"])
    return self.first


def drops_a_trial(self, trials):
    del trials[0]
    return 1.0


def changes_a_trial(self, trials):
    trials[0]["waits"] = 99
    return 1.0


def test_a_measure_that_keeps_its_promises_is_told_nothing():
    outcome = tried(check_measure, measure(mean_time))
    assert (outcome.broken, outcome.warnings, outcome.tries) == ((), (), 6)


@pytest.mark.system
def test_the_shipped_example_keeps_its_promises():
    name = "nearest_person.py:NearestPerson"
    assert tried(check_measure, name, slow=60.0).broken == ()
    assert checks.check(["measure", name], []) == 0


def test_what_a_dead_dva_never_heard_of_counts_as_unattended():
    at_a_guard = {"kind": "flood", "position": [12, 4], "reported": True}
    plan = {
        "site": {"name": "hall"},
        "robot": {"count": 0},
        "operator": {"count": 0},
        "guard": {"count": 1, "mobilisation_s": 1},
        "events": [at_a_guard | {"at_s": 5}, at_a_guard | {"kind": "fire", "at_s": 80}],
        "dva": {"deaths": [{"at_s": 70}]},
        "horizon_s": 100,
    }
    recording = simulate(scenarios.build(plan), 1)
    response, share = (
        load_measure(f"arrivals.py:{name}").of(recording)
        for name in ("NoticedResponse", "Unattended")
    )
    assert share == 0.5
    (event,) = recording.events
    assert response == pytest.approx((event.times["arrived"] - 5.0 + 100.0) / 2)


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (measure(lambda *_: math.inf), "answers what is no finite number and not None: inf of"),
        (measure(lambda *_: "much"), "answers what is no finite number and not None: 'much' of"),
        (measure(lambda *_: [1.0]), "answers what is no finite number and not None: [1.0] of"),
        (measure(lambda *_: -1.0), "leaves its bounds: -1 of tasks/fitts-lag, seed 1; bounds 0 "),
        (measure(lambda *_: 3.0, high=2.0), "leaves its bounds: 3 of"),
        (measure(drops_a_trial), "changes the recording: of tasks/fitts-lag, seed 1"),
        (measure(changes_a_trial), "changes the recording: of tasks/fitts-lag, seed 1"),
        (measure(counts_calls), "answers differently when it is asked again: 1.0, 2.0 of"),
        (measure(remembers_runs), "a new copy answers differently: "),
        (measure(lambda *_: 1 / 0), "raises: ZeroDivisionError: division by zero (test_measures"),
        (measure(mean_time, meaning=" "), "does not say what it means: about.meaning of"),
        (measure(mean_time, name="waits"), "is called as another measure is: waits"),
        (measure(mean_time, low=2.0, high=1.0), "has bounds that nothing is within: 2 to 1"),
    ],
)
def test_a_broken_promise_is_told_in_a_plain_line(make, expected):
    outcome = tried(check_measure, make)
    assert any(line.startswith(expected) for line in outcome.broken), outcome.broken


def test_a_measure_that_never_says_anything_earns_a_warning():
    outcome = tried(check_measure, measure(lambda *_: None))
    assert outcome.broken == ()
    assert len(outcome.warnings) == 1


def test_a_slow_measure_earns_a_warning():
    (warning,) = tried(check_measure, measure(mean_time), slow=0.0).warnings
    assert warning.startswith("is slow: ")


def test_a_measure_of_no_model_of_ours_cannot_be_tried():
    with pytest.raises(ConfigError, match="models"):
        tried(check_measure, measure(mean_time, models=("mine.py:Mine",)))


def test_a_file_that_changed_is_read_again(tmp_path):
    import os

    text = (
        "from dva_sim.kernel.measure import Measure\n"
        "from dva_sim.simulation.run_measures import RunMeasure\n"
        "class Mine(RunMeasure):\n"
        "    about = Measure('b_s', 'x')\n"
        "    def of(self, recording): return NUMBER\n"
    )
    file = tmp_path / "mine.py"
    for number in (1.0, 2.0):
        file.write_text(text.replace("NUMBER", str(number)))
        os.utime(file, (number, number))
        assert load_measure("mine.py:Mine", tmp_path).of(MappingProxyType({})) == number
