import pytest

from dva_sim.console.asking.answers import Answers
from dva_sim.console.asking.refusal import Refused
from dva_sim.kernel.errors import ConfigError, DvaSimError


def test_an_action_is_done_once_and_answered_as_often_as_it_is_said():
    answers, done, reports = Answers(), [], []

    def do(on_result):
        done.append(1)
        on_result(True, "done", more=3)

    for _ in range(3):
        answers.once("1", do, reports.append)
    assert done == [1]
    assert reports == [{"k": "done", "id": "1", "ok": True, "text": "done", "more": 3}] * 3


def test_who_asks_again_before_there_is_an_answer_is_told_with_it():
    answers, waiting, reports = Answers(), [], []
    answers.once("1", waiting.append, reports.append)
    answers.once("1", waiting.append, reports.append)
    assert reports == []
    (text,) = waiting
    text(True, "at last")
    assert [answer["text"] for answer in reports] == ["at last"]


@pytest.mark.parametrize("error", [Refused("no"), ConfigError("no"), DvaSimError("no")])
def test_what_is_refused_is_the_answer(error):
    def do(on_result):
        raise error

    answers, reports = Answers(), []
    answers.once("1", do, reports.append)
    assert reports == [{"k": "done", "id": "1", "ok": False, "text": "no", "outcome": "refused"}]


def test_answers_are_forgotten_in_time():
    answers = Answers()
    for number in range(Answers.MOST + 10):
        answers.once(str(number), lambda on_result: on_result(True, ""), lambda _: None)
    assert len(answers.given) == Answers.MOST
