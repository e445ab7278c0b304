"""Clock, streams, configuration and names: what everything else stands on."""

import numpy as np

from dva_sim.kernel import resources
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.streams import Streams, derive_seed
from dva_sim.kernel.yaml_files import load_yaml


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
