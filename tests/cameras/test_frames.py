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


def unpacked(data, size):
    """Unpack bytes in pieces; returns the frames and the number of bytes skipped."""
    unpacker, found = Unpacker(), []
    for start in range(0, len(data), size):
        found += unpacker.feed(data[start : start + size])
    return found, unpacker.skipped


@given(st.lists(pictures, max_size=5), st.integers(1, 50))
def test_pictures_come_whole_out_of_any_pieces(sent, size):
    assert unpacked(b"".join(map(pack, sent)), size) == (sent, 0)


@pytest.mark.system
@given(st.lists(pictures, max_size=3), pictures, st.integers(1, 200), st.integers(1, 50))
def test_after_a_record_that_broke_off_the_next_ones_are_found(before, broken, cut, size):
    whole = pack(broken)
    part = whole[: min(cut, len(whole) - 1)]
    after = [Picture(1, n, 0, 0, bytes([n]) * 300 + END) for n in range(3)]
    data = b"".join(map(pack, before)) + part + b"".join(map(pack, after))
    assert unpacked(data, size)[0] == [*before, *after]


LIE = b'{"robot":0,"n":1,"captured_ms":0,"arrived_ms":0,"bytes":99999999}'


@pytest.mark.parametrize(
    ("bad", "least"),
    [(b"\x00" * 1000 + b"traceback\n" * 30, 1300), (len(LIE).to_bytes(4, "big") + LIE, 0)],
    ids=["rubbish", "a header that lies about its length"],
)
def test_what_is_no_picture_is_skipped(bad, least):
    picture = Picture(0, 1, 2, 3, b"jpeg" + END)
    found, skipped = unpacked(bad + pack(picture), len(bad))
    assert found == [picture]
    assert skipped >= least
