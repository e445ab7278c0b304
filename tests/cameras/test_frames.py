"""Pictures between processes: whole, in any pieces, and found again after a crash."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.cameras.frames import JPEG_END as END
from dva_sim.cameras.frames import MAGIC, Picture, Unpacker, pack

pictures = st.builds(
    Picture,
    st.integers(0, 300),
    st.integers(0, 10**6),
    st.integers(0, 10**8),
    st.integers(0, 10**8),
    st.binary(max_size=200).filter(lambda data: MAGIC not in data).map(lambda d: d and d + END),
)


@given(st.lists(pictures, max_size=5), st.integers(1, 50))
def test_pictures_come_whole_out_of_any_pieces(sent, size):
    data, unpacker, found = b"".join(map(pack, sent)), Unpacker(), []
    for start in range(0, len(data), size):
        found += unpacker.feed(data[start : start + size])
    assert found == sent
    assert unpacker.skipped == 0


@pytest.mark.system
@given(st.lists(pictures, max_size=3), pictures, st.integers(1, 200), st.integers(1, 50))
def test_after_a_record_that_broke_off_the_next_ones_are_found(before, broken, cut, size):
    whole = pack(broken)
    part = whole[: min(cut, len(whole) - 1)]
    after = [Picture(1, n, 0, 0, bytes([n]) * 300 + END) for n in range(3)]
    data = b"".join(map(pack, before)) + part + b"".join(map(pack, after))
    unpacker, found = Unpacker(), []
    for start in range(0, len(data), size):
        found += unpacker.feed(data[start : start + size])
    assert found == [*before, *after]


def test_rubbish_is_skipped():
    unpacker = Unpacker()
    assert unpacker.feed(b"\x00" * 1000 + b"traceback\n" * 30) == []
    picture = Picture(0, 1, 2, 3, b"jpeg" + END)
    assert unpacker.feed(pack(picture)) == [picture]
    assert unpacker.skipped >= 1300


def test_a_header_that_lies_about_its_length_is_skipped():
    header = b'{"robot":0,"n":1,"captured_ms":0,"arrived_ms":0,"bytes":99999999}'
    unpacker = Unpacker()
    assert unpacker.feed(len(header).to_bytes(4, "big") + header) == []
    picture = Picture(0, 1, 2, 3, b"jpeg" + END)
    assert unpacker.feed(pack(picture)) == [picture]
