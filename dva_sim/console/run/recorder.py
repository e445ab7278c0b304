"""Memory of a console's run: little, and all of it in a file where one is wanted."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Container
from typing import Any

from typing_extensions import override

from dva_sim.kernel.recorder import DriveLog, Recorder
from dva_sim.live.recording import LiveRecorder

KEPT_PER_DRIVE = 200  # of each list of a drive, and of ended drives nothing but the last
KEPT_DRIVES = 20
KEPT_COMMANDS = 2000  # on their way
KEPT_MESSAGES = 2000  # to robots, on their way

Note = Callable[[DriveLog], object]


class ConsoleRecorder(Recorder):
    """A recorder of a run that may last for ever.

    Attributes:
        on_applied: Callback for each drive in which a command took effect.
        on_ordered: Callback for each drive as it is ordered.
        on_tidy: Called before what is old is forgotten.
        on_tidied: Called afterwards.
        kept: Callback for lines for a recording, if there is to be one.
        robots: Ids of those of whom it is noted when a message to them was sent.
    """

    def __init__(self) -> None:
        super().__init__()
        self.on_applied: Note = lambda _: None
        self.on_ordered: Note = lambda _: None
        self.on_tidy: Callable[[], object] = lambda: None
        self.on_tidied: Callable[[], object] = lambda: None
        self.kept: LiveRecorder | None = None
        self.robots: Container[str] = ()
        self._sent: OrderedDict[bytes, float] = OrderedDict()
        self._numbers: dict[int, int] = {}
        self._known = 0
        self._done: dict[int, list[float]] = {}  # up to when a drive was kept [s]

    @override
    def tell(self, time: float, who: str, what: str, kind: str = "event") -> None:
        super().tell(time, who, what, kind)
        if self.kept is not None:
            self.kept.put("told", time, who, what, kind)

    @override
    def view(self, time: float, robot: str, x: float, y: float, heading: float) -> None:
        if self.kept is not None:
            self.kept.view(time, robot, x, y, heading)

    @override
    def message_sent(
        self, time: float, source: str, destination: str, size: int, payload: Any
    ) -> None:
        super().message_sent(time, source, destination, size, payload)
        if destination in self.robots and isinstance(payload, bytes):
            self._sent.setdefault(payload, time)  # one sent again counts from the first time on
            if len(self._sent) > KEPT_MESSAGES:
                self._sent.popitem(last=False)
        if self.kept is not None:
            self.kept.message(source, payload, sent=True)

    def sent_at(self, payload: bytes) -> float | None:
        """Return when a message to a robot was sent [s], once; None if not by this process."""
        return self._sent.pop(payload, None)

    def message_taken(self, node: str, payload: bytes) -> None:
        """Keep a message that a device of ours has taken from others over a real link."""
        if self.kept is not None:
            self.kept.message(node, payload, sent=False)

    @override
    def command_applied(self, drive: DriveLog, *about: Any, **more: Any) -> None:
        super().command_applied(drive, *about, **more)
        self.on_applied(drive)

    @override
    def drive_ordered(self, drive: DriveLog) -> None:
        super().drive_ordered(drive)
        self._known += 1
        self._numbers[id(drive)] = self._known
        self.on_ordered(drive)

    def tidy(self) -> None:
        """Keep what is new for the recording and the results, and forget what is old."""
        for drive in self.drives:
            if self.kept is not None:
                self._keep(self.kept, drive)
        self.on_tidy()
        self._forget()
        self.on_tidied()

    def _forget(self) -> None:
        for drive in self.drives:
            for entries in (drive.frames, drive.commands, drive.applied, drive.intents):
                del entries[:-KEPT_PER_DRIVE]
        over = [drive for drive in self.drives if drive.ended is not None][:-KEPT_DRIVES]
        for drive in over:
            self.drives.remove(drive)
            self._done.pop(self._numbers.pop(id(drive)), None)
        for key in list(self._issued)[:-KEPT_COMMANDS]:
            del self._issued[key]

    def _keep(self, recorder: LiveRecorder, drive: DriveLog) -> None:
        number = self._numbers[id(drive)]
        facts = [drive.robot, drive.operator, drive.event, drive.ordered]
        facts += [drive.started, drive.ended, drive.outcome]
        recorder.put_new("drive", drive.operator, number, facts, key=f"drive {number}")
        done = self._done.setdefault(number, [0.0, 0.0])
        seen = [(f.captured, f.time) for f in drive.frames if f.time > done[0]]
        made = [command for command in drive.commands if command[0] > done[1]]
        if (seen or made) and recorder.put("drove", drive.operator, number, seen, made):
            done[0] = seen[-1][1] if seen else done[0]
            done[1] = made[-1][0] if made else done[1]
