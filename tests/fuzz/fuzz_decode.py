"""Search for bytes that `decode` misreads, guided by the branches they take.

The long run: `python tests/fuzz/fuzz_decode.py -max_total_time=3600 corpus/`; the folder may be
empty and keeps what was found. Options are those of libFuzzer. Bytes that fail are left in a file
`crash-...`; name it instead of the folder to see them fail again.
"""

import os
import signal
import sys
import tempfile
from pathlib import Path
from random import Random

import atheris

sys.path.insert(0, str(Path(__file__).parents[1]))

with atheris.instrument_imports(include=["dva_sim.protocol"]):
    from dva_sim.protocol.codec import decode, encode

from helpers.messages.damaged_messages import mutated
from helpers.messages.message_oracle import decode_or_refuse

SAMPLES = Path(__file__).parents[2] / "protocol" / "samples"


def damaged(data: bytes, most: int, seed: int) -> bytes:
    """By someone who knows the protocol, or by someone who knows nothing."""
    rng = Random(seed)
    new = mutated(data, rng) if rng.random() < 0.5 else atheris.Mutate(data, most)
    return bytes(new[:most])


def write_seeds(folder: Path) -> None:
    """The valid samples in the form that `encode` gives them, which is read another way."""
    for path in (SAMPLES / "valid").glob("*.xml"):
        (folder / path.name).write_bytes(encode(decode(path.read_bytes())))


def inputs(made: Path) -> list[str]:
    """Inputs of libFuzzer: a single file, or folders, the first of which it writes to."""
    given = [word for word in sys.argv[1:] if not word.startswith("-")]
    if any(Path(word).is_file() for word in given):
        return []
    seeds, found = made / "seeds", made / "found"
    seeds.mkdir()
    found.mkdir()
    write_seeds(seeds)
    own = [] if given else [str(found)]
    return [*own, str(seeds), str(SAMPLES / "valid"), str(SAMPLES / "invalid")]


def fuzz(arguments: list[str]) -> None:
    def one(data: bytes) -> None:
        decode_or_refuse(data)

    atheris.Setup(arguments, one, custom_mutator=damaged)
    atheris.Fuzz()


def main() -> int:
    with tempfile.TemporaryDirectory() as made:
        arguments = [sys.argv[0], "-max_len=9000", *sys.argv[1:], *inputs(Path(made))]
        # libFuzzer ends its process without a word to Python, so another one tidies up.
        child = os.fork()
        if not child:
            fuzz(arguments)
            os._exit(0)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


if __name__ == "__main__":
    sys.exit(main())
