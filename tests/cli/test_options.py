"""Options of commands are the parameters of the functions of their names, with their words."""

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
    text = " ".join(inspect.getdoc(function).replace("`", "").split())
    for each in asked.keys() & options.keys():
        needed = asked[each].default is inspect.Parameter.empty
        assert options[each].required == needed
        assert options[each].default == (None if needed else asked[each].default)
        words = options[each].help.removesuffix("; may be given again.").removesuffix(".")
        assert words
        assert f" {each}: {words}" in text


def test_each_option_of_each_command_has_words():
    site = COMMANDS["site"]
    for command in (*COMMANDS.values(), *map(partial(site.get_command, None), ("show", "export"))):
        assert [option.name for option in command.params if not option.help] == []


def planted(study: str | Path, *, full: bool = False, rows: int = 2, secret: Any = None) -> None:
    """Do something."""


def test_a_command_takes_the_options_of_its_function_and_hands_on_what_it_does_not_look_at(capsys):
    seen = []

    @takes(planted, but=("secret",))
    def command(study: str, quiet: Quiet = False, **asked: Any) -> None:
        seen.append((study, quiet, asked))

    program = typer.Typer(rich_markup_mode=None, add_completion=False)
    program.command(cls=CommandWithExamples)(command)
    program(["--help"], standalone_mode=False)
    output = " ".join(capsys.readouterr().out.split())
    assert unnamed(output, "STUDY", "--full", "--rows N", "[default: 2]", "-q, --quiet ") == []
    assert "secret" not in output
    program(["mine", "--full", "--rows", "3"], standalone_mode=False)
    assert seen == [("mine", False, {"full": True, "rows": 3})]
    with pytest.raises(typer.BadParameter, match=r"'0' .*at least 1"):
        program(["mine", "--rows", "0"], standalone_mode=False)


def test_a_parameter_without_a_form_is_named_when_the_command_is_defined():
    with pytest.raises(LookupError, match="secret"):
        takes(planted)(print)
