"""Names that modules once had."""

from importlib import import_module

import pytest
from helpers.wording import unnamed

from dva_sim.core.dispatch import load_policy
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.moved import MOVED
from dva_sim.kernel.plugins import error_text


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
