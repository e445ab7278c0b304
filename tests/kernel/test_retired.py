"""Retired public names, and what they answer with."""

from importlib import import_module

import pytest
from helpers.studies import small_study
from helpers.wording import unnamed

import dva_sim
from dva_sim.cli.program import call
from dva_sim.core.dispatch import load_policy
from dva_sim.experiments.study.file_kinds import open_study
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import error_text
from dva_sim.kernel.retired import MOVED, RETIRED
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.models import model_of


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


def test_a_plug_in_that_imports_an_earlier_name_is_told_in_one_line(tmp_path):
    (tmp_path / "mine.py").write_text("from dva_sim.errors import ConfigError\n")
    with pytest.raises(ConfigError) as error:
        load_policy("mine.py:Mine", base=tmp_path)
    assert (
        unnamed(error.value, "ModuleNotFoundError", "dva_sim.errors", "dva_sim.kernel.errors") == []
    )


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


@pytest.mark.parametrize(
    ("function", "name"),
    [
        ("episode", "panels"),
        ("episode", "strip"),
        ("replay", "panels"),
        ("replay", "strip"),
        ("report", "figure"),
    ],
)
def test_a_retired_parameter_is_answered_like_the_option(function, name):
    with pytest.raises(ConfigError) as error:
        getattr(dva_sim, function)("x", **{name: 3})
    assert unnamed(error.value, name, RETIRED["option"][f"--{name}"]) == []


@pytest.mark.parametrize(("key", "instead"), RETIRED["key"].items())
def test_a_retired_key_is_told_with_what_to_write(key, instead, tmp_path):
    outer, _, inner = key.partition(".")
    path = tmp_path / "mine.yaml"
    value = f"{{{inner}: 8}}" if inner else "[mine.py:Mine]"
    path.write_text(f"{small_study.STUDY}{outer}: {value}\n")
    with pytest.raises(ConfigError) as error:
        open_study(path)
    assert unnamed(error.value, key, instead) == []


@pytest.mark.parametrize(("name", "instead"), RETIRED["name"].items())
def test_a_plug_in_that_imports_a_retired_name_is_told_in_one_line(name, instead, tmp_path):
    module = "recordings.reading" if name == "read_lapse" else "statistics"
    (tmp_path / "mine.py").write_text(f"from dva_sim.{module} import {name}\n")
    with pytest.raises(ConfigError) as error:
        load_policy("mine.py:Mine", base=tmp_path)
    assert unnamed(error.value, name, instead) == []


def test_a_model_of_ones_own_is_told_what_to_use(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("model: mine.py:Mine\n")
    with pytest.raises(ConfigError) as error:
        model_of(load_yaml(path))
    assert unnamed(error.value, RETIRED["model"]["FILE:CLASS"]) == []
