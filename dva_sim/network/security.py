"""Sockets with keys, and a clear message at both ends when they do not match.

Without keys sockets are only watched. With keys a socket that binds is a CURVE server with its
device's own key; one that connects knows the key of the device it wants to reach, and needs a key
that the server's ring holds. Nothing here waits or has a thread: the loop that polls all sockets
passes those that are ready to `Security.handle`.

If only one end has keys, each hangs up as soon as it notices. The quicker one knows why; the slower
one may be cut off before it has read anything. So an end that was refused probes the endpoint with
the greeting of ZMTP 3 (RFC 37), slowly: it waits for the other end's greeting before it names its
own mechanism, and never hangs up first. libzmq's reports of failed handshakes differ between the
ends and from time to time; they are put into words as far as each end can know the reason.
"""

from __future__ import annotations

import errno
import itertools
import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import zmq
from zmq.utils import z85

from dva_sim.network.keys import KeyRing
from dva_sim.network.realtime import Poller

_SIGNATURE = b"\xff" + bytes(7) + b"\x01\x7f"
_VERSION = b"\x03\x00"
_MECHANISM = slice(12, 32)  # position of the mechanism in a greeting, padded with zeros
_LENGTH = 64  # size of a whole greeting [B]


class Greeting:
    """Greeting under way.

    Args:
        context: Context of its socket.
        endpoint: Address to greet.
        mechanism: Mechanism of this end: `NULL` or `CURVE`.

    Attributes:
        socket: Socket to be polled; `read` takes incoming data.
        theirs: Mechanism of the other end, once known.
        done: True once nothing more is expected.
    """

    def __init__(
        self, context: zmq.Context[zmq.Socket[bytes]], endpoint: str, mechanism: str
    ) -> None:
        self.mechanism = mechanism
        self.theirs: str | None = None
        self.done = False
        self._heard = b""
        self._is_open = False
        self.socket = context.socket(zmq.STREAM)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.socket.setsockopt(zmq.RECONNECT_IVL, -1)
        self.socket.connect(endpoint)

    def read(self) -> None:
        """Take what has arrived, and answer it."""
        while not self.done:
            try:
                peer, data = self.socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            if data:
                self._hear(peer, data)
            elif self._is_open:  # an empty message reports the opening, and later the end
                self.done = True
            else:
                self._is_open = True
                self._say(peer, _SIGNATURE + _VERSION)

    def _hear(self, peer: bytes, data: bytes) -> None:
        if self.theirs is not None:
            return
        self._heard += data
        if len(self._heard) < _MECHANISM.stop:
            return
        self.theirs = self._heard[_MECHANISM].rstrip(b"\0").decode("ascii", "replace")
        if self.theirs == self.mechanism:
            self.done = True
        else:
            rest = self.mechanism.encode().ljust(20, b"\0")
            self._say(peer, rest.ljust(_LENGTH - _MECHANISM.start, b"\0"))

    def _say(self, peer: bytes, data: bytes) -> None:
        try:
            self.socket.send_multipart([peer, data], zmq.NOBLOCK)
        except zmq.ZMQError:  # the other end has gone meanwhile
            self.done = True


HANDSHAKE_LIMIT = 10_000  # time for the other end to answer, whose loop may be busy [ms]


class Reason(StrEnum):
    """Reason why two ends did not connect; the same at both, as far as each can know it."""

    UNKNOWN_KEY = "unknown key"
    WRONG_SERVER_KEY = "wrong server key"
    PLAIN_CLIENT = "client without keys"
    PLAIN_SERVER = "server without keys"
    SILENT = "no answer"
    CLOSED = "closed"
    NOT_UNDERSTOOD = "not understood"


