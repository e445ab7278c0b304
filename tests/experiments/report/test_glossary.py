from dva_sim.experiments.report.blocks import TERMS, terms_in


def test_a_term_inside_of_another_word_is_none():
    assert terms_in(["No human took part.", "An upload."]) == []


def test_only_what_is_said_is_listed_in_the_order_of_the_alphabet():
    found = terms_in(["a horizon", "REQ/REP and trials of the phone default"])
    assert [term.name for term in found] == ["horizon", "phone default", "REQ/REP", "trial"]


def test_every_term_can_be_said():
    assert len({term.name for term in TERMS}) == len(TERMS)
    assert all(not term.means.endswith(".") for term in TERMS)
    assert [term.name for term in TERMS if term.name != "part" and not terms_in([term.name])] == []
