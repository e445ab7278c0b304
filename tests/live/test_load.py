"""Load on a DVA: what counts as broken, and a small load on one that is started for it."""

import csv
import json
import math
import subprocess
import sys

import pytest
from helpers.processes.command_line import call
from helpers.studies.dask_cluster import DaskCluster
from helpers.wording import unnamed

from dva_sim.experiments.execution import dask_cluster
from dva_sim.kernel.errors import DvaSimError
from dva_sim.live.load import LoadedDva, figures_of, order_times, read_output
from dva_sim.live.load_devices import LoadCounts
from dva_sim.network.keys import KeyRing
from dva_sim.options.runs import LoadOptions
from dva_sim.serving.processes import Child, end_all

NOT_HERE = LoadedDva(None).look(0.0, 1.0)


def broken(devices=4, **changed):
    counts = vars(LoadCounts(trips={"list": [0.01] * 200}, joined=4)) | changed
    return figures_of(LoadOptions(duration=10.0), devices, [counts], NOT_HERE).broke


def test_an_order_belongs_to_the_last_report_of_its_place_that_had_none():
    reported = [("a", 1.0), ("b", 2.0), ("a", 5.0), ("a", 9.0)]
    ordered = [("a", 1.5), ("a", 5.25), ("b", 4.0)]
    assert order_times(reported, ordered) == [0.5, 2.0, 0.25]


def test_a_dva_counts_as_broken_by_late_replies_lost_requests_or_missing_devices():
    assert broken() == ""
    assert broken(trips={"list": [0.01] * 95 + [1.5] * 5}) == "p99 of replies 1.50 s"
    assert broken(trips={"list": [0.01] * 200, "command": [9.0]}) == ""  # which is of a robot
    assert broken(lost={"report": 2}) == ""
    assert broken(lost={"report": 3}) == "3 of 203 requests lost or refused"
    assert broken(refused={"report: BUSY": 3}) == "3 of 200 requests lost or refused"
    itself = "the load itself was late by 0.60 s, so take more processes"
    assert broken(late=0.6) == itself
    assert broken(devices=5) == "4 of 5 devices joined"


def test_messages_are_counted_in_a_second_and_what_is_elsewhere_is_not_known():
    counts = vars(LoadCounts(trips={"list": [0.01] * 60}, published=40))
    found = figures_of(LoadOptions(duration=10.0), 0, [counts, counts], NOT_HERE)
    assert found.messages_per_s == 20.0
    assert found.requests_p50_s == 0.01
    assert math.isnan(found.orders_p50_s)
    assert math.isnan(found.memory_mb)


def test_a_process_that_ends_by_itself_is_told_with_its_last_words():
    script = "import sys; print('error: no more files', file=sys.stderr); sys.exit(2)"
    child = Child("load process 0", [sys.executable, "-c", script], stdout=subprocess.PIPE)
    try:
        with pytest.raises(DvaSimError, match="load process 0 has ended by itself: no more files"):
            read_output(child)
    finally:
        end_all([child])


@pytest.mark.system
def test_a_small_load_is_answered_by_a_dva_that_is_started_for_it(tmp_path):
    words = ["--devices", "12", "--sessions", "2", "--reports", "60", "--churn", "60", "--for", "3"]
    done = call("load", *words, "-o", tmp_path / "load.csv")
    assert done.returncode == 0, done.stderr
    assert "12 of 12 devices, 2 sessions:" in done.stdout
    assert "open files" in done.stdout
    with (tmp_path / "load.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["messages_per_s"]) > 20
    assert 0 < float(row["orders_p50_s"]) < 30
    assert float(row["files"]) > 50
    assert (row["lost"], row["refused"], row["broke"]) == ("0", "0", "")


@pytest.mark.system
def test_workers_of_a_cluster_make_a_load_and_its_figures_but_those_of_two_clocks(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(dask_cluster, "_CONNECT_S", 2.0)
    with DaskCluster(tmp_path) as dask:
        options = ["--devices", "20", "--sessions", "2", "--for", "2", "--processes", "2"]
        scheduler = ["--scheduler", dask.address]
        dask.add_worker()
        refused = call("load", *options, *scheduler)
        assert unnamed(refused.stderr, "1 workers", "2 are needed") == []
        dask.add_worker()
        (figures,) = json.loads(call("load", *options, *scheduler, "--json").stdout)
    assert (figures["joined"], figures["lost"], figures["broke"]) == (20, 0, "")
    assert figures["messages_per_s"] > 20
    assert figures["orders_p50_s"] is None


@pytest.mark.system
def test_an_encrypted_load_makes_the_keys_that_are_missing(tmp_path):
    words = ["--devices", "6", "--sessions", "1", "--for", "1", "--keys", tmp_path / "keys"]
    (figures,) = json.loads(call("load", *words, "--json").stdout)
    assert (figures["joined"], figures["lost"], figures["broke"]) == (6, 0, "")
    assert len(KeyRing(tmp_path / "keys").devices) == 7
