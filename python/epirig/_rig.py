"""A rig: its stage and camera by hand, and its scans frame by frame."""

from __future__ import annotations

import atexit
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from numpy.typing import NDArray

from . import _native
from ._errors import OptionError
from ._sequence import Sequence
from ._verbs import RigOptions


@dataclass(frozen=True, eq=False)
class CapturedFrame:
    """A good frame of a scan."""

    index: int
    """Index of the frame, from 0."""
    image: NDArray[Any]
    """The frame: (rows, columns) of uint8 or uint16."""
    commanded_mm: float | None
    """Position that was asked for, in mm."""
    reported_mm: float | None
    """Position that the stage reported, in mm."""
    exposure: dict[str, Any] | None
    """How it was taken."""
    certificate: dict[str, Any] | None
    """Why it is good: the stage at rest before and after its exposure."""


class Rig(RigOptions):
    __doc__ = (RigOptions.__doc__ or "") + """
    As a context manager it is connected, and leaves no stage moving:

    >>> with Rig(rig="sim", set=["camera.size=64x48"]) as rig:
    ...     rig.home()
    ...     rig.move_to(12.5)
    ...     rig.grab().shape
    (48, 64)
    """

    _connection: _native.Connection | None = None
    _running: _native.Scan | None = None

    def connect(self) -> Rig:
        """Connects to the stage, and opens the camera; a connection that is there is kept."""
        if self._connection is None:
            self._connection = _native.Connection(self._words)
            # A program that ends leaves no stage moving.
            atexit.register(self.close)
        return self

    def close(self) -> None:
        """Lets go of stage and camera; a stage that moves is stopped."""
        connection, self._connection = self._connection, None
        if connection is not None:
            atexit.unregister(self.close)
            connection.close()

    def __enter__(self) -> Rig:
        return self.connect()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def connected(self) -> bool:
        """Whether stage and camera are connected."""
        return self._connection is not None

    @property
    def _connected(self) -> _native.Connection:
        if self._connection is None:
            raise OptionError("the rig is not connected; use it in a with statement, or call connect()", 2, "usage")
        return self._connection

    def home(self) -> None:
        """Homes the stage. Ctrl-C stops it."""
        self._connected.home()

    def move_to(self, position_mm: float) -> None:
        """Moves to a position in mm from home, and returns when the stage is at rest and reports it. Ctrl-C stops it."""
        self._connected.move_to(position_mm)

    def stop(self) -> None:
        """Stops the stage, also while another thread moves it. A scan ends after the frame in hand, and at the second
        call at once; it can be resumed."""
        if self._running is not None:
            self._running.interrupt()
        else:
            self._connected.stop()

    @property
    def position_mm(self) -> float | None:
        """Position that the stage reports, in mm from home; None if it is not homed."""
        return self._connected.state()[0]

    @property
    def moving(self) -> bool:
        """Whether the stage moves."""
        return self._connected.state()[1]

    @property
    def travel_mm(self) -> float:
        """Length of the travel, in mm: positions go from 0 to this."""
        return self._connected.facts()[0]

    @property
    def names(self) -> tuple[str, str]:
        """What stage and camera call themselves."""
        return self._connected.facts()[1:]

    def grab(self) -> NDArray[Any]:
        """A frame whose exposure begins after this call: (rows, columns) of uint8 or uint16."""
        frame: NDArray[Any] = self._connected.grab()
        return frame

    def capture(self, out: str | os.PathLike[str]) -> Iterator[CapturedFrame]:
        """Takes a scan as it is planned, and gives each good frame as soon as it is taken.

        The frames are written to ``out``, a new sequence. Frames that fail are taken again, as in ``epirig capture``.
        The stage rests while the loop works on a frame. Who leaves the loop early, or presses Ctrl-C, ends the scan;
        ``resume`` continues it. What the scan remarks goes to the logger ``epirig``. A connection by hand is closed
        first, and made again at the end.
        """
        yield from self._scan(["capture", *self._words, f"--out={os.fspath(out)}"])

    def resume(self, sequence: Sequence | str | os.PathLike[str]) -> Iterator[CapturedFrame]:
        """Takes the missing frames of a scan, with the rig that is recorded in it."""
        folder = sequence.folder if isinstance(sequence, Sequence) else Path(sequence)
        yield from self._scan(["resume", "--", os.fspath(folder)])

    def _scan(self, words: list[str]) -> Iterator[CapturedFrame]:
        was_connected = self.connected
        self.close()
        self._running = scan = _native.Scan(words)
        atexit.register(scan.close)
        try:
            while (taken := scan.next()) is not None:
                index, image, facts = taken
                yield CapturedFrame(index, image, **json.loads(facts))
        finally:
            self._running = None
            atexit.unregister(scan.close)
            scan.close()
        if was_connected:
            self.connect()
