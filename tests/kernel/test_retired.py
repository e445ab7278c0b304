"""Retired public names, and what they answer with."""

from importlib import import_module

import pytest
from helpers.wording import unnamed

from dva_sim.cli.program import call
from dva_sim.kernel.plugins import error_text
from dva_sim.kernel.retired import MOVED, RETIRED


@pytest.mark.parametrize(("old", "new"), MOVED.items())
def test_an_earlier_name_is_known_by_the_module_that_is_there_now(old, new):
    with pytest.raises(ModuleNotFoundError) as error:
        import_module(f"dva_sim.{old}")
    assert f"dva_sim.{new}" in error_text(error.value)
    import_module(f"dva_sim.{new}")


def test_a_module_that_there_never_was_has_no_other_name():
    with pytest.raises(ModuleNotFoundError, match=r"'dva_sim\.never'") as error:
        import_module("dva_sim.never")
    assert "now" not in error_text(error.value)


COMMANDS = {
    "--transport": ("live", "console"),
    "--figure": ("report",),
    "--mutants": ("storm",),
}


@pytest.mark.parametrize(("option", "instead"), RETIRED["option"].items())
def test_a_retired_option_is_answered_in_one_line_by_every_command_that_had_it(
    option, instead, capsys
):
    for command in COMMANDS.get(option, ("episode", "replay")):
        assert call([command, "x", option, "3"]) == 2
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 1
        assert unnamed(lines[0], option, instead) == []
