"""Messages from foreign programs, which must not disturb anybody else."""

import socket as tcp
from collections.abc import Iterator
from contextlib import ExitStack

import pytest
import zmq
from helpers.network.transports import (
    BRIEF,
    DVA,
    GUARD,
    PHONE,
    ROBOT,
    Asker,
    Listener,
    SocketWorld,
    echo,
    numbered,
    small_device,
)
from helpers.processes.patience import PATIENCE_S

from dva_sim.network import socket_io
from dva_sim.network.real_network import LARGEST
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode

pytestmark = pytest.mark.contract

BAD_FORMS = {"no frame": [], "two frames": [b"a", b"b"], "1000 frames": numbered(1000)}
WINDOWS = pytest.mark.parametrize("window", [1, 4], ids=["one at a time", "pipelined"])


def hello() -> m.Registration:
    return m.Registration("robot-1", "Robot", "127.0.0.1:5600")


@pytest.fixture
def served(sockets: SocketWorld) -> SocketWorld:
    """A real device serves as the DVA."""
    device = small_device(sockets, DVA)
    device.serve(lambda message: m.Reply(message.message_id, m.OK, ""))
    return sockets


def others_are_served(world: SocketWorld) -> None:
    """A device that comes now is answered."""
    replies: list[m.Reply] = []
    small_device(world, ROBOT).ask(DVA, hello(), replies.append)
    world.run_until(lambda: replies)
    assert [reply.code for reply in replies] == [m.OK]


@pytest.mark.parametrize("form", BAD_FORMS)
def test_a_request_of_any_number_of_frames_but_one_is_a_bad_message(served, form):
    program = served.program(zmq.DEALER, DVA)
    program.send_multipart([b"tag", b"", *BAD_FORMS[form]])
    *route, reply = served.receive(program)
    assert route == [b"tag", b""]
    body = decode(reply).body
    assert isinstance(body, m.Reply)
    assert (body.answers, body.code) == (0, m.BAD_MESSAGE)
    others_are_served(served)


@pytest.mark.invariant("S11")
def test_a_request_without_an_empty_frame_is_dropped_and_counted(served):
    program = served.program(zmq.DEALER, DVA)
    for frames in ([b"x"], [b"a", b"b"], numbered(1000)):
        program.send_multipart(frames)
    served.run_until(lambda: served.network.counters["requests of another form"] == 3)
    others_are_served(served)
    assert program.poll(0) == 0


@pytest.mark.invariant("S11")
def test_a_request_of_very_many_frames_is_dropped_bit_by_bit_and_others_are_served(served):
    program = served.program(zmq.DEALER, DVA)
    program.send_multipart([b"", *[b""] * 20_000])
    program.send_multipart([b"tag", b"", b"<msg>"])
    others_are_served(served)
    *route, _ = served.receive(program)
    assert route == [b"tag", b""]
    assert served.network.counters["requests of another form"] == 1


@pytest.mark.invariant("S11")
def test_subscriptions_without_end_are_heard_bit_by_bit(served, monkeypatch):
    monkeypatch.setattr(socket_io, "HEARD_AT_ONCE", 2)
    program = served.program(zmq.XSUB, DVA, published=True)
    for number in range(500):
        program.send(b"\x01%d" % number)
    others_are_served(served)
    before = served.clock.now
    served.run_until(lambda: served.network.ready(DVA, "499", 10))
    assert served.clock.now > before


def test_a_route_of_a_thousand_frames_is_given_back(served):
    program = served.program(zmq.DEALER, DVA)
    route = numbered(1000, "hop")
    program.send_multipart([*route, b"", b"<msg>"])
    *back, _ = served.receive(program)
    assert back == [*route, b""]


@pytest.mark.invariant("S11")
@pytest.mark.parametrize(
    "data", [b"", b"\0", b"<msg/>", b"<!DOCTYPE x><msg/>", b"\xff" * 9000, b"x" * (LARGEST - 100)]
)
def test_bytes_that_are_no_message_are_refused_in_words(served, data):
    program = served.program(zmq.REQ, DVA)
    program.send(data)
    body = decode(served.receive(program)[0]).body
    assert isinstance(body, m.Reply)
    assert body.code == m.BAD_MESSAGE
    others_are_served(served)


