"""Instructions of a scenario: files beside it, with text and steps, and what is refused."""

from pathlib import Path

import pytest

from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.scenario import build, load
from dva_sim.simulation.scenario.instructions import MAX_LINES, read_instructions


def scenario(folder: Path, instructions: str = "{fire: fire.md}") -> Path:
    file = folder / "mine.yaml"
    file.write_text(f"instructions: {instructions}\n")
    return file


def test_lines_of_a_list_are_steps_and_all_others_text(tmp_path):
    file = tmp_path / "fire.md"
    text = "\ufeff# Fire\n\nPeople  first.\n- [ ] Ring 112\n* [x] Doors\n2. Gate\n-dash\n"
    file.write_text(text, encoding="utf-8")
    assert read_instructions(file) == (
        ("Fire", False),
        ("People first.", False),
        ("Ring 112", True),
        ("Doors", True),
        ("Gate", True),
        ("-dash", False),
    )


def test_a_file_is_found_beside_the_scenario(tmp_path, monkeypatch):
    (tmp_path / "fire.md").write_text("- Ring 112\n")
    file = scenario(tmp_path)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    built = build(load(str(file)), {})
    assert built.instructions == {"fire": str(tmp_path / "fire.md")}


def test_a_scenario_without_instructions_is_written_as_before():
    assert "instructions" not in build({}, {}).model_dump(mode="json")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read: No such file"),
        (b"", "have no text"),
        (b"\xff\xfe-", "are no text in UTF-8"),
        (b"- step\n" * (MAX_LINES + 1), f"have {MAX_LINES + 1} lines"),
        (b"- " + b"x" * 300, "more than 256 characters"),
    ],
)
def test_what_is_no_short_text_is_refused_at_its_key(tmp_path, content, words):
    if content is not None:
        (tmp_path / "fire.md").write_bytes(content)
    with pytest.raises(ConfigError, match=words) as caught:
        build(load(str(scenario(tmp_path))), {})
    assert "mine.yaml:1" in str(caught.value)


def test_instructions_for_what_is_no_kind_of_event_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="did you mean 'flood'"):
        build(load(str(scenario(tmp_path, "{floot: fire.md}"))), {})
