"""Runs the commands and code of a page in an empty folder and compares what they print.

A page is Markdown. Its fenced blocks are taken in order:

- A block after a line that ends with a file name and a colon, as in "`bad.yaml`:", is that file.
- `sh` is run by the shell, `python` by Python.
- `text` is what the block before printed: each line, in this order, with `...` for anything.

A comment in front of a block changes that: `<!-- test: exit 4 -->` names the exit code,
`<!-- test: add --jobs 2 -->` adds words to the command, `<!-- test: copy FILE -->` copies a file of
the repository instead, and `<!-- test: parse, REASON -->` only looks whether the program has these
commands and options.

A command with `&` at its end runs until the page is done. The ports 5600 to 5603 of a page become
free ones.
"""

import ast
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import typer
from helpers.paths import ROOT

from dva_sim.cli import app

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_NAMED = re.compile(r"`([\w./-]+\.\w+)`:\s*$")  # a line that ends so names the block's file
_ORDER = re.compile(r"<!-- test: ((?:(?!-->).)*) -->\s*$", re.DOTALL)
_LIMIT_S = 900.0
_ENVIRONMENT = {"COLUMNS": "100", "MPLBACKEND": "Agg", "NO_COLOR": "1", "TERM": "dumb"}


class Block(NamedTuple):
    """A fenced block of a page.

    Attributes:
        language: Language of the fence.
        text: Text between the fences.
        file: Name of the file that the block contains; empty for other blocks.
        order: Words of the comment in front of it.
    """

    language: str
    text: str
    file: str
    order: str

    @property
    def is_parsed_only(self) -> bool:
        """The block is parsed and not run."""
        return self.order.startswith("parse")


class Printed(NamedTuple):
    """Output of one block: its standard output and error, and its exit code."""

    text: str
    code: int


def blocks_of(page: Path) -> list[Block]:
    """Return the fenced blocks of a page in their order."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in _BLOCK.finditer(text):
        before = text[: match.start()]
        order = _ORDER.search(before)
        named = _NAMED.search(before[: order.start()] if order else before)
        found.append(
            Block(match[1], match[2], named[1] if named else "", order[1] if order else "")
        )
    return found


def commands_in(text: str) -> Iterator[list[str]]:
    """Yield the words of each command of this program in a block of shell."""
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        words = [word for word in words if word not in ("&", "do", "then")]
        words = words[: next((i for i, w in enumerate(words) if w in ("<", ">", "|")), None)]
        if words[:1] == ["dva-sim"]:
            yield words[1:]


def parse(words: list[str]) -> None:
    """Parse a command without running it.

    Raises:
        click.ClickException: the program has no such command or option.
    """
    group, rest = typer.main.get_command(app), words
    while hasattr(group, "resolve_command"):
        context = group.context_class(group)
        name, group, rest = group.resolve_command(context, rest)
    group.make_context(name, list(rest))


def run(page: Path, folder: Path) -> str:
    """Follow a page in a folder, and return all output.

    Raises:
        AssertionError: a block prints something else than the page shows, or fails.
    """
    runner = _Runner(folder)
    try:
        for number, block in enumerate(blocks_of(page), 1):
            runner.take(block, f"{page.name}, block {number}")
    finally:
        runner.end()
    return runner.everything


class _Runner:
    """Blocks of one page, in one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.printed, self.everything = folder, Printed("", 0), ""
        self._groups: list[int] = []
        self._port = _free_ports(4)

    def take(self, block: Block, place: str) -> None:
        """Run a block."""
        if block.file:
            path = self.folder / block.file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(self._with_ports(block.text), encoding="utf-8")
        elif block.is_parsed_only:
            _parse_block(block)
        elif block.order.startswith("copy "):
            shutil.copy(ROOT / block.order.removeprefix("copy "), self.folder)
        elif block.language in ("sh", "python"):
            self.printed = self._execute(block)
            self.everything += self.printed.text
            order = re.fullmatch(r"exit (\d+)", block.order)
            expected = int(order[1]) if order else 0
            assert self.printed.code == expected, f"{place}: {self.printed}"
        elif block.language == "text":
            missing = lines_missing(self._with_ports(block.text), self.printed.text)
            assert missing == [], f"{place}: {missing}\nnot in:\n{self.printed.text}"

    def end(self) -> None:
        """End the running programs."""
        for group in self._groups:
            try:
                os.killpg(group, signal.SIGKILL)
            except ProcessLookupError:
                continue

    def _with_ports(self, text: str) -> str:
        return re.sub(r"\b560([0-3])\b", lambda port: str(self._port + int(port[1])), text)

    def _execute(self, block: Block) -> Printed:
        text = self._with_ports(block.text)
        if block.order.startswith("add "):
            text = f"{text.rstrip()} {block.order.removeprefix('add ')}"
        shell = ["bash", "-euo", "pipefail", "-c", text]
        command = shell if block.language == "sh" else [sys.executable, "-c", text]
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        with tempfile.TemporaryFile() as out:
            process = subprocess.Popen(
                command,
                cwd=self.folder,
                env={**os.environ, **_ENVIRONMENT, "PATH": path},
                stdout=out,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
            self._groups.append(process.pid)
            code = process.wait(_LIMIT_S)
            out.seek(0)
            return Printed(out.read().decode(), code)


def _free_ports(count: int) -> int:
    """Return a port that is free, as are the next ones."""
    while True:
        with ExitStack() as stack:
            sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
            sockets[0].bind(("127.0.0.1", 0))
            port = int(sockets[0].getsockname()[1])
            try:
                for number, one in enumerate(sockets[1:], 1):
                    one.bind(("127.0.0.1", port + number))
            except (OSError, OverflowError):
                continue
            return port


def _parse_block(block: Block) -> None:
    if block.language == "python":
        ast.parse(block.text)
    for words in commands_in(block.text) if block.language == "sh" else ():
        parse(words)


def lines_missing(wanted: str, text: str) -> list[str]:
    """Return the lines that a text does not hold in this order; `...` matches anything."""
    rest = [_plain(line) for line in text.splitlines()]
    for line in filter(None, map(_plain, wanted.splitlines())):
        if line == "...":
            continue
        pattern = ".*".join(map(re.escape, line.split("...")))
        found = next((i for i, one in enumerate(rest) if re.fullmatch(pattern, one)), None)
        if found is None:
            return [line]
        rest = rest[found + 1 :]
    return []


def _plain(line: str) -> str:
    """A line without rules of tables and with single spaces."""
    return " ".join(re.sub(r"[─━]+", " ", line).split())


def pages(folder: str) -> list[Path]:
    """Return the pages of a folder below docs/, without its index."""
    found = sorted((ROOT / "docs" / folder).glob("*.md"))
    return [page for page in found if page.name != "index.md"]