def test_who_sends_more_than_64_kilobytes_is_cut_off_and_others_are_served(served):
    program = served.program(zmq.DEALER, DVA)
    monitor = program.get_monitor_socket(zmq.EVENT_DISCONNECTED)
    program.send_multipart([b"", b"x" * (LARGEST + 1)])
    served.run_until(lambda: monitor.poll(0))
    program.disable_monitor()
    monitor.close()
    others_are_served(served)
    assert program.poll(0) == 0


@WINDOWS
def test_a_reply_of_more_than_64_kilobytes_is_none(sockets, window):
    sockets.serve(ROBOT, lambda request: request.answer(bytes(LARGEST + 1)))
    sockets.serve(DVA, echo)
    asker = Asker(sockets.network, BRIEF, window, peer=ROBOT)
    other = Asker(sockets.network, window=window, peer=DVA)
    asker.ask(b"how much?")
    other.ask(*numbered(10))
    sockets.run_until(lambda: asker.all_over() and other.all_over())
    assert asker.replies() == [None]
    assert other.replies() == [b"re: " + question for question in numbered(10)]


@pytest.fixture
def talkers() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


GARBAGE = {
    "nothing": b"",
    "a web browser": b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n",
    "a greeting cut short": b"\xff" + bytes(8),
    "a greeting and no handshake": b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(48),
    "a handshake of no mechanism": b"\xff" + bytes(8) + b"\x7f\x03\x00PLAIN" + bytes(200),
    "all ones": b"\xff" * 10_000,
    "zeros": bytes(10_000),
}


@pytest.mark.parametrize("kind", GARBAGE)
@pytest.mark.parametrize("published", [False, True], ids=["requests", "publications"])
def test_whatever_speaks_no_zeromq_at_a_port_harms_nobody(served, talkers, kind, published):
    """Twenty connections stay open all the time."""
    for _ in range(20):
        line = tcp.create_connection(("127.0.0.1", served.port(DVA, published)), timeout=PATIENCE_S)
        talkers.enter_context(line)
        line.sendall(GARBAGE[kind])
    others_are_served(served)
    Listener(served, "news|", publisher=DVA).await_a_mark()


# --- services of other programs -----------------------------------------------------------


def test_replies_of_another_form_are_none_and_the_right_one_still_counts(sockets):
    program = sockets.replace(GUARD, zmq.ROUTER)
    asker = Asker(sockets.network, window=4, peer=GUARD)
    asker.ask(b"well?")
    who, *route, question = sockets.receive(program)
    assert question == b"well?"
    for wrong in ([b""], [b"", b""], [b"12345678", b"", b"not yours"], [b"x"], numbered(1000)):
        program.send_multipart([who, *wrong])
    for wrong in BAD_FORMS.values():
        program.send_multipart([who, *route, *wrong])
    program.send_multipart([who, *route, b"well."])
    program.send_multipart([who, *route, b"well, well."])
    sockets.run_until(asker.all_over)
    asker.ask(b"and now?")
    who, *route, question = sockets.receive(program)
    program.send_multipart([who, *route, b"now."])
    sockets.run_until(asker.all_over)
    assert asker.replies() == [b"well.", b"now."]


ROUTELESS = {"an empty frame": [b""], "a word": [b"x"], "1000 frames": numbered(1000)}


@pytest.mark.parametrize("form", BAD_FORMS | ROUTELESS)
def test_one_at_a_time_a_reply_of_another_form_costs_no_more_than_an_attempt(sockets, form):
    """ZeroMQ hangs up on some, and takes others for the reply: the next attempt mends it."""
    program = sockets.replace(GUARD, zmq.ROUTER)
    asker = Asker(sockets.network, BRIEF, attempts=1000, peer=GUARD)
    asker.ask(b"well?")
    who, *route, _ = sockets.receive(program)
    wrong = ROUTELESS[form] if form in ROUTELESS else [*route, *BAD_FORMS[form]]
    program.send_multipart([who, *wrong])
    while not asker.all_over():
        who, *route, question = sockets.receive(program)
        assert question == b"well?"
        program.send_multipart([who, *route, b"well."])
        sockets.run_for(BRIEF)  # at the end of this it is answered, or asks again
    assert asker.replies() == [b"well."]


def test_a_program_of_fifteen_lines_is_served(sockets):
    """REQ without any options, as the specification describes it."""
    sockets.serve(PHONE, echo)
    program = sockets.program(zmq.REQ, PHONE)
    for question in numbered(10):
        program.send(question)
        assert sockets.receive(program) == [b"re: " + question]
