"""An address as a code that a phone's camera reads, in a terminal and on a page."""

from __future__ import annotations

import io

import segno

RIM = 4  # modules around a code, as its standard asks for (ISO/IEC 18004)
TERMINAL_RIM = 2  # which cameras do with, where rows are few
_BLOCKS = {(0, 0): " ", (0, 1): "▄", (1, 0): "▀", (1, 1): "█"}
_DARK_ON_WHITE = "\x1b[38;5;16m\x1b[48;5;231m"
_RESET = "\x1b[0m"


def svg(address: str) -> bytes:
    """Return the code for a page: dark on white in both themes, as cameras want it."""
    data = io.BytesIO()
    code = segno.make_qr(address, error="m")
    code.save(data, kind="svg", border=RIM, dark="#000", light="#fff", scale=4, nl=False)
    return data.getvalue()


def half_blocks(address: str, colours: bool) -> str:
    """Return the code for a terminal: two modules in each character.

    Args:
        address: Address to encode.
        colours: True if the terminal supports colours. Otherwise light modules are drawn, as most
            terminals are dark.
    """
    rows = [list(row) for row in segno.make_qr(address, error="l").matrix_iter(border=TERMINAL_RIM)]
    if len(rows) % 2:
        rows.append([0] * len(rows[0]))
    lit = 1 if colours else 0
    lines = [
        "".join(_BLOCKS[int(a == lit), int(b == lit)] for a, b in zip(upper, lower, strict=True))
        for upper, lower in zip(rows[::2], rows[1::2], strict=True)
    ]
    return "\n".join(f"{_DARK_ON_WHITE}{line}{_RESET}" if colours else line for line in lines)
