"""Named random streams: one seed per run, one stream per source of randomness.

Adding an agent changes nobody else's random numbers, because a stream depends only on the
seed and its own name, never on how many streams were made before it.
"""

from __future__ import annotations

import hashlib

import numpy as np


class Streams:
    """All random numbers of one run.

    Args:
        seed: The run's seed, any non-negative integer.

    Example:
        >>> streams = Streams(7)
        >>> streams["robot-1/imu"].normal() == Streams(7)["robot-1/imu"].normal()
        True
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self._streams: dict[str, np.random.Generator] = {}

    def __getitem__(self, name: str) -> np.random.Generator:
        """Return the stream of that name, which continues from its last use."""
        stream = self._streams.get(name)
        if stream is None:
            stream = self._streams[name] = self.fresh(name)
        return stream

    def fresh(self, name: str) -> np.random.Generator:
        """Return the stream of that name from its beginning."""
        key = np.frombuffer(hashlib.sha256(name.encode()).digest()[:16], dtype=np.uint32)
        sequence = np.random.SeedSequence(self.seed, spawn_key=tuple(int(k) for k in key))
        return np.random.Generator(np.random.PCG64(sequence))


def derive_seed(*parts: object) -> int:
    """Return a 63-bit seed from names and numbers, the same on every machine."""
    text = "\x1f".join(str(p) for p in parts).encode()
    return int.from_bytes(hashlib.sha256(text).digest()[:8], "big") >> 1
