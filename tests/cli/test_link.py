"""`dva-sim link`: options it refuses, its report and its record of packets."""

import csv
import sys
from dataclasses import replace

import pytest
from helpers.wording import unnamed

from dva_sim.cli import link_counts
from dva_sim.cli.program import call
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.emulator.forwarder import links_of
from dva_sim.network.emulator.report import DirectionReport, Durations, LinkFlow, LinkReport
from dva_sim.network.link import LinkConfig

CALM = LinkReport(
    up=DirectionReport(10, 7, 700, 1, 1, 1, *(0.1, 0.2, 0.3)),
    down=LinkFlow(links_of(LinkConfig(), 1)[1], waits=Durations()).report(),
    late_p50_s=0.0001,
    late_p99_s=0.002,
    late_max_s=0.0123456789,
)
OVERRUN = replace(CALM, overrun_packets=17)


def test_a_system_without_namespaces_is_named(monkeypatch, capsys):
    monkeypatch.setattr(sys, "platform", "plan9")
    assert call(["link", "--near", "true", "--far", "true"]) == 2
    assert not unnamed(capsys.readouterr().err, "Linux", "/dev/net/tun", "plan9")


def test_a_table_has_a_row_for_each_direction_and_says_what_its_columns_mean(tmp_path):
    files = link_counts.files_of(tmp_path / "counts", overwrite=False)
    for path, text in files.items():
        link_counts.keep(path, text(CALM, 3))
    with (tmp_path / "counts/link.csv").open(newline="") as file:
        there, back = csv.DictReader(file)
    assert (there["direction"], there["passed_packets"], there["lost_in_outage"]) == (
        *("near to far", "7", "1"),
    )
    assert (back["passed_packets"], back["waited_p50_s"]) == ("0", "")
    assert {row["late_max_s"] for row in (there, back)} == {"0.012346"}
    assert (there["disturbed"], there["seed"]) == ("false", "3")
    with (tmp_path / "counts/columns.csv").open(newline="") as file:
        assert [row["column"] for row in csv.DictReader(file)] == list(there)
    with pytest.raises(ConfigError, match="--overwrite"):
        link_counts.files_of(tmp_path / "counts", overwrite=False)


def test_a_disturbed_run_is_marked_in_words_and_in_the_table(tmp_path):
    path = tmp_path / "late.csv"
    for late, word in ((replace(CALM, late_p99_s=0.0062), "6.2 ms"), (OVERRUN, "17 packets")):
        there, _, _, warning = link_counts.in_words(late)
        assert not unnamed(there, "near to far: 7 packets", "3 lost", "p95 200.0 ms")
        assert not unnamed(warning, "disturbed", word)
        (text,) = link_counts.files_of(path, overwrite=True).values()
        link_counts.keep(path, text(late, 1))
        assert [line.split(",")[-2] for line in path.read_text().splitlines()[-2:]] == ["true"] * 2
    assert len(link_counts.in_words(CALM)) == 3
