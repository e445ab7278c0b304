"""Requests and replies of any device, over any transport."""

import pytest

from dva_sim.agents.device import AgentDevice, Handler
from dva_sim.network.messaging import Request
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of

ME, ROBOT, THIEF = id_of("operator", 1), id_of("robot", 1), "02:00:00:03:00:66"


@pytest.fixture
def device() -> AgentDevice:
    """An operator's device on a network where nobody else is heard."""
    run = Run(scenarios.build(scenarios.load("drive-to-event")), 1)
    return run.stage.device("operator", 1)


def request(body: m.Body, number: int = 5) -> bytes:
    return encode(m.Message(ME, number, ROBOT, "12:00:00", 0, body))


def answer(device: AgentDevice, data: bytes, handler: Handler, sender: str | None = None) -> bytes:
    """Reply of a device to a request."""
    replies: list[bytes] = []
    device.take(Request(data, replies.append, sender), handler)
    return replies[0]


def code(reply: bytes) -> int:
    body = decode(reply).body
    assert isinstance(body, m.Reply)
    return body.code


def test_what_an_impostor_was_told_is_not_for_the_one_it_played(device):
    acted: list[m.Message] = []

    def act(message: m.Message) -> m.Reply:
        acted.append(message)
        return m.Reply(message.message_id, m.OK, "done")

    data = request(m.GetDeviceList())
    assert code(answer(device, data, act, THIEF)) == m.NOT_PERMITTED
    assert code(answer(device, data, act, ROBOT)) == m.OK
    assert code(answer(device, data, act, THIEF)) == m.NOT_PERMITTED
    assert code(answer(device, data, act, ROBOT)) == m.OK
    assert len(acted) == 1


@pytest.mark.parametrize(
    "answer",
    [
        b"garbage",
        encode(m.Message(ME, 1, ROBOT, "12:00:00", 0, m.Reply(1, m.OK, ""))),  # not the DVA
        encode(m.Message(ME, 1, DVA, "12:00:00", 0, m.GetDeviceList())),  # no reply
        encode(m.Message(ME, 1, DVA, "12:00:00", 0, m.Reply(77, m.OK, ""))),  # to another
    ],
    ids=["garbage", "of another device", "no reply", "to another request"],
)
def test_a_request_with_a_bad_answer_has_failed(device, answer):
    """Otherwise the requester would wait forever, and a device would never register."""
    device.network.serve(DVA, lambda request: request.answer(answer))
    ended: list[str] = []
    device.ask(DVA, m.GetDeviceList(), lambda _: ended.append("reply"), lambda: ended.append("no"))
    device.clock.run(3.0)
    assert ended == ["no"]


def test_an_answer_to_what_could_not_be_read_is_taken(device):
    def refuse(request: Request) -> None:
        request.answer(
            encode(m.Message(ME, 1, DVA, "12:00:00", 0, m.Reply(0, m.BAD_MESSAGE, "cannot")))
        )

    device.network.serve(DVA, refuse)
    codes: list[int] = []
    device.ask(DVA, m.GetDeviceList(), lambda reply: codes.append(reply.code))
    device.clock.run(3.0)
    assert codes == [m.BAD_MESSAGE]


def test_a_message_to_another_device_is_refused_unless_it_is_an_emergency(device):
    acted: list[m.Body] = []

    def act(message: m.Message) -> m.Reply:
        acted.append(message.body)
        return m.Reply(message.message_id, m.OK, "")

    for body, expected in ((m.StartTeleOp(), m.UNKNOWN_DEVICE), (m.Emergency(), m.OK)):
        data = encode(m.Message(THIEF, 5, ROBOT, "12:00:00", 0, body))
        assert code(answer(device, data, act)) == expected
    assert acted == [m.Emergency()]


def test_a_reason_too_long_for_a_reply_leaves_its_code(device):
    """Otherwise an overlong reason could crash the receiver."""
    refuse = lambda message: m.Reply(message.message_id, m.BUSY, "x" * 300)  # noqa: E731
    assert code(answer(device, request(m.GetDeviceList()), refuse)) == m.BUSY


def test_the_requests_of_others_do_not_make_a_reply_forgotten(device):
    acted: list[str] = []

    def act(message: m.Message) -> m.Reply:
        acted.append(message.source)
        return m.Reply(message.message_id, m.OK, "")

    mine = request(m.GetDeviceList())
    answer(device, mine, act)
    for number in range(1, 500):
        other = m.Message(ME, number, THIEF, "12:00:00", 0, m.GetDeviceList())
        answer(device, encode(other), act)
    answer(device, mine, act)
    assert acted.count(ROBOT) == 1