@dataclass(frozen=True)
class Refusal:
    """Failed connection of two ends, as seen from one.

    Attributes:
        device: Device that noticed the failure.
        peer: The device it wanted to reach; None at a server, which cannot know it.
        endpoint: Address of the server; empty if unknown.
        reason: Reason code.
        why: Reason in words.
    """

    device: str
    peer: str | None
    endpoint: str
    reason: Reason
    why: str

    def __str__(self) -> str:
        if self.peer is None:
            endpoint = f" at {self.endpoint}" if self.endpoint else ""
            return f"{self.device}{endpoint} refused a connection: {self.why}"
        return f"{self.device}: handshake with {self.peer} at {self.endpoint} failed: {self.why}"

    @property
    def gave_up(self) -> bool:
        """True if ZeroMQ makes no further attempt; see `Security.retry`."""
        final = {Reason.UNKNOWN_KEY, Reason.PLAIN_CLIENT, Reason.PLAIN_SERVER}
        return self.peer is not None and self.reason in final


def at_server(has_keys: bool, device: str, code: int) -> tuple[Reason, str]:
    """Interpret, at a server, libzmq's code for a failed handshake."""
    if code == zmq.PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH:
        if not has_keys:
            return Reason.PLAIN_SERVER, "the other end has keys switched on, this one has not"
        return Reason.PLAIN_CLIENT, "the other end has no keys, this one wants them"
    if code == zmq.PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC:
        return Reason.WRONG_SERVER_KEY, f"the other end has a wrong public key of {device}"
    return Reason.NOT_UNDERSTOOD, "the other end shakes hands in a way not understood"


def at_client(has_keys: bool, device: str, peer: str, event: int, code: int) -> tuple[Reason, str]:
    """Interpret, at a client, the event and code of a failed handshake."""
    if event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
        return Reason.UNKNOWN_KEY, f"{peer} does not know the key of {device}"
    if event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL:
        # A server does not say that it cannot read a greeting: it hangs up.
        if code == errno.EAGAIN:
            limit = HANDSHAKE_LIMIT // 1000
            return Reason.SILENT, f"no answer within {limit} s: is it {peer} who listens there?"
        if not has_keys:
            return Reason.CLOSED, f"it hung up: is it {peer} who listens there?"
        return (
            Reason.WRONG_SERVER_KEY,
            f"it hung up, most likely because the public key of {peer} here is not the one it has",
        )
    if code == zmq.PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH:
        return at_mismatch(has_keys, peer)
    if code == zmq.PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC:
        return Reason.WRONG_SERVER_KEY, f"what answers does not have the key of {peer}"
    return Reason.NOT_UNDERSTOOD, "what answers shakes hands in a way not understood"


def at_mismatch(has_keys: bool, peer: str) -> tuple[Reason, str]:
    """Interpret a handshake in which only one end has keys."""
    if not has_keys:
        return Reason.PLAIN_CLIENT, f"{peer} wants keys, this end has none"
    return Reason.PLAIN_SERVER, f"{peer} has no keys switched on, this end has"


# Pause before connecting again; ZeroMQ adds up to as much at random. It doubles while nobody
# listens, but not while a peer listens and hangs up, so the first pause limits such a storm.
RECONNECT_FIRST = 250  # first pause [ms]
RECONNECT_MAX = 4_000  # longest pause [ms]
MAX_HANGUPS = 3  # interrupted handshakes of a peer before they are looked into
UNKNOWN_KEYS_REPORTED = 100  # maximum unknown keys reported one by one; there may be any number
EVENTS_AT_ONCE = 1_000  # maximum events read from a monitor before the loop has its turn again

# Maximum events waiting in a monitor: a full one that nobody reads stops its whole context.
_MONITOR_ROOM = 100_000
_ZAP = "inproc://zeromq.zap.01"
_FAILED = (
    zmq.EVENT_HANDSHAKE_FAILED_AUTH
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
)
_EVENTS = _FAILED | zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_MONITOR_STOPPED
_names = itertools.count()

Socket = zmq.Socket[bytes]
_Way = tuple[str, str, str]  # from which device to which, at which endpoint


@dataclass
class _Handshake:
    """Failures of a device at one endpoint since they were last connected."""

    hang_ups: int = 0
    latest: Refusal | None = None
    reported: set[Reason] = field(default_factory=set)
    greeted: bool = False


