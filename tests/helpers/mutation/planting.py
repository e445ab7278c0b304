"""Bugs with a name: each replaces one function of the program, and reports when it acts.

They show that the checkers of safety rules find what they are there to find. One whose function is
gone fails as soon as it is planted; one that never does anything wrong counts for nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from dva_sim.protocol import messages as m

Original = Callable[..., Any]
Make = Callable[[Original, "Planted"], Original]


@dataclass
class Planted:
    """A bug while it is planted: how often it has acted, and what it did the first time."""

    acts: int = 0
    first: str = ""

    def act(self, what: str) -> None:
        """Note that the program has done the wrong thing."""
        self.acts += 1
        self.first = self.first or what


@dataclass(frozen=True)
class Bug:
    """A bug that can be planted.

    Attributes:
        name: Name of the bug.
        rule: The rule that it breaks first.
        words: Description of the bug.
        place: Module and function, such as `dva_sim.core.orders:Orders.found`.
        make: Function that makes the wrong function from the right one.
    """

    name: str
    rule: str
    words: str
    place: str
    make: Make

    @property
    def description(self) -> str:
        return f"{self.name} ({self.rule}): {self.words}"


RIGHT: Final = object()
"""Marker: do as the right function does."""


def instead(decide: Callable[..., Any]) -> Make:
    """A function that returns something else where `decide` does not return `RIGHT`."""

    def make(original: Original, bug: Planted) -> Original:
        def wrong(self: Any, *args: Any, **named_args: Any) -> Any:
            other = decide(self, *args, **named_args)
            if other is RIGHT:
                return original(self, *args, **named_args)
            bug.act(f"{type(self).__name__} at {getattr(self, 'id_tag', '')}: {args}")
            return other

        return wrong

    return make


def afterwards(change: Callable[..., Any | None]) -> Make:
    """A function whose result is changed where `change` returns something."""

    def make(original: Original, bug: Planted) -> Original:
        def wrong(self: Any, *args: Any, **named_args: Any) -> Any:
            result = original(self, *args, **named_args)
            other = change(self, result, *args, **named_args)
            if other is None:
                return result
            bug.act(f"{type(self).__name__}: {other}")
            return other

        return wrong

    return make


def skipped(when: Callable[..., bool] = lambda *_, **__: True) -> Make:
    """A function that does nothing where `when` holds."""

    def make(original: Original, bug: Planted) -> Original:
        def wrong(self: Any, *args: Any, **named_args: Any) -> Any:
            if not when(self, *args, **named_args):
                return original(self, *args, **named_args)
            bug.act(f"{type(self).__name__} does nothing: {args}")
            return None

        return wrong

    return make


def with_arguments(**changed: Any) -> Make:
    """A pure function that is called with other arguments than it was given, by name."""

    def make(original: Original, bug: Planted) -> Original:
        code = getattr(original, "__code__")  # noqa: B009 - a name that types do not know
        names = code.co_varnames[1 : code.co_argcount]

        def wrong(self: Any, *args: Any, **named_args: Any) -> Any:
            given = dict(zip(names, args, strict=False)) | named_args
            right, other = original(self, **given), original(self, **(given | changed))
            if other != right:
                bug.act(f"{getattr(self, 'id_tag', '')}: {other} instead of {right}")
            return other

        return wrong

    return make


def quiet_about(code: int) -> Make:
    """A handler of requests that sends no reply with a code, and counts none."""

    def make(original: Original, bug: Planted) -> Original:
        def wrong(
            self: Any, request: Any, message: m.Message, handler: Any, **named_args: Any
        ) -> Any:
            def quiet(asked: m.Message) -> Any:
                reply = handler(asked)
                if reply is not None and reply.code == code:
                    bug.act(f"{self.label} says nothing to {message.source}")
                    return None
                return reply

            return original(self, request, message, quiet, **named_args)

        return wrong

    return make
