import dataclasses

import pytest

from dva_sim.network.pattern_runs import (
    COLUMN_WORDS,
    CONDITION,
    Condition,
)
from dva_sim.network.patterns import PATTERNS

ASKING = Condition("req", 10, timeout_ms=2500, attempts=3, delay_ms=100, loss=0.05, rate_kbit=64)
PUBLISHING = Condition("pub", 50, conflate="both", sndbuf=4096, hwm=1, queue_pkts=20)


def test_a_condition_written_as_a_row_is_read_back_the_same():
    for condition in (ASKING, PUBLISHING, dataclasses.replace(PUBLISHING, burst_pkts=3.5)):
        assert Condition.from_row(condition.to_row()) == condition


def test_what_is_not_set_is_empty_or_named_as_the_tables_do():
    row = PUBLISHING.to_row()
    assert row["timeout_ms"] == row["attempts"] == row["burst_pkts"] == ""
    assert (row["rcvbuf"], row["rate_kbit"], row["reorder"]) == ("auto", "inf", "0")
    assert (row["warm_s"], row["dur_s"]) == ("1", "40")


def test_the_way_a_number_is_written_does_not_change_the_condition():
    row = ASKING.to_row() | {"hz": "10.0", "delay_ms": "1e2", "attempts": "3.0"}
    assert Condition.from_row(row).hash == ASKING.hash


def test_every_setting_changes_the_hash():
    other = Condition("pub", 20, 6, None, None, "op", 2, 1, 1, 1, 0.1, 0.1, 1, 1, True, "reno")
    other = dataclasses.replace(other, wait_hs=False, warm_s=2, dur_s=3, burst_pkts=2)
    plain = Condition("pub", 10)
    changed = [name for name in CONDITION if name not in ("pattern", "timeout_ms", "attempts")]
    hashes = {dataclasses.replace(plain, **{name: getattr(other, name)}).hash for name in changed}
    assert len(hashes | {plain.hash}) == len(changed) + 1


def test_a_label_says_what_is_unusual_and_no_more():
    assert ASKING.label == "req10_d100_j0_l5_r64_p5_T2500"
    assert PUBLISHING.label == "pub50_d0_j0_l0_r0_p5_conflateboth_hwm1_sndbuf4096_q20"
    overtaken = Condition("pub", 10, jitter_frac=0.5, reorder=True, cc="reno", wait_hs=False)
    assert overtaken.label == "pub10_d0_j50_l0_r0_p5_reorder_reno_nowait"


def test_only_a_publisher_waits_for_a_subscription_after_its_handshake():
    slow = Condition("pub", 10, delay_ms=500, jitter_frac=0.2, rate_kbit=64)
    assert slow.subscription_wait_s == pytest.approx(1.2 + 0.06 + 0.005)
    assert dataclasses.replace(slow, wait_hs=False).subscription_wait_s == 0
    assert ASKING.subscription_wait_s == 0


def test_patterns_are_called_as_everywhere_and_tables_keep_their_words():
    """The measurements that are shipped were written before there was one vocabulary."""
    for word, name in COLUMN_WORDS.items():
        asks = {"timeout_ms": 100, "attempts": 3} if name == "req-rep" else {}
        of_table, named = Condition(word, 10, **asks), Condition(name, 10, **asks)
        assert of_table == named
        assert named.pattern == name
        assert (named.to_row()["pattern"], named.hash) == (word, of_table.hash)
        assert named.label.startswith(f"{word}10_")
    assert set(COLUMN_WORDS.values()) <= PATTERNS.keys()
