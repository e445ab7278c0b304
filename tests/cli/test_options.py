"""Options of a command are declared once: the command line and the function are made of that."""

import inspect
from dataclasses import dataclass, is_dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import pytest
import typer
from helpers.wording import unnamed

import dva_sim
from dva_sim import api
from dva_sim.cli import app
from dva_sim.cli.commands import CommandWithExamples
from dva_sim.cli.options import Quiet, from_words
from dva_sim.options import runs, studies
from dva_sim.options.forms import OptionForm, argument, make_forms

PROGRAM = typer.main.get_command(app)
COMMANDS = {name: PROGRAM.get_command(None, name) for name in PROGRAM.list_commands(None)}
FUNCTIONS = sorted({name for name in dva_sim.__all__ if name.islower()} - {"load"})
CLASSES = [of for module in (runs, studies) for of in vars(module).values() if is_dataclass(of)]

# What a terminal has beside a function, and what only a program has.
ADDED = {
    "compare": {"measure", "by", "fail_if", "as_json"},
    "episode": {"quiet", "verbose"},
    "replay": {"console", "host", "port", "no_open", "no_token", "users", "quiet", "verbose"},
    "report": {"quiet", "verbose"},
    "run": {"dry_run", "quiet", "verbose"},
    "show": {"as_json"},
    "tune": {"quiet", "verbose"},
}
FOR_PROGRAMS = {"run": {"progress", "report"}, "tune": {"progress"}}


def test_each_function_but_two_has_a_command():
    assert set(FUNCTIONS) - set(COMMANDS) == {"dry_run"}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_takes_the_options_of_its_command_with_their_defaults_and_words(name):
    function = getattr(dva_sim, name)
    declared = getattr(api, function.__wrapped__.__annotations__["options"])
    asked = inspect.signature(function).parameters
    assert {n: p.default for n, p in asked.items()} == {
        n: p.default for n, p in inspect.signature(declared).parameters.items()
    }
    text = " ".join(inspect.getdoc(function).split())
    for each, (_, form) in make_forms(declared).items():
        assert f" {each}: {form.for_programs}" in text


@pytest.mark.parametrize("name", sorted({*FUNCTIONS} & {*COMMANDS}))
def test_a_command_takes_what_its_function_takes(name):
    asked = inspect.signature(getattr(dva_sim, name)).parameters
    options = {option.name: option for option in COMMANDS[name].params}
    assert set(options) - set(asked) == ADDED.get(name, set())
    assert set(asked) - set(options) == FOR_PROGRAMS.get(name, set())
    for each in asked.keys() & options.keys():
        needed = asked[each].default is inspect.Parameter.empty
        assert options[each].required == needed
        assert options[each].default == (None if needed else asked[each].default)


def test_each_option_of_each_command_has_words():
    site = COMMANDS["site"]
    for command in (*COMMANDS.values(), *map(partial(site.get_command, None), ("show", "export"))):
        assert [option.name for option in command.params if not option.help] == []


@pytest.mark.parametrize("options", CLASSES)
def test_each_option_has_words_for_programs(options):
    assert [name for name, (_, form) in make_forms(options).items() if not form.for_programs] == []


def test_a_function_refuses_what_its_command_does_not_know():
    with pytest.raises(TypeError, match="'job'"):
        dva_sim.run("filters", job=3)


@dataclass(frozen=True)
class PlantedOptions:
    study: Annotated[str | Path, argument("A study.", "STUDY")]
    full: Annotated[bool, OptionForm("All of it.")] = False
    rows: Annotated[int | None, OptionForm("So many.", least=1)] = 2
    set: Annotated[tuple[str, ...], OptionForm("Changes.", is_repeated=True)] = ()
    secret: Annotated[object, OptionForm(also="For programs.")] = None


@dataclass(frozen=True)
class FormlessOptions:
    secret: object = None


def test_a_command_is_given_its_options_in_one_piece_and_what_it_has_itself(capsys):
    seen = []

    def command(options: PlantedOptions, quiet: Quiet = False) -> None:
        seen.append((options, quiet))

    program = typer.Typer(rich_markup_mode=None, add_completion=False)
    program.command(cls=CommandWithExamples)(from_words(command))
    program(["--help"], standalone_mode=False)
    output = " ".join(capsys.readouterr().out.split())
    assert unnamed(output, "STUDY", "--full", "--rows N", "[default: 2]", "-q, --quiet ") == []
    assert "secret" not in output
    words = ["mine", "--full", "--rows", "3", "--set", "a=1", "--set", "b=2"]
    program(words, standalone_mode=False)
    assert seen == [(PlantedOptions("mine", full=True, rows=3, set=("a=1", "b=2")), False)]
    with pytest.raises(typer.BadParameter, match=r"'0' .*at least 1"):
        program(["mine", "--rows", "0"], standalone_mode=False)


def test_an_option_without_a_form_is_named_when_the_command_is_made():
    def command(options: FormlessOptions) -> None: ...

    with pytest.raises(LookupError, match="secret"):
        from_words(command)
