"""A thousand fixed mutants of files and messages, and proof that the search finds what is wrong."""

import subprocess
import sys
import time
from functools import partial
from random import Random

import pytest
from fuzz import fuzz_files, mutations
from fuzz.readers import Reader, readers, texts

from dva_sim.console.asking import dispatcher
from dva_sim.console.web import audit as web_audit
from dva_sim.console.web import logins
from dva_sim.core.dva import Dva
from dva_sim.network.keys import KeyRing
from dva_sim.ros.client import RosbridgeClient
from dva_sim.ros.peers import RosPeer

COUNTS = {"quick": 940, "slow": 60}  # of readers of bytes and text, and of those that simulate
SLOW = {
    *("study", "scenario", "site", "plan", "map", "image"),
    *("recording", "table", "manifest", "journal", "plug-in"),
}


@pytest.mark.soak
@pytest.mark.parametrize("kind", COUNTS)
def test_mutants_end_in_a_line_of_ours_within_their_limits(kind):
    all_names = {reader.name for reader in readers()}
    names = sorted(name for name in all_names if (name in SLOW) == (kind == "slow"))
    words = ["--only", ",".join(names), "--count", str(COUNTS[kind]), "--seed", "1"]
    program = [sys.executable, fuzz_files.__file__, *words]  # it forks, so nothing may run in it
    done = subprocess.run(program, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_slow_reader_is_one_of_the_table():
    assert {reader.name for reader in readers()} > SLOW


def faulty(read, **options):
    return Reader("faulty", partial(texts, {"a.json": "{}"}), mutations.raw, read=read, **options)


def crash(data):
    raise IndexError("planted")


def loop(data):
    while True:
        pass


def swell(data):
    bytearray(600_000_000)


def turn(data):
    raise ValueError("name \u202eegnellahc")


@pytest.mark.parametrize(
    ("read", "names"),
    [(crash, "IndexError: planted"), (swell, " MB"), (turn, "control characters")],
)
def test_the_search_finds_a_planted_fault(read, names):
    faults = fuzz_files.search([faulty(read, refuses=(ValueError,))], 1, seed=1)
    assert names in faults["faulty"][0]


def test_the_search_ends_a_reader_that_hangs(monkeypatch):
    monkeypatch.setattr(fuzz_files, "MOST_CPU_S", 1)
    faults = fuzz_files.search([faulty(loop)], 1, seed=1)
    assert "takes more than 1 s of processor" in faults["faulty"][0]


def sleep(data):
    time.sleep(10)


def test_the_search_ends_a_reader_that_sleeps():
    faults = fuzz_files.search([faulty(sleep)], 1, seed=1)
    assert "sleeps for more than 5 s" in faults["faulty"][0]


# Deep inside of what a door leads to, each with a value at which it fails.
PLANTED = {
    "web": (dispatcher, "_checked", "'id': 'd"),
    "rosbridge": (RosPeer, "_subscribe", "/clock"),
    "bridge": (RosbridgeClient, "_refuse", ""),
    "message heard": (Dva, "_answer", "02:00:00"),
    "recalled state": (Dva, "tick", ""),
    "audit pages": (web_audit, "csv_of", "guard-1"),
    "logins": (logins, "is_password_of", "ana"),
    "keys": (KeyRing, "owner", ""),
}


def fail():
    raise ValueError("planted")


@pytest.mark.soak
@pytest.mark.parametrize(
    ("act", "problem"), [(fail, "planted"), (partial(sleep, b""), "sleeps for more")]
)
@pytest.mark.parametrize("name", PLANTED)
def test_each_door_leads_to_a_planted_fault(monkeypatch, name, act, problem):
    holder, function, value = PLANTED[name]
    sound = getattr(holder, function)

    def fails(*arguments, **named):
        if value in str(arguments):
            act()
        return sound(*arguments, **named)

    monkeypatch.setattr(holder, function, fails)
    (reader,) = (reader for reader in readers() if reader.name == name)
    faults = fuzz_files.search([reader], 4, seed=1)[name]
    assert any(problem in fault for fault in faults)


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("report.html", f"<p>{mutations.MARKUP}</p>", "active markup"),
        ("report.html", "<p>&lt;script&gt;</p>", ""),
        ("report.html", f"<p>{mutations.TURNED}</p>", "control characters"),
        ("x.csv", f'a,"{mutations.FORMULA}"\n', "a formula"),
        ("x.csv", f"a,'{mutations.FORMULA}\n", ""),
    ],
)
def test_what_is_active_in_a_file_is_seen(tmp_path, name, content, problem):
    path = tmp_path / name
    path.write_text(content)
    found = fuzz_files._active_in(path)
    assert bool(found) == bool(problem)
    assert problem in found


def test_the_same_seed_gives_the_same_mutants():
    data = b'{"a": [1, 2, {"b": 0.5}], "c": "x"}'
    first, again = ([mutations.of_json(data, Random(n)) for n in range(50)] for _ in range(2))
    assert first == again
    assert len(set(first)) > 30
