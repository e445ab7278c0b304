"""Damage that somebody who knows the protocol would do to a message."""

import re
from collections.abc import Callable
from random import Random

VALUE = re.compile(rb">([^<>]+)</")
TAG = re.compile(rb"</?\w+>")
LEAF = re.compile(rb"<(\w+)>[^<>]*</\1>")
DECLARATION = re.compile(rb"<\?xml[^>]*>")

NUMBERS = [
    *(str(2**bits + more) for bits in (31, 32, 53, 63, 64) for more in (-1, 0, 1)),
    *("0", "00", "-0", "-0.0", "0.0", "-1", "1", "+1", "01", "1.", ".1", "1.0", "0x1", "1_0"),
    *("89.9", "90.0", "90.00000000000001", "91.0", "99.99999999999999", "100", "100.0", "-100.0"),
    *("100.00000000000001", "99.9999999999999999999999", "100.0000000000000000000001", "101.0"),
    *("179.9", "180.0", "180.00000000000003", "199.0", "999999.9", "1000000.0", "1000001.0"),
    *("1e2", "1E2", "1e+02", "1e02", "10e1", "1000e-1", "1e3", "1e-05", "5e-324", "1e-400"),
    *("1e-999", "1e-1000", "9e-00", "9.9e-1", "1e999", "1e9999", "0e999"),
    *("NaN", "nan", "INF", "-INF", "inf"),
    *("9" * 5000, "0" * 5000 + "1", "0." + "0" * 5000, "1." + "1" * 24, "1." + "1" * 25),
    *("٠.٥", "١", "０.５", "\u00a00.5", "0,5", "0.5 0.5", "", " ", "9999999999", "999", "1000"),
]
STRINGS = [
    *("70:1a:04:f9:81:d6", "70:1A:04:F9:81:D6:00", "70-1A-04-F9-81-D6", "24:00:00", "23:60:00"),
    *("12:30:56.", "12:30:56.1234567890", "12:30:56.5", "12:30", "idle", "Idle ", "Mission", "x"),
    *("a" * 256, "a" * 257, "&amp;", "&lt;", ">", "]]>", "&#48;", "&#x31;", "&half;", "\x01", "é"),
    *("<![CDATA[1]]>", "<!-- -->1", "1<?x?>", "<Speed>1</Speed>", "<x:a>1</x:a>", "\x85", "\ufffe"),
]
INSERTED = [
    *(b" ", b"\n", b"\t", b"\r", b"\0", b"\xa0", b"\xff", b"<", b">", b"&", b"-", b"+", b"0", b"e"),
    *(
        b".",
        b"<!-- -->",
        b"<?x?>",
        b"<![CDATA[]]>",
        b"<msg>",
        b"</msg>",
        b"&#32;",
        b"/",
        b"\xd9\xa5",
    ),
    *(b"<!DOCTYPE msg>", b"\xef\xbb\xbf", b' a="1"', b' xmlns="x"', b"x:", b"9" * 30),
]
DECLARATIONS = [
    *(b"", b"\n", b"<?xml version='1.0'?>", b'<?xml version="1.1"?>', b"<?xml?>"),
    *(b'<?xml version="1.0" encoding="%s"?>' % name for name in (b"utf-8", b"UTF-7", b"UTF-16")),
    b'<?xml version="1.0" encoding="UTF-8" standalone="no"?>',
    b'<?xml version="1.0" encoding="UTF-8" standalone="yes"?>\n',
    b'<?xml version="1.0" encoding="UTF-8" standalone="yes"?> <?xml version="1.0"?>',
]
OTHERS = "0123456789AFaf.-+eE: ٥"


def _a_value(data: bytes, rng: Random) -> tuple[int, int]:
    spans = [found.span(1) for found in VALUE.finditer(data)]
    return rng.choice(spans) if spans else (0, 0)


def _replace(data: bytes, start: int, end: int, new: bytes) -> bytes:
    return data[:start] + new + data[end:]


def nasty_value(data: bytes, rng: Random) -> bytes:
    values = NUMBERS if rng.random() < 0.7 else STRINGS
    return _replace(data, *_a_value(data, rng), rng.choice(values).encode())


