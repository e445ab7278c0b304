"""What every filter and mapping promises: kept by all that are shipped, missed by the bad ones."""

import math

import pytest
from helpers.wording import unnamed

from dva_sim.agents.tilt import Filter, PhoneProfile, known_filters, known_mappings, try_phone
from dva_sim.agents.tilt.filters import GuardedFilter, NoFilter
from dva_sim.agents.tilt.mappings import AbsoluteMapping, DifferentialMapping
from dva_sim.cli import checks
from dva_sim.kernel.errors import ConfigError
from dva_sim.testing.promises import tried
from dva_sim.testing.tilt import check_filter, check_mapping

STICKS = {
    "median20-copy": ("sticks where only 6 of 20 samples are fresh: 0 for 2",),
    "median20-inplace": ("sticks where only 6 of 20 samples are fresh: 8 for 2",),
}


@pytest.mark.parametrize("name", [*known_filters(), "faithful.py:Faithful"])
def test_every_filter_that_is_shipped_keeps_its_promises(name):
    outcome = tried(check_filter, name, slow=60.0)
    assert (outcome.broken, outcome.warnings) == ((), STICKS.get(name, ()))


@pytest.mark.parametrize("name", [*known_mappings(), "cubic.py:Cubic"])
def test_every_mapping_that_is_shipped_keeps_its_promises(name):
    outcome = tried(check_mapping, name, slow=60.0)
    assert (outcome.broken, outcome.warnings) == ((), ())


def but(base, **changed):
    """A filter or mapping that is good but for this."""
    return type("Bad", (base,), changed)


def gives(value):
    """A filter that makes something else of its level."""
    return but(NoFilter, value=lambda self: (value(level := self._sample[0]), 0.0 * level))


def leave(self, sample):
    raise SystemExit(3)


class Sum(Filter):
    total = 0.0

    def add(self, sample):
        self.total = 0.999 * self.total + 0.001 * sample[0] if sample[0] > 0 else self.total

    def value(self):
        return self.total, 0.0


class Forgetful(NoFilter):
    def value(self):
        given, self._sample = self._sample, (0.0, 0.0)
        return given


seen = []
Shared = but(
    NoFilter,
    add=lambda self, sample: seen.append(sample),
    value=lambda self: seen[-1] if seen[:1] else (0.0, 0.0),
)


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        (
            gives(lambda level: math.nan if level > 8 else level),
            "answers what is no number: level nan, ",
        ),
        (gives(lambda level: 1.5 * level), "leaves the range of its input: level "),
        (gives(lambda _: 0.1), "is not zero before the first sample: level 0.1, 0 deg/s"),
        (Sum, "does not come to what stands for ten minutes: "),
        (Shared, "shares memory with other copies, or draws random numbers: value 1"),
        (Forgetful, "changes when it is asked, though it has no batch: sample 1"),
        (
            but(NoFilter, age=3.0),
            "is not as old as it says: 0.0 samples behind a rising input; age says 3.0",
        ),
        (
            but(NoFilter, age=property(lambda self: math.nan if self._sample[0] else 0.0)),
            "is not as old as it says: 0.0 samples behind a rising input; age is nan",
        ),
        (but(NoFilter, add=leave), "raises: SystemExit: 3 (test_tilt.py:"),
        (but(NoFilter, add=lambda *_: 1 / 0), "raises: ZeroDivisionError: division by zero (test_"),
    ],
)
def test_a_promise_that_a_filter_breaks_is_told_in_a_plain_line(kind, told):
    outcome = tried(check_filter, kind, slow=60.0)
    assert any(line.startswith(told) for line in outcome.broken), outcome.broken


def commands(base, command):
    """A mapping that gives its base something else, or an answer of its own."""
    given = base.command
    return but(base, command=lambda self, *now: command(lambda *other: given(self, *other), *now))


class Restless(DifferentialMapping):
    def command(self, level, turn, dt):
        return super().command(level, 1.01 * turn + 0.1 * self._turn, dt)


