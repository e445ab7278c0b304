from dva_sim.experiments.report.glossary import TERMS, Marker, terms_in


def marked(*texts):
    """The texts with the words that would be explained in square brackets."""
    marker = Marker(TERMS)
    return [
        "".join(f"[{piece}]" if term else piece for piece, term in marker.split(text))
        for text in texts
    ]


def test_a_word_is_marked_where_it_first_stands_and_nowhere_else():
    assert marked("REQ/REP is slow.", "REQ/REP it was.") == [
        "[REQ/REP] is slow.",
        "REQ/REP it was.",
    ]


def test_of_two_terms_at_one_place_the_longer_one_counts():
    assert marked("A 95 % band.") == ["A [95 % band]."]
    assert marked("latest-wins PUB/SUB, then latest-wins") == [
        "[latest-wins PUB/SUB], then latest-wins"
    ]


def test_a_term_inside_of_another_word_or_meaning_is_none():
    assert marked("No human took part.", "An upload.") == ["No human took part.", "An upload."]
    assert marked("In part drive") == ["In [part] drive"]


def test_only_what_is_said_is_listed_in_the_order_of_the_alphabet():
    found = terms_in(["a horizon", "REQ/REP and trials of the phone default"])
    assert [term.name for term in found] == ["horizon", "phone default", "REQ/REP", "trial"]


def test_every_term_can_be_said_and_linked():
    assert len({term.key for term in TERMS}) == len(TERMS)
    assert all(not term.means.endswith(".") for term in TERMS)
    assert [term.name for term in TERMS if term.name != "part" and not terms_in([term.name])] == []