@dataclass(frozen=True)
class _Watch:
    """Watched socket; without a peer, one that binds."""

    socket: Socket
    device: str
    peer: str | None


class Security:
    """Keys of all sockets in one context, and reports of failed handshakes.

    Args:
        context: Context of the sockets; it can have one `Security` with keys.
        poller: Poller of the loop; monitors come and go in it with the sockets that they watch.
        ring: The keys; None to run without.
        tell: Callback for each refusal, once for each cause until both ends have connected, so
            that it cannot become a flood.

    Attributes:
        refused: Failed handshakes of each device by reason, reported or not.
    """

    def __init__(
        self,
        context: zmq.Context[Socket],
        poller: Poller,
        ring: KeyRing | None,
        tell: Callable[[Refusal], object],
    ) -> None:
        self._context = context
        self._poller = poller
        self._ring = ring
        self._tell = tell
        self._has_keys = ring is not None
        self._watches: dict[Socket, _Watch] = {}
        self._monitors: dict[Socket, Socket] = {}
        self._handshakes: dict[str, dict[_Way, _Handshake]] = {}  # by peer
        self._greetings: dict[Socket, tuple[_Way, Greeting]] = {}
        self._reported: set[Refusal] = set()
        self._unknown_keys: set[tuple[str, bytes]] = set()
        self.refused: Counter[tuple[str, Reason]] = Counter()
        self._zap = None if ring is None else self._open_zap()

    def bind_server(self, socket: Socket, device: str) -> None:
        """Prepare `socket`, before it binds, to serve with the key of `device`.

        Raises:
            ConfigError: the pair of keys of `device` is not at hand.
        """
        self._give_keys(socket, device)
        if self._ring is not None:
            socket.setsockopt(zmq.CURVE_SERVER, 1)
            socket.setsockopt(zmq.ZAP_DOMAIN, device.encode())
            # Otherwise a server without a list of keys accepts any.
            socket.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)
        self._watch(socket, device, None)

    def connect_client(self, socket: Socket, device: str, peer: str) -> None:
        """Prepare `socket` of `device`, before it connects, to reach nobody but `peer`.

        Messages that arrive on it carry no name, but can come only from that peer.

        Raises:
            ConfigError: the pair of `device` or the public key of `peer` is not at hand.
        """
        self._give_keys(socket, device)
        socket.setsockopt(zmq.RECONNECT_IVL, RECONNECT_FIRST)
        socket.setsockopt(zmq.RECONNECT_IVL_MAX, RECONNECT_MAX)
        if self._ring is not None:
            socket.setsockopt(zmq.CURVE_SERVERKEY, self._ring.public(peer))
        self._watch(socket, device, peer)

    def sockets(self) -> list[Socket]:
        """Return the sockets that `handle` wants; they are in the poller already."""
        zap = [] if self._zap is None else [self._zap]
        return [*self._watches, *self._greetings, *zap]

    def handle(self, ready: object) -> bool:
        """Take what has arrived if `ready` is one of these sockets; return True if it is."""
        if ready is self._zap and self._zap is not None:
            self._read(self._zap, self._answer)
        elif isinstance(ready, zmq.Socket) and ready in self._watches:
            self._read(ready, lambda frames: self._note(ready, frames))
        elif isinstance(ready, zmq.Socket) and ready in self._greetings:
            self._read_greeting(ready)
        else:
            return False
        return True

    def sender(self, frame: zmq.Frame) -> str | None:
        """Return the sender of a message by the key in its last frame; None: the key is unknown.

        The frame must have been received with `copy=False`.
        """
        try:
            key = str(frame.get("User-Id"))
        except zmq.ZMQError:
            return None
        return None if self._ring is None else self._ring.owner(key.encode())

    def aim(self, socket: Socket, device: str, peer: str) -> None:
        """Give `socket` its peer's current key, for connections from now on.

        Raises:
            ConfigError: the public key of `peer` is not at hand.
        """
        if socket not in self._monitors:
            self.connect_client(socket, device, peer)
        elif self._ring is not None:
            socket.setsockopt(zmq.CURVE_SERVERKEY, self._ring.public(peer))

    def trouble(self, device: str, peer: str) -> str | None:
        """Return what keeps a device from its peer now, for the message after a time-out."""
        for (client, _, _), handshake in self._handshakes.get(peer, {}).items():
            if client == device and handshake.latest is not None:
                return str(handshake.latest)
        return None

    def forget(self, peer: str) -> None:
        """Forget the history of a device that is gone."""
        self._handshakes.pop(peer, None)
        for socket in [
            s for s, (connection, _) in self._greetings.items() if connection[1] == peer
        ]:
            self._end_greeting(socket)

    def release(self, socket: Socket) -> None:
        """Stop watching a socket; to be called before it is closed."""
        monitor = self._monitors.get(socket)
        if monitor is not None:
            self._drop(monitor)

    def close(self) -> None:
        """Release everything. From now on servers refuse all clients."""
        for monitor in list(self._watches):
            self._drop(monitor)
        for socket in list(self._greetings):
            self._end_greeting(socket)
        if self._zap is not None:
            self._poller.unregister(self._zap)
            self._zap.close()
            self._zap = None

    def _open_zap(self) -> Socket:
        """Return the socket at which libzmq asks, by its fixed name, whether a key is accepted."""
        zap = self._context.socket(zmq.REP)
        zap.setsockopt(zmq.LINGER, 0)
        try:
            zap.bind(_ZAP)
        except zmq.ZMQError:
            zap.close()
            raise
        self._poller.register(zap)
        return zap

    def _give_keys(self, socket: Socket, device: str) -> None:
        socket.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE_LIMIT)
        if self._ring is not None:
            public, secret = self._ring.pair(device)
            socket.setsockopt(zmq.CURVE_PUBLICKEY, public)
            socket.setsockopt(zmq.CURVE_SECRETKEY, secret)

    def _watch(self, socket: Socket, device: str, peer: str | None) -> None:
        address = f"inproc://dva-sim.monitor.{next(_names)}"
        socket.monitor(address, _EVENTS)
        monitor = self._context.socket(zmq.PAIR)
        monitor.setsockopt(zmq.LINGER, 0)
        monitor.setsockopt(zmq.RCVHWM, _MONITOR_ROOM)
        monitor.connect(address)
        self._poller.register(monitor)
        self._watches[monitor] = _Watch(socket, device, peer)
        self._monitors[socket] = monitor

    def _drop(self, monitor: Socket) -> None:
        """End a monitor, its source first: otherwise libzmq waits for a reader that has gone."""
        watch = self._watches.pop(monitor)
        del self._monitors[watch.socket]
        if not watch.socket.closed:
            watch.socket.disable_monitor()
        self._poller.unregister(monitor)
        monitor.close()

    def _read(self, socket: Socket, take: Callable[[list[bytes]], object]) -> None:
        for _ in range(EVENTS_AT_ONCE):
            if socket.closed:
                return
            try:
                frames = socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            take(frames)

    def _answer(self, frames: list[bytes]) -> None:
        """Answer whether a key is accepted (ZeroMQ RFC 27)."""
        version, request, domain, address, _, mechanism, *credentials = frames
        device = domain.decode()
        key = b"".join(credentials)
        curve = mechanism == b"CURVE" and len(key) == 32
        owner = self._ring.owner(key) if curve and self._ring is not None else None
        # The user id is the key: its owner is looked up for each message, as keys may be removed.
        status = [b"400", b"unknown key", b""] if owner is None else [b"200", b"", z85.encode(key)]
        assert self._zap is not None
        self._zap.send_multipart([version, request, *status, b""])
        if owner is None:
            self._report_unknown_key(device, key, address.decode())

    def _report_unknown_key(self, device: str, key: bytes, address: str) -> None:
        self.refused[device, Reason.UNKNOWN_KEY] += 1
        if (device, key) in self._unknown_keys or len(self._unknown_keys) >= UNKNOWN_KEYS_REPORTED:
            return
        self._unknown_keys.add((device, key))
        key_text = z85.encode(key).decode()[:8] if len(key) == 32 else ""
        why = f"an unknown key ({key_text}...) tried to connect from {address}"
        if len(self._unknown_keys) == UNKNOWN_KEYS_REPORTED:
            why += "; there are many, no more will be told"
        self._tell(Refusal(device, None, "", Reason.UNKNOWN_KEY, why))

    def _note(self, monitor: Socket, frames: list[bytes]) -> None:
        """Take an event of a monitor."""
        event, value = struct.unpack("=HI", frames[0])
        watch = self._watches[monitor]
        endpoint = frames[1].decode()
        if event == zmq.EVENT_MONITOR_STOPPED:
            self._drop(monitor)
        elif watch.peer is None:
            # A bad key is reported with the request; a peer that just leaves is not a refusal.
            if event == zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL:
                reason, why = at_server(self._has_keys, watch.device, value)
                refusal = Refusal(watch.device, None, endpoint, reason, why)
                self.refused[watch.device, reason] += 1
                if refusal not in self._reported:  # few: there are few endpoints and few reasons
                    self._reported.add(refusal)
                    self._tell(refusal)
        else:
            self._note_client(watch.device, watch.peer, endpoint, event, value)

    def _note_client(self, device: str, peer: str, endpoint: str, event: int, value: int) -> None:
        connection = device, peer, endpoint
        if event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            self._handshakes.get(peer, {}).pop(connection, None)
            for socket in [s for s, (at, _) in self._greetings.items() if at == connection]:
                self._end_greeting(socket)
            return
        handshake = self._handshakes.setdefault(peer, {}).setdefault(connection, _Handshake())
        reason, why = at_client(self._has_keys, device, peer, event, value)
        self.refused[device, reason] += 1
        handshake.latest = Refusal(device, peer, endpoint, reason, why)
        if event != zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL or value == errno.EAGAIN:
            self._tell_once(handshake)
            if reason in (Reason.PLAIN_CLIENT, Reason.PLAIN_SERVER):
                self._greet(connection, handshake)  # the server may not have heard why
            return
        # A connection may break in its handshake by chance, but hardly again and again.
        handshake.hang_ups += 1
        if handshake.hang_ups == MAX_HANGUPS:
            self._greet(connection, handshake)
        elif handshake.hang_ups == 2 * MAX_HANGUPS and not handshake.reported:
            # A greeting has not helped.
            self._tell_once(handshake)

    def _tell_once(self, handshake: _Handshake) -> None:
        refusal = handshake.latest
        if refusal is not None and refusal.reason not in handshake.reported:
            handshake.reported.add(refusal.reason)
            self._tell(refusal)

    def _greet(self, connection: _Way, handshake: _Handshake) -> None:
        """Find out, and let the other end find out, whether one has keys and one has none."""
        if not handshake.greeted:
            handshake.greeted = True
            greeting = Greeting(
                self._context, connection[2], "NULL" if self._ring is None else "CURVE"
            )
            self._greetings[greeting.socket] = connection, greeting
            self._poller.register(greeting.socket)

    def _read_greeting(self, socket: Socket) -> None:
        connection, greeting = self._greetings[socket]
        greeting.read()
        if greeting.done:
            self._end_greeting(socket)
        handshake = self._handshakes.get(connection[1], {}).get(connection)
        # The end may never be reported: the other end's mechanism is enough to conclude.
        is_open = greeting.theirs is None and not greeting.done
        if is_open or handshake is None or handshake.reported:
            return
        device, peer, endpoint = connection
        if greeting.theirs not in (None, greeting.mechanism):
            reason, why = at_mismatch(self._has_keys, peer)
            handshake.latest = Refusal(device, peer, endpoint, reason, why)
        self._tell_once(handshake)

    def _end_greeting(self, socket: Socket) -> None:
        del self._greetings[socket]
        self._poller.unregister(socket)
        socket.close()
