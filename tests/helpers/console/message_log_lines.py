"""Lines of a log of messages, as the world tells them to the web process."""

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode

DVA, PHONE, ROBOT = "02:00:00:00:00:01", "02:00:00:06:00:01", "02:00:00:01:00:01"


def encoded(number: int, body: m.Body, session: int | None = 0, source: str = PHONE) -> bytes:
    return encode(m.Message(DVA, number, source, "12:00:00", session, body))


def line(number: int, data: bytes, code: int | None = m.OK, published: bool = False) -> list:
    reply = None
    if code is not None:
        answer = m.Message(PHONE, number, DVA, "12:00:01", 0, m.Reply(number, code, "so"))
        reply = encode(answer).decode("latin-1")
    return [number, 1000 * number, data.decode("latin-1"), reply, 250, int(published)]


def batch(*lines: list, log: str = "dva") -> dict:
    return {"k": "log", "log": log, "lines": list(lines)}


def asks(first: int, last: int) -> list[list]:
    return [line(n, encoded(n, m.GetDeviceList())) for n in range(first, last + 1)]