def value_rewritten(data: bytes, rng: Random) -> bytes:
    """Rewrite a value to an equal or similar one: zeros, signs, exponents, space, references."""
    start, end = _a_value(data, rng)
    old = data[start:end]
    at = rng.randrange(len(old) + 1)
    new = rng.choice(
        [
            *(
                b"0" + old,
                b"-" + old,
                b"+" + old,
                b"-0" + old,
                old + b"0",
                old + b".0",
                old + b"e0",
            ),
            *(old + b"e-05", old + b"E+1", old + b"e-%d" % rng.randrange(1200), b" " + old),
            *(old + b"\n", old.lower(), old.swapcase(), old + old, old * 30),
            old[:at] + b"%d" % rng.randrange(10 ** rng.randrange(1, 26)) + old[at:],
            old[:at] + b"." + old[at:],
            b"".join(b"&#%d;" % byte for byte in old),
            b"<![CDATA[" + old + b"]]>",
            old[:at] + b"<!-- -->" + old[at:],
            old.translate(bytes.maketrans(b"0123456789", b"1234567890")),
        ]
    )
    return _replace(data, start, end, new)


def digit_changed(data: bytes, rng: Random) -> bytes:
    """Change a digit, capital letter, point or sign; the result is often still a message."""
    start, end = _a_value(data, rng)
    if start == end:
        return data
    at = rng.randrange(start, end)
    return _replace(data, at, at + 1, rng.choice(OTHERS).encode())


def real_drawn(data: bytes, rng: Random) -> bytes:
    scale = 10.0 ** rng.uniform(-9, 7)
    value = rng.choice([rng.uniform(-scale, scale), float(rng.randrange(-1001, 1001)) / 5])
    text = rng.choice([repr(value), f"{value:.{rng.randrange(27)}f}", f"{value:.3e}"])
    return _replace(data, *_a_value(data, rng), text.encode())


def bit_flipped(data: bytes, rng: Random) -> bytes:
    if not data:
        return data
    damaged = bytearray(data)
    damaged[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def cut(data: bytes, rng: Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def repeated(data: bytes, rng: Random) -> bytes:
    """Followed by itself or by its own end."""
    return data + data[rng.randrange(len(data) + 1) :]


def inserted(data: bytes, rng: Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return _replace(data, at, at + rng.choice([0, 0, 1, 3]), rng.choice(INSERTED))


def between_tags(data: bytes, rng: Random) -> bytes:
    ends = [found.end() for found in TAG.finditer(data)] or [0]
    return _replace(data, at := rng.choice(ends), at, rng.choice(INSERTED))


def leaves_moved(data: bytes, rng: Random) -> bytes:
    """Elements dropped, doubled or exchanged."""
    leaves = [found.span() for found in LEAF.finditer(data)]
    if len(leaves) < 2:
        return data
    (a, b), (c, d) = sorted(rng.sample(leaves, 2))
    first, second = data[a:b], data[c:d]
    return rng.choice(
        [
            _replace(data, a, b, b""),
            _replace(data, a, b, first + first),
            data[:a] + second + data[b:c] + first + data[d:],
        ]
    )


def tag_renamed(data: bytes, rng: Random) -> bytes:
    names = sorted(set(re.findall(rb"<(\w+)>", data))) or [b"msg"]
    old, new = rng.choice(names), rng.choice([*names, b"x", b"x:msg", b"SPEED"])
    where = rng.choice([(b"<", b">"), (b"</", b">"), (b"", b"")])
    return data.replace(where[0] + old + where[1], where[0] + new + where[1], rng.choice([1, -1]))


def declaration_changed(data: bytes, rng: Random) -> bytes:
    new = rng.choice(DECLARATIONS)
    return DECLARATION.sub(lambda found: new, data, count=1)


def transcoded(data: bytes, rng: Random) -> bytes:
    text = data.decode("utf-8", "replace")
    return text.encode(rng.choice(["utf-7", "utf-16", "utf-16-le", "utf-32", "utf-8-sig"]))


def padded(data: bytes, rng: Random) -> bytes:
    """About as long as a message may be."""
    ends = [found.end() for found in TAG.finditer(data)] or [0]
    room = 8192 - len(data) + rng.choice([-1, 0, 1])
    return _replace(data, at := rng.choice(ends), at, rng.choice([b" ", b"9", b"\n"]) * room)


FREQUENT = [nasty_value, value_rewritten, digit_changed, real_drawn, leaves_moved, inserted]
RARE = [*(bit_flipped, cut, repeated, between_tags, tag_renamed), declaration_changed]
RARE += [transcoded, padded]
KINDS: list[Callable[[bytes, Random], bytes]] = [*FREQUENT * 4, *RARE]


def mutated(data: bytes, rng: Random) -> bytes:
    """The message with one to three kinds of damage."""
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        data = rng.choice(KINDS)(data, rng)
    return data
