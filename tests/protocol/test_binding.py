"""A binding that a stranger's generator makes from the schema understands what we say.

Somebody who writes a client in another language begins so. The generated classes know nothing of
this project; what they hold is compared element by element with what was encoded.
"""

import importlib.util
import os
import sys
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path

import pytest
from helpers.messages.message_oracle import says
from helpers.messages.message_strategies import BODIES, messages, with_header
from helpers.paths import ROOT
from helpers.processes import patience
from helpers.processes.search_settings import search
from hypothesis import given
from hypothesis import strategies as st
from xsdata.formats.dataclass.parsers import XmlParser
from xsdata.formats.dataclass.serializers import XmlSerializer

from dva_sim.protocol.codec import decode, encode

PROTOCOL = ROOT / "protocol"
VALID = sorted((PROTOCOL / "samples" / "valid").glob("*.xml"))


@pytest.fixture(scope="session")
def binding(tmp_path_factory):
    """The module that is generated from the schema."""
    folder = tmp_path_factory.mktemp("binding")
    # The generator formats its output with a program installed beside the interpreter.
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    command = ["generate", str(PROTOCOL / "dva.xsd"), "--package", "dva_binding"]
    done = patience.run(
        [sys.executable, "-m", "xsdata", *command, "--structure-style", "single-package"],
        cwd=folder,
        env=os.environ | {"PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    spec = importlib.util.spec_from_file_location("dva_binding", folder / "dva_binding.py")
    module = importlib.util.module_from_spec(spec)
    # Annotations in the generated classes are looked up by the name of their module.
    sys.modules["dva_binding"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["dva_binding"]


class Node(list):
    """An object of the binding as a tree of names and texts."""

    def __init__(self, tag, value):
        self.tag, self.text = tag, None
        if is_dataclass(value):
            super().__init__(below(value))
        else:
            self.text = value.value if isinstance(value, Enum) else value
            assert isinstance(self.text, str)


def below(value):
    for field in fields(value):
        held = getattr(value, field.name)
        for one in held if isinstance(held, list) else [held]:
            if one is not None:
                yield Node(field.metadata.get("name", field.name), one)


def understood(binding, data):
    return XmlParser().from_bytes(data, binding.Msg)


@pytest.mark.system
@pytest.mark.parametrize("kind", BODIES, ids=lambda kind: kind.__name__)
def test_every_element_of_every_message_is_the_same_in_the_binding_and_on_the_way_back(
    binding, kind
):
    @search(4)
    @given(BODIES[kind].flatmap(with_header))
    def both_ways(sent):
        held = understood(binding, encode(sent))
        assert says(Node("msg", held), sent)
        assert repr(decode(XmlSerializer().render(held).encode())) == repr(sent)

    both_ways()


@pytest.mark.parametrize("path", VALID, ids=lambda path: path.stem)
def test_the_binding_and_the_codec_read_the_same_in_a_sample(binding, path):
    data = path.read_bytes()
    assert says(Node("msg", understood(binding, data)), decode(data))


@given(st.data())
@search(10)
def test_a_value_changed_in_the_binding_is_noticed(binding, data):
    """The comparison can fail: it would be worth nothing otherwise."""
    sent = data.draw(messages)
    tree = Node("msg", understood(binding, encode(sent)))
    leaves = [node for node in every(tree) if node.text is not None]
    changed = data.draw(st.sampled_from(leaves))
    # Not the same number in other words, either.
    changed.text = "31" if changed.text.strip("0.") != "31" else "32"
    assert not says(tree, sent)


def every(node):
    yield node
    for child in node:
        yield from every(child)
