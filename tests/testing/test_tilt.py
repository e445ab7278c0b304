"""Promises of filters and mappings: kept by the shipped ones, missed by the bad ones."""

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


AGELESS = property(lambda self: math.nan if self._sample[0] else 0.0)


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        (gives(lambda level: math.nan if level > 8 else level), "no number: level nan, "),
        (gives(lambda level: 1.5 * level), "range of its input: level "),
        (gives(lambda _: 0.1), "before the first sample: level 0.1, 0 deg/s"),
        (Sum, "ten minutes: "),
        (Shared, "other copies, or draws random numbers: value 1"),
        (Forgetful, "when it is asked, though it has no batch: sample 1"),
        (but(NoFilter, age=3.0), "0.0 samples behind a rising input; age says 3.0"),
        (but(NoFilter, age=AGELESS), "0.0 samples behind a rising input; age is nan"),
        (but(NoFilter, add=leave), "raises: SystemExit: 3 (test_tilt.py:"),
    ],
)
def test_a_promise_that_a_filter_breaks_is_told_in_a_plain_line(kind, expected):
    outcome = tried(check_filter, kind, slow=60.0)
    assert any(expected in line for line in outcome.broken), outcome.broken


def commands(base, command):
    """A mapping that gives its base something else, or an answer of its own."""
    given = base.command
    return but(base, command=lambda self, *now: command(lambda *other: given(self, *other), *now))


class Restless(DifferentialMapping):
    def command(self, level, turn, dt):
        return super().command(level, 1.01 * turn + 0.1 * self._turn, dt)


ONE, TWO = AbsoluteMapping, DifferentialMapping


def half(self, wanted, *_):
    return wanted[0], 0.5 * wanted[1]


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        (commands(ONE, lambda _, level, turn, dt: (level, turn)), "limits of a command: "),
        (Restless, "faster and faster at rest: after level 3, -12 deg/s"),
        (commands(ONE, lambda honest, a, *b: honest(a + 1.0, *b)), "level 1 after level 8, 25 deg"),
        (but(TWO, begin=lambda self: None), "the drive before: after begin()"),
        (but(TWO, integrates=False), "readings before, though it does not integrate"),
        (but(ONE, tilt_for=half), "level 5, 10 deg/s when level 5, 20 deg/s "),
        (
            commands(TWO, lambda honest, a, b, dt: honest(a, b, 0.03)),
            "level 5.7, 30 deg/s after 68 half steps",
        ),
        (commands(ONE, lambda honest, a, b, c: honest(a, max(b, -5.0), c)), "level 3.8, 11.4 deg"),
    ],
)
def test_a_promise_that_a_mapping_breaks_is_told_in_a_plain_line(kind, expected):
    outcome = tried(check_mapping, kind, slow=60.0)
    assert any(expected in line for line in outcome.broken), outcome.broken


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
    ("says", "expected"),
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
    tmp_path, capsys, says, expected
):
    path = tmp_path / "odd.py"
    path.write_text(
        "from dva_sim.agents.tilt.filters import NoFilter\n"
        f"class Odd(NoFilter):\n    {says}\n"
        "    def add(self, sample): super().add(sample)\n"
    )
    line = f"filter '{path}:Odd': {expected}"
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


def test_options_are_checked_with_a_mapping(capsys):
    assert checks.check(["mapping", "leaky"], ["leak_s=-1"]) == 1
    assert not unnamed(capsys.readouterr().out, "option 'leak_s' is -1;", "above 0")
