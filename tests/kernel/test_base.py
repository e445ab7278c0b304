"""Clock, streams, configuration and names: what everything else stands on."""

import itertools

import numpy as np
import pytest

from dva_sim.kernel import resources
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams, derive_seed
from dva_sim.kernel.yaml_files import load_yaml


class Inner(Config):
    delay_s: float = 0.0


class Outer(Config):
    name: str
    inner: Inner = Inner()
    items: tuple[Inner, ...] = ()


class Pair(Config):
    one: int
    other: int
    size: tuple[int, int] = (1, 1)


def test_keys_that_are_missing_are_told_together():
    with pytest.raises(ConfigError) as told:
        validate(Pair, {})
    assert told.value.problem == "missing keys 'one' and 'other'"
    with pytest.raises(ConfigError) as told:
        validate(Pair, {"one": 1, "other": 2, "size": [1]})
    assert told.value.problem == "size: should have at least 2 items"


def test_simultaneous_events_run_in_the_order_they_were_scheduled():
    clock, seen = Clock(), []
    clock.call_at(0.3, seen.append, "first")
    clock.call_after(0.1, lambda: clock.call_after(0.2, seen.append, "second"))
    clock.run(1.0)
    assert seen == ["first", "second"]
    assert clock.now == 1.0


def test_a_periodic_event_does_not_drift_in_a_million_periods():
    clock, times = Clock(), []
    clock.every(0.1, lambda: times.append(clock.now))
    clock.run(10_000.0)
    assert times[99_999] == 9_999.9


def test_a_periodic_event_ends_when_it_returns_false():
    clock, times = Clock(), []
    clock.every(1.0, lambda: times.append(clock.now) or len(times) < 3)
    clock.run(10.0)
    assert times == [0.0, 1.0, 2.0]


def test_a_stream_does_not_depend_on_the_streams_made_before_it():
    alone, crowded = Streams(7), Streams(7)
    for name in ("a", "b", "c"):
        crowded[name].random(10)
    assert np.array_equal(alone["robot-1/imu"].random(5), crowded["robot-1/imu"].random(5))


def test_streams_of_other_names_or_seeds_differ():
    draws = {Streams(s)[n].random() for s in (1, 2) for n in ("x", "y")}
    assert len(draws) == 4


def test_derived_seeds_tell_parts_apart():
    assert derive_seed("ab", "c") != derive_seed("a", "bc")
    assert derive_seed(1, "drive", 0, 0) == derive_seed(1, "drive", 0, 0)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("name: a\ninner:\n  delay_ms: 3\n", "3:3", "'inner.delay_ms'; did you mean 'delay_s'?"),
        ("name: a\ninner: {delay_s: fast}\n", "2:9", "inner.delay_s"),
        ("inner: {}\n", "1:1", "missing key 'name'"),
        ("name: a\nname: b\n", "2:1", "'name' appears twice"),
        ("name: [a\n", "1:7", "] is missing"),
        ("name: a\nitems: [{delay_s: 1}, {delay_s: x}]\n", "2:24", "items.1.delay_s"),
        ("- 1\n", "1:1", "mapping"),
    ],
)
def test_a_mistake_is_told_by_file_line_and_column(tmp_path, text, place, words):
    path = tmp_path / "bad.yaml"
    path.write_text(text)

    def read() -> None:
        document = load_yaml(path)
        validate(Outer, document.data, document.error)

    with pytest.raises(ConfigError) as caught:
        read()
    line = str(caught.value)
    assert line.startswith(f"{path}:{place}"), line
    assert words in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("a: !!python/object/apply:os.system [x]\n", "1:4: !!python/object/apply:os.system"),
        ("question: !!python/name:os.system\n", "1:11: !!python/name:os.system"),
        ("a: 1\nb: [2, !!python/tuple [3]]\n", "2:8: !!python/tuple"),
        ("? !!python/tuple [1, 2]\n: 3\n", "1:3: !!python/tuple"),
        ("!!python/object:x {a: 1}\n", "1:1: !!python/object:x"),
        ("%TAG ! tag:yaml.org,2002:python/\n---\na: !name:x y\n", "3:4: !!python/name:x"),
        ("a: !mine x\n", "1:4: !mine"),
        ("a: !!omap [b: 1]\n", "1:4: !!omap"),
        ("a: !!set {b, c}\n", "1:4: !!set"),
        ("a: !!binary aGk=\n", "1:4: !!binary"),
    ],
)
def test_a_tag_of_another_kind_than_plain_values_is_told_by_its_place(tmp_path, text, place):
    path = tmp_path / "tagged.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_yaml(path)
    assert str(caught.value).startswith(f"{path}:{place}")


def test_tags_of_plain_values_and_merged_keys_are_read(tmp_path):
    path = tmp_path / "tagged.yaml"
    path.write_text('a: &a {x: 1}\nb: {<<: *a, y: !!str 2}\nc: !!int "7"\n')
    document = load_yaml(path)
    assert document.data == {"a": {"x": 1}, "b": {"x": 1, "y": "2"}, "c": 7}
    assert str(document.error("bad", ("b", "y"))).startswith(f"{path}:2:13")
    assert str(document.error("bad", ("b", "x"))).startswith(f"{path}:2:")


def test_yaml_12_keeps_times_as_text(tmp_path):
    path = tmp_path / "time.yaml"
    path.write_text("name: 12:30:56\n")
    assert load_yaml(path).data == {"name": "12:30:56"}


def test_a_nearer_folder_hides_a_farther_one(tmp_path, monkeypatch):
    folder = tmp_path / "experiments"
    folder.mkdir()
    (folder / "req-rep-vs-pub-sub.yaml").write_text("question: mine\n")
    monkeypatch.chdir(tmp_path)
    found = resources.find("req-rep-vs-pub-sub", "experiments")
    assert found.resolve() == (folder / "req-rep-vs-pub-sub.yaml").resolve()


def test_an_unknown_name_lists_what_there_is():
    with pytest.raises(ConfigError, match="did you mean 'req-rep-vs-pub-sub'"):
        resources.find("req-rep-vs-pubsub", "experiments")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("day: 2001-13-45\n", "has a value that cannot be read"),
        ("[" * 1000, "is nested too deeply"),
        (
            "a: &a [1, 2, 3, 4, 5, 6, 7, 8, 9]\n"
            + "".join(
                f"{x}: &{x} [{', '.join([f'*{y}'] * 9)}]\n"
                for y, x in itertools.pairwise("abcdefgh")
            ),
            "more than 20000 values",
        ),
    ],
    ids=["no date", "deep", "aliases of aliases"],
)
def test_a_file_that_nobody_would_write_ends_in_one_line(tmp_path, text, problem):
    file = tmp_path / "odd.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=problem):
        load_yaml(file)
