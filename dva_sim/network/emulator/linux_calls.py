"""The few calls of Linux that Python does not offer: namespaces, parent's death, priority, devices.

Only the C library is needed; the numbers are part of the kernel's stable interface (unshare(2),
prctl(2), user_namespaces(7), sched(7)).

What the kernel sends to a TUN device can be read here, what is written here it receives. It is set
up by ioctl and one rtnetlink message, so that no program has to be installed. A route holds the
congestion control, because some kernels refuse the sysctl in a namespace (netdevice(7),
rtnetlink(7), RFC 3549).
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import signal
import socket
import struct
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

CLONE_NEWNS = 0x00020000
CLONE_NEWUSER = 0x10000000
CLONE_NEWPID = 0x20000000
CLONE_NEWNET = 0x40000000
_MS_NOSUID = 0x2
_MS_NODEV = 0x4
_MS_NOEXEC = 0x8
_MS_REC = 0x4000
_MS_SLAVE = 0x80000
_PR_SET_PDEATHSIG = 1
_PR_SET_TIMERSLACK = 29


def enter_network_namespace() -> None:
    """Leave the network of the parent for a new and empty one that dies with its processes.

    Raises:
        OSError: forbidden here.
    """
    _check(_libc().unshare(CLONE_NEWNET), "a network namespace")


def become_owner(rootless: bool) -> str:
    """Be allowed to make network namespaces: as root, or as root of a new user namespace.

    Args:
        rootless: The latter also where the former would do.

    Returns:
        `root` or `user namespace`.

    Raises:
        OSError: neither is allowed here.
    """
    if not rootless:
        with suppress(PermissionError):
            enter_network_namespace()
            return "root"
    become_root_of_a_user_namespace()
    return "user namespace"


def become_root_of_a_user_namespace() -> None:
    """Become root inside new namespaces of this process only.

    Raises:
        OSError: forbidden here.
    """
    _enter_user_namespace(0, 0, CLONE_NEWNET)


def become_user(user: int, group: int) -> None:
    """Be called by these numbers again, after having become root of a user namespace.

    Raises:
        OSError: forbidden here.
    """
    if (user, group) != (os.getuid(), os.getgid()):
        _enter_user_namespace(user, group)


def _enter_user_namespace(user: int, group: int, more: int = 0) -> None:
    """Be called by these numbers in a new user namespace, and have what more is named."""
    before = os.getuid(), os.getgid()
    _check(_libc().unshare(CLONE_NEWUSER | more), "a user namespace")
    try:
        Path("/proc/self/setgroups").write_text("deny", encoding="ascii")
        Path("/proc/self/uid_map").write_text(f"{user} {before[0]} 1", encoding="ascii")
        Path("/proc/self/gid_map").write_text(f"{group} {before[1]} 1", encoding="ascii")
    except OSError as error:
        raise OSError(error.errno, f"a user's number is refused: {error.strerror}") from None


def join_namespace(file: int, kind: int) -> None:
    """Enter the namespace behind an open file of `/proc/PID/ns`.

    Raises:
        OSError: forbidden here.
    """
    _check(_libc().setns(file, kind), "entering a namespace")


def separate_children() -> None:
    """Let the next child be the first of new process and mount namespaces.

    All processes of such a namespace are killed when its first one ends.

    Raises:
        OSError: forbidden here.
    """
    _check(_libc().unshare(CLONE_NEWPID | CLONE_NEWNS), "a process namespace")


def show_own_processes() -> None:
    """Let `/proc` show the processes of this namespace, where that is allowed; some containers
    forbid it, and their `/proc` stays.
    """
    flags = _MS_NOSUID | _MS_NODEV | _MS_NOEXEC
    if _libc().mount(None, b"/", None, _MS_REC | _MS_SLAVE, None) == 0:
        _libc().mount(b"proc", b"/proc", b"proc", flags, None)


def die_with_maker(alive: int) -> None:
    """Like `die_with_parent`, in a process namespace that the parent is not part of.

    Args:
        alive: Reading end of a pipe that the parent alone can write to.
    """
    _check(_libc().prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0), "to die with the parent")
    os.set_blocking(alive, False)
    with suppress(BlockingIOError):
        if os.read(alive, 1) == b"":
            os._exit(1)


def die_with_parent(parent: int) -> None:
    """Be killed when the process that started this one ends, however it ends.

    Args:
        parent: Its id, as it knows it: if it is gone already, this process ends here.
    """
    _check(_libc().prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0), "to die with the parent")
    if os.getppid() != parent:
        os._exit(1)


def be_punctual(priority: int) -> bool:
    """Ask for exact timers and real-time priority; whether the latter was granted."""
    _libc().prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    return os.sched_getscheduler(0) == os.SCHED_FIFO


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _check(result: int, what: str) -> None:
    if result != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what} is refused: {os.strerror(number)}")


MTU = 1500
_TUN = "/dev/net/tun"
_NAME = b"link"
_TX_DROP = 11  # column of /proc/net/dev
_TUNSETIFF = 0x400454CA
_IFF_TUN = 0x0001
_IFF_NO_PI = 0x1000
_IFF_UP = 0x1
_IFF_RUNNING = 0x40
_SIOCSIFFLAGS = 0x8914
_SIOCSIFADDR = 0x8916
_SIOCSIFNETMASK = 0x891C
_SIOCGIFINDEX = 0x8933
_RTM_NEWROUTE = 24
_NLM_F_REQUEST = 0x1
_NLM_F_ACK = 0x4
_NLM_F_REPLACE = 0x100
_NLM_F_CREATE = 0x400
_NLMSG_ERROR = 2
_RT_TABLE_MAIN = 254
_RTPROT_BOOT = 3
_RT_SCOPE_LINK = 253
_RTN_UNICAST = 1
_RTA_DST = 1
_RTA_OIF = 4
_RTA_METRICS = 8
_RTAX_CC_ALGO = 16


@dataclass(frozen=True)
class End:
    """One end of the link.

    Attributes:
        address: Address of this end.
        peer: Address of the other end.
    """

    address: str
    peer: str


NEAR_END = End("10.77.0.1", "10.77.0.2")
FAR_END = End("10.77.0.2", "10.77.0.1")


def open_tun(end: End, congestion: str) -> int:
    """Return a TUN device of this namespace, up, with a route to the other end.

    Args:
        end: Addresses.
        congestion: Congestion control of all TCP over it, such as `cubic`.

    Returns:
        File descriptor that reads and writes whole IP packets, without waiting.

    Raises:
        OSError: there is no such device, it is forbidden, or the kernel has no such control.
    """
    try:
        tun = os.open(_TUN, os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(tun, _TUNSETIFF, struct.pack("16sH22x", _NAME, _IFF_TUN | _IFF_NO_PI))
    except OSError as error:
        raise OSError(error.errno, f"{_TUN} is refused: {error.strerror}") from None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        fcntl.ioctl(control, _SIOCSIFADDR, _address(end.address))
        fcntl.ioctl(control, _SIOCSIFNETMASK, _address("255.255.255.255"))
        fcntl.ioctl(control, _SIOCSIFFLAGS, struct.pack("16sH22x", _NAME, _IFF_UP | _IFF_RUNNING))
        index = fcntl.ioctl(control, _SIOCGIFINDEX, struct.pack("16s24x", _NAME))
    _add_route(end.peer, struct.unpack_from("i", index, 16)[0], congestion)
    return tun


def raise_loopback() -> None:
    """Let the loopback device of this namespace carry packets.

    Raises:
        OSError: forbidden here.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        fcntl.ioctl(control, _SIOCSIFFLAGS, struct.pack("16sH22x", b"lo", _IFF_UP | _IFF_RUNNING))