ONE, TWO = AbsoluteMapping, DifferentialMapping


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        (
            commands(ONE, lambda _, level, turn, dt: (level, turn)),
            "leaves the limits of a command: ",
        ),
        (Restless, "turns faster and faster at rest: after level 3, -12 deg/s"),
        (
            commands(ONE, lambda honest, level, *rest: honest(level + 1.0, *rest)),
            "drives at rest: level 1 after level 8, 25 deg/s",
        ),
        (
            but(TWO, begin=lambda self: None),
            "remembers the drive before: after begin() it answers differently",
        ),
        (
            but(TWO, integrates=False),
            "depends on readings before, though it does not integrate: in other order",
        ),
        (
            but(ONE, tilt_for=lambda self, wanted, *_: (wanted[0], 0.5 * wanted[1])),
            "does not get where tilt_for tilts to: level 5, 10 deg/s when level 5, 20 deg/s ",
        ),
        (
            commands(TWO, lambda honest, level, turn, dt: honest(level, turn, 0.03)),
            "integrates by steps, not by time: level 5.7, 30 deg/s after 68 half steps, ",
        ),
        (
            commands(ONE, lambda honest, level, turn, dt: honest(level, max(turn, -5.0), dt)),
            "turns left and right differently: for level 3.8, 11.4 deg/s",
        ),
    ],
)
def test_a_promise_that_a_mapping_breaks_is_told_in_a_plain_line(kind, told):
    outcome = tried(check_mapping, kind, slow=60.0)
    assert any(line.startswith(told) for line in outcome.broken), outcome.broken


def test_what_ends_the_program_when_made_or_asked_is_told_in_a_line(tmp_path, capsys):
    path = tmp_path / "leaving.py"
    path.write_text(
        "import sys\n"
        "from dva_sim.agents.tilt import Filter\n"
        "class Made(Filter):\n"
        "    def __init__(self, period): sys.exit('made')\n"
        "    def add(self, sample): pass\n"
        "    def value(self): return 0.0, 0.0\n"
        "class Told(Filter):\n"
        "    def __init__(self, period): pass\n"
        "    def add(self, sample): sys.exit('told')\n"
        "    def value(self): return 0.0, 0.0\n"
        "class Aged(Told):\n"
        "    age = property(lambda self: sys.exit('asked'))\n"
    )
    assert checks.check(["filter", *(f"{path}:{name}" for name in ("Made", "Told", "Aged"))]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert not unnamed(lines[0], "Made'", "SystemExit: made")
    assert not unnamed(lines[1], "Told: raises: SystemExit: told", "(leaving.py:9)")
    assert not unnamed(lines[3], "Aged'", "SystemExit: asked")
    assert lines[4] == "3 filters: 3 invalid"


@pytest.mark.parametrize(
    ("says", "told"),
    [
        ("batch = 0", "its batch is 0;"),
        ("batch = 1001", "its batch is 1001;"),
        ("batch = 2.5", "its batch is 2.5;"),
        ("batch = True", "its batch is True;"),
        ("batch = 'x'", "its batch is 'x';"),
        ("age = 'old'", "its age is 'old';"),
        ("age = -1", "its age is -1;"),
        ("age = float('inf')", "its age is inf;"),
    ],
)
def test_a_filter_that_no_phone_could_work_with_is_refused_wherever_it_is_named(
    tmp_path, capsys, says, told
):
    path = tmp_path / "odd.py"
    path.write_text(
        "from dva_sim.agents.tilt.filters import NoFilter\n"
        f"class Odd(NoFilter):\n    {says}\n"
        "    def add(self, sample): super().add(sample)\n"
    )
    line = f"filter '{path}:Odd': {told}"
    assert checks.check(["filter", f"{path}:Odd"]) == 1
    assert capsys.readouterr().out.startswith(f"{path}:Odd: {line}")
    with pytest.raises(ConfigError) as caught:
        try_phone(PhoneProfile(filter=f"{path}:Odd"))
    assert str(caught.value).startswith(line)
    with pytest.raises(ConfigError, match=r"its (batch|age) is"):
        GuardedFilter(load_class(path), 1 / 34)


def load_class(path):
    found: dict = {}
    exec(path.read_text(), found)
    return found["Odd"](1 / 34)


def test_filters_and_mappings_are_checked_by_name_and_by_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.py").write_text(
        "from dva_sim.agents.tilt import Filter\n"
        "class Bad(Filter):\n"
        "    def add(self, sample): pass\n"
        "    def value(self): return 1.0, 0.0\n"
    )
    assert checks.check(["filter", "median", "faithful.py:Faithful"]) == 0
    lines = capsys.readouterr().out.splitlines()
    said = "median: filter: valid; 40 runs, "
    assert any(line.startswith(said) for line in lines)  # a busy machine has warnings, too
    assert lines[-1] == "2 filters: 2 valid"
    assert checks.check(["filter", "bad.py:Bad"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert not unnamed(lines[0], "bad.py:Bad: ", "first sample", "level 1, 0 deg/s")
    assert checks.check(["mapping", "leaky", "cubic.py:Cubic"], []) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "2 mappings: 2 valid"
    assert checks.check(["mapping", "leaky"], ["leak_s=-1"]) == 1
    assert not unnamed(capsys.readouterr().out, "option 'leak_s' is -1;", "above 0")
