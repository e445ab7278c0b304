"""Worlds for the contract tests: every promise is held against every transport."""

from collections.abc import Iterator

import pytest
from helpers.network.transports import (
    GUARD,
    LOSSY,
    NODES,
    VIRTUAL,
    SocketWorld,
    VirtualWorld,
    World,
)

from dva_sim.network.keys import KeyRing, create_keys

SOCKETS = [
    pytest.param(kind, marks=pytest.mark.system) for kind in ("sockets", "sockets with keys")
]


@pytest.fixture(scope="session")
def ring(tmp_path_factory: pytest.TempPathFactory) -> KeyRing:
    folder = tmp_path_factory.mktemp("keys")
    create_keys(folder, [*NODES, GUARD])
    return KeyRing(folder)


@pytest.fixture(params=[*VIRTUAL, LOSSY, *SOCKETS])
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    made = _world(request)
    yield made
    made.close()


@pytest.fixture(params=SOCKETS)
def sockets(request: pytest.FixtureRequest) -> Iterator[SocketWorld]:
    made = SocketWorld(_ring(request))
    yield made
    made.close()


def _world(request: pytest.FixtureRequest) -> World:
    if request.param == LOSSY:
        return VirtualWorld(VIRTUAL["virtual segments"](), loss=0.05)
    make = VIRTUAL.get(request.param)
    return VirtualWorld(make()) if make else SocketWorld(_ring(request))


def _ring(request: pytest.FixtureRequest) -> KeyRing | None:
    return request.getfixturevalue("ring") if "keys" in request.param else None
