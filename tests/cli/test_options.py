"""Options of commands are those of the functions of their names, declared once."""

import inspect
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import typer
from helpers.wording import unnamed

import dva_sim
from dva_sim.cli import app
from dva_sim.cli.commands import CommandWithExamples
from dva_sim.cli.options import Quiet, takes

PROGRAM = typer.main.get_command(app)
COMMANDS = {name: PROGRAM.get_command(None, name) for name in PROGRAM.list_commands(None)}
TWINS = sorted(set(COMMANDS) & set(dva_sim.__all__))

# What a terminal has beside a function, and what only a program has.
ADDED = {
    "compare": {"measure", "by", "fail_if", "as_json"},
    "episode": {"quiet", "verbose"},
    "replay": {"console", "host", "port", "no_open", "no_token", "quiet", "verbose"},
    "report": {"quiet", "verbose"},
    "run": {"dry_run", "quiet", "verbose"},
    "show": {"as_json"},
    "tune": {"quiet", "verbose"},
}
FOR_PROGRAMS = {"run": {"progress", "report"}, "tune": {"progress"}}


def test_each_function_but_two_has_a_command():
    functions = {name for name in dva_sim.__all__ if name.islower()}
    assert functions - {*TWINS} == {"dry_run", "load"}


@pytest.mark.parametrize("name", TWINS)
def test_a_command_takes_what_its_function_takes_with_its_defaults_and_words(name):
    function = getattr(dva_sim, name)
    asked = inspect.signature(function).parameters
    options = {option.name: option for option in COMMANDS[name].params}
    assert set(options) - set(asked) == ADDED.get(name, set())
    assert set(asked) - set(options) == FOR_PROGRAMS.get(name, set())
    told = " ".join(inspect.getdoc(function).replace("`", "").split())
    for each in asked.keys() & options.keys():
        needed = asked[each].default is inspect.Parameter.empty
        assert options[each].required == needed
        assert options[each].default == (None if needed else asked[each].default)
        words = options[each].help.removesuffix("; may be given again.").removesuffix(".")
        assert words
        assert f" {each}: {words}" in told


def test_each_option_of_each_command_has_words():
    site = COMMANDS["site"]
    for command in (*COMMANDS.values(), *map(partial(site.get_command, None), ("show", "export"))):
        assert [option.name for option in command.params if not option.help] == []


def planted(
    study: str | Path,
    *,
    loud: bool = False,
    twice_s: int = 2,
    mark: str | None = None,
    kept_in: str | Path | None = None,
    weight: float | None = None,
    set: Any = (),
    secret: Any = None,
) -> None:
    """Do something.

    Args:
        study: A study.
        loud: Loudly, and
            twice. In a notebook it blinks.
        twice_s: How often.
        mark: `X.csv`.
        kept_in: Where.
        weight: How much.
        set: A key. Or several.
        secret: Is for programs.
    """


def test_a_new_option_of_a_function_is_one_of_its_command(capsys):
    seen = []

    @takes(planted, but=("secret",))
    def command(study: str, quiet: Quiet = False, **asked: Any) -> None:
        seen.append((study, quiet, asked))

    program = typer.Typer(rich_markup_mode=None, add_completion=False)
    program.command(cls=CommandWithExamples)(command)
    program(["--help"], standalone_mode=False)
    told = {" ".join(line.split()) for line in capsys.readouterr().out.splitlines()}
    assert {
        *("STUDY A study.", "--loud Loudly, and twice."),
        *("--mark NAME X.csv.", "--kept-in FILE Where.", "--weight NUMBER How much."),
    } <= told
    assert unnamed(told, "--twice-s N How", "[default: 2]", "--set KEY=VALUE A key;") == []
    assert unnamed(told, "again.", "-q, --quiet ") == []
    assert not any("secret" in line for line in told)
    words = ["mine", "--loud", "--twice-s", "3", "--weight", "0.5", "--set", "a=1", "--set", "b=2"]
    program(words, standalone_mode=False)
    given = {"loud": True, "twice_s": 3, "weight": 0.5, "set": ["a=1", "b=2"]}
    assert seen == [("mine", False, given | {"mark": None, "kept_in": None})]
    with pytest.raises(typer.BadParameter, match=r"'-1' .*at least 0"):
        program(["mine", "--twice-s", "-1"], standalone_mode=False)