class DroppedPackets:
    """Packets that the kernel dropped because nobody read them from the device in time.

    It belongs to the namespace in which it was made.
    """

    def __init__(self) -> None:
        self._file = os.open("/proc/thread-self/net/dev", os.O_RDONLY)

    def count(self) -> int:
        """Return how many there were so far."""
        lines = os.pread(self._file, 65_536, 0).splitlines()
        counts = next(line for line in lines if line.strip().startswith(_NAME + b":"))
        return int(counts.partition(b":")[2].split()[_TX_DROP])


def _address(text: str) -> bytes:
    """Return an `ifreq` with an IPv4 address."""
    return struct.pack("16sHH4s16x", _NAME, socket.AF_INET, 0, socket.inet_aton(text))


def _add_route(peer: str, index: int, congestion: str) -> None:
    metrics = _attribute(_RTAX_CC_ALGO, congestion.encode() + b"\0")
    body = struct.pack(
        "BBBBBBBBI",
        socket.AF_INET,
        32,
        0,
        0,
        _RT_TABLE_MAIN,
        _RTPROT_BOOT,
        _RT_SCOPE_LINK,
        _RTN_UNICAST,
        0,
    )
    body += _attribute(_RTA_DST, socket.inet_aton(peer))
    body += _attribute(_RTA_OIF, struct.pack("i", index))
    body += _attribute(_RTA_METRICS, metrics)
    _ask_kernel(body, f"a route with congestion control {congestion!r}")


def _attribute(kind: int, value: bytes) -> bytes:
    """Return a netlink attribute, padded to four bytes."""
    return struct.pack("HH", 4 + len(value), kind) + value + b"\0" * (-len(value) % 4)


def _ask_kernel(body: bytes, what: str) -> None:
    """Send a route message; the kernel answers with an error number, 0 for success."""
    flags = _NLM_F_REQUEST | _NLM_F_ACK | _NLM_F_REPLACE | _NLM_F_CREATE
    header = struct.pack("IHHII", 16 + len(body), _RTM_NEWROUTE, flags, 1, 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as netlink:
        netlink.sendall(header + body)
        answer = netlink.recv(4096)
    kind = struct.unpack_from("H", answer, 4)[0]
    number = -struct.unpack_from("i", answer, 16)[0]
    if kind != _NLMSG_ERROR or number != 0:
        raise OSError(number, f"{what} is refused: {os.strerror(number)}")
