"""Checks for users' own test suites: one entry for each kind of plug-in."""

import pytest
from helpers.wording import unnamed

from dva_sim import testing
from dva_sim.agents.operator.strategies import Pursuit
from dva_sim.agents.tilt.filters import MovingMedian
from dva_sim.cli import checks
from dva_sim.core.dispatch import MinEta
from dva_sim.testing.docstring_words import from_docstrings
from dva_sim.testing.promises import TRIALS, plural
from dva_sim.testing.shipped_words import shipped_words


class Greedy(MinEta):
    """Sends everybody to the first task."""

    def advise(self, situation, rng):
        first = super().advise(situation, rng)
        return [*first, *first]


@pytest.mark.parametrize("kind", TRIALS)
def test_every_kind_has_plugins_and_a_function_that_tries_it(kind):
    trial = TRIALS[kind]
    plugins = trial.load_plugins()
    assert plugins.known() or plugins.files()
    assert trial.known() or plugins.files()
    assert getattr(testing, f"check_{kind}") is trial.load_check()
    assert f"check_{kind}" in dir(testing)
    assert trial.group == plugins.group
    assert trial.words().keys() == plugins.shipped.keys() - plugins.hidden
    assert "2 " in trial.ways(testing.Outcome((), (), 2, 0.001))


def test_the_words_of_shipped_plugins_are_their_docstrings():
    """`python -m dva_sim.testing.docstring_words` writes them again."""
    assert shipped_words() == from_docstrings()


SHIPPED = {
    "policy": ("min_eta", "patrol.py:Patrol"),
    "robot": ("servrobot", "tracked.py:Tracked"),
    "filter": ("median", "faithful.py:Faithful"),
    "mapping": ("leaky", "cubic.py:Cubic"),
    "pattern": ("latest-wins", "acknowledged_pub_sub.py:AcknowledgedPubSub"),
    "operator": ("pursuit", "stepwise.py:Stepwise"),
}


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=[pytest.mark.system] * (k == "policy")) for k in SHIPPED]
)
def test_what_is_shipped_is_checked_by_its_name(fewer, capsys, kind):
    assert checks.check([kind, *SHIPPED[kind]]) == 0
    lines = capsys.readouterr().out.splitlines()
    for name in SHIPPED[kind]:  # a busy machine has warnings, too
        assert any(line.startswith(f"{name}: {kind}: valid; ") for line in lines)
    assert lines[-1] == f"2 {plural(kind)}: 2 valid"


@pytest.mark.parametrize(
    ("kind", "base", "method"),
    [
        ("policy", "core.dispatch.Policy", "advise"),
        ("robot", "worlds.drives.Drive", "accelerations"),
        ("filter", "agents.tilt.filters.NoFilter", "add"),
        ("mapping", "agents.tilt.mappings.AbsoluteMapping", "command"),
        ("pattern", "network.patterns.PubSub", "offer"),
        ("operator", "agents.operator.strategies.Strategy", "drive"),
    ],
)
@pytest.mark.parametrize("error", ["ZeroDivisionError", "SystemExit"])
def test_a_class_in_a_file_that_fails_or_ends_the_program_is_told_with_its_line(
    fewer, tmp_path, capsys, kind, base, method, error
):
    module, _, name = base.rpartition(".")
    head = f"from dva_sim.{module} import {name}\nclass Bad({name}):\n"
    (tmp_path / "bad.py").write_text(f"{head}    def {method}(self, *_): raise {error}('no')\n")
    mine = f"{tmp_path}/bad.py:Bad"
    assert checks.check([kind, mine]) == 1
    first, second, last = capsys.readouterr().out.splitlines()
    assert unnamed(first, f"{mine}: raises: {error}: no", "(bad.py:3)") == []
    assert unnamed(second, f"{mine}: {kind}: invalid", " 1 ") == []
    assert last == f"1 {kind}: 1 invalid"


@pytest.mark.system
def test_what_keeps_its_promises_is_tried_by_its_name_or_its_class(fewer):
    assert testing.check_policy("min_eta", count=1).tries == 1
    assert testing.check_policy(MinEta, count=2).tries == 2
    assert testing.check_filter(MovingMedian, {"window": 5}).broken == ()
    assert testing.check_operator(Pursuit).broken == ()


def test_what_breaks_them_fails_the_test_with_a_line_for_each():
    with pytest.raises(AssertionError, match=r"task 0 .*situation 1") as failed:
        testing.check_policy(Greedy, count=3)
    assert failed.value.outcome.broken == tuple(str(failed.value).splitlines())


def test_there_is_no_check_of_what_is_no_kind():
    with pytest.raises(AttributeError, match="'check_car'"):
        _ = testing.check_car


def test_several_of_a_kind_are_called_as_in_english():
    assert [plural(kind) for kind in ("policy", "robot")] == ["policies", "robots"]
