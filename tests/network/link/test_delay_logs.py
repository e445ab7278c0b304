"""Delay logs: units of columns, heads, several runs of ping in one file."""

from pathlib import Path

import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.network.link import read_delay_log
from dva_sim.testing.files import check_file

EPOCH = 1_700_000_000


def write(folder: Path, text: str) -> str:
    path = folder / "delays.log"
    path.write_text(text, encoding="utf-8")
    return str(path)


def ping(start: float, delay_ms: float, numbers, head: bool = True) -> str:
    """Output of one run of ping, a request each second."""
    lines = ["PING h (10.0.0.7) 56(84) bytes of data."] if head else []
    for n in numbers:
        came = start + n + delay_ms / 1000
        lines.append(f"[{came:.6f}] 64 bytes from h: icmp_seq={n} ttl=57 time={delay_ms:g} ms")
    return "\n".join(lines) + "\n"


FIRST = ping(EPOCH, 40, range(1, 5))


@pytest.mark.parametrize(
    ("second", "delays_ms", "runs"),
    [
        (ping(EPOCH + 3600, 300, range(1, 4)), [40] * 4 + [300] * 3, 2),
        (ping(EPOCH + 3600, 300, range(1, 4), head=False), [40] * 4 + [300] * 3, 2),
        (ping(EPOCH + 3600, 300, [2, 3], head=False), [40] * 4 + [300] * 2, 2),
        (ping(EPOCH - 3600, 300, range(1, 4), head=False), [40] * 4 + [300] * 3, 2),
        (ping(EPOCH, 700, [4], head=False), [40] * 4, 1),  # a duplicate
        (ping(EPOCH, 300, [5, 6], head=False), [40] * 4 + [300] * 2, 1),
    ],
)
def test_a_run_begins_where_the_numbers_of_ping_start_again(tmp_path, second, delays_ms, runs):
    log = read_delay_log(write(tmp_path, FIRST + second))
    assert (log.delays * 1000).round(3).tolist() == delays_ms
    assert np.diff(log.times) == pytest.approx(np.ones(len(delays_ms) - 1), abs=1e-5)
    assert log.runs == runs


def test_a_run_that_begins_again_after_40_000_requests_is_no_loss_of_25_000(tmp_path):
    text = ping(EPOCH, 40, [39_999, 40_000]) + ping(EPOCH + 50_000, 40, [1, 2], head=False)
    log = read_delay_log(write(tmp_path, text))
    assert (len(log.times), log.runs) == (4, 2)


@pytest.mark.parametrize(
    ("head", "time", "delay", "row", "units"),
    [
        ("", 1.0, 1.0, "{t} {d}", ("s", "ms")),
        ("", 1e3, 1.0, "{t} {d}", ("ms", "ms")),
        ("", 1e6, 1.0, "{t},{d}", ("us", "ms")),
        ("", 1e9, 1.0, "{t};{d}", ("ns", "ms")),
        ("time_s,delay_s", 1.0, 1e-3, "{t},{d}", ("s", "s")),
        ("s,ms", 1.0, 1.0, "{t},{d}", ("s", "ms")),
        ("# s, us", 1.0, 1e3, "{t} {d}", ("s", "us")),
        ("timestamp (ms);rtt (us)", 1e3, 1e3, "{t};{d}", ("ms", "us")),
        ("seq,host,rtt_ms,time", 1.0, 1.0, "7,h,{d},{t}", ("s", "ms")),
        ('"time [s]" "latency [ms]"', 1.0, 1.0, "{t} {d}", ("s", "ms")),
    ],
)
@pytest.mark.parametrize("start", [EPOCH, EPOCH + 0.2])
def test_columns_are_read_in_the_units_of_their_head_or_size(
    tmp_path, head, time, delay, row, units, start
):
    rows = [
        row.format(t=f"{(start + n * 0.2) * time:.6f}", d=f"{d * delay:g}")
        for n, d in enumerate((40, 300, 40))
    ]
    log = read_delay_log(write(tmp_path, "\n".join([head, *rows]) + "\n"))
    assert log.units == units
    assert log.times - start == pytest.approx([0, 0.2, 0.4], abs=1e-5)
    assert log.delays == pytest.approx([0.04, 0.3, 0.04])
    assert log.doubts == ()


@pytest.mark.parametrize(
    ("text", "units", "names"),
    [
        ("0 40\n200 40\n400 40\n", ("ms", "ms"), []),
        (f"{EPOCH}000 40\n{EPOCH}020 40\n{EPOCH}040 40\n", ("ms", "ms"), []),
        ("0 40\n5 40\n10 40\n", ("s", "ms"), []),
        ("0 40\n20 40\n40 40\n", ("s", "ms"), ["20 s between probes", "time_s,delay_ms"]),
        ("0 0.04\n1 0.05\n", ("s", "ms"), ["0.045 ms", "time_s,delay_ms"]),
        ("0 40000\n1 40000\n", ("s", "ms"), ["4e+04 ms", "time_s,delay_ms"]),
        ("0.0 4.9\n0.5 0.5\n1.0 3.2\n", ("s", "ms"), ["3.2 ms", "throughput"]),
        ("# s, ms\n0 0.04\n20 0.05\n", ("s", "ms"), []),
    ],
)
def test_a_unit_that_is_assumed_and_unusual_is_doubted(tmp_path, text, units, names):
    log = read_delay_log(write(tmp_path, text))
    assert log.units == units
    assert bool(log.doubts) is bool(names)
    assert unnamed(" ".join(log.doubts), *names) == []


@pytest.mark.parametrize(
    ("head", "asks"),
    [
        ("", "no unit of its times and delays; if it is another, write"),
        ("time,delay_ms", "no unit of its times; if"),
        ("time_s,rtt", "no unit of its delays; if"),
        ("time_s,delay_ms", ""),
        ("# s, ms", ""),
    ],
)
def test_check_says_which_units_are_assumed_and_asks(tmp_path, head, asks):
    rows = "0,40\n1,45\n2,42\n"
    verdict = check_file(Path(write(tmp_path, f"{head}\n{rows}" if head else rows)))
    assert (verdict.problems, list(verdict.doubts)) == ([], [])
    assert unnamed(verdict.note, " s,", " ms") == []
    assert asks in verdict.note
    assert ("assumed" in verdict.note) is bool(asks)
