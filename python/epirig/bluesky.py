"""Stage and camera of a rig as devices of bluesky.

>>> import epirig
>>> from epirig.bluesky import devices
>>> rig = epirig.Rig(rig="sim", set=["camera.size=64x48"])
>>> stage, camera = devices(rig)
>>> with rig:
...     stage.stage().wait()  # homes the carriage
...     stage.set(12.5).wait()
...     stage.read()["stage"]["value"]
12.5

``examples/bluesky_scan.py`` has a plan. bluesky itself is not needed to import this module.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._errors import OptionError
from ._rig import Rig

if TYPE_CHECKING:
    from bluesky.protocols import Hints, Location, Reading
    from event_model import DataKey

__all__ = ["CameraDevice", "StageDevice", "Work", "devices"]


class Work:
    """Work of a device in a thread of its own: a ``Status`` of bluesky."""

    def __init__(self, work: Callable[[], object], what: str = "work") -> None:
        self._what = what
        self._is_stopped_as_planned = False
        self._failed: BaseException | None = None
        self._callbacks: list[Callable[[Any], None]] = []
        self._lock = threading.Lock()
        self._ended = threading.Event()
        threading.Thread(target=self._run, args=(work,), daemon=True).start()

    def _run(self, work: Callable[[], object]) -> None:
        try:
            work()
        except BaseException as error:
            # Whoever asks for it raises it.
            self._failed = None if self._is_stopped_as_planned else error
        with self._lock:
            self._ended.set()
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback(self)

    def __repr__(self) -> str:
        if not self.done:
            return f"<{self._what}: goes on>"
        return f"<{self._what}: done>" if self._failed is None else f"<{self._what}: {self._failed}>"

    def end_well(self) -> None:
        """It is about to be stopped, as planned: that is no failure."""
        self._is_stopped_as_planned = True

    def add_callback(self, callback: Callable[[Any], None]) -> None:
        """Calls ``callback`` with this object at the end, or at once if it has ended."""
        with self._lock:
            if not self._ended.is_set():
                self._callbacks.append(callback)
                return
        callback(self)

    def exception(self, timeout: float | None = 0.0) -> BaseException | None:
        """What went wrong, once it has ended: waits up to ``timeout`` s, without it for ever."""
        if not self._ended.wait(timeout):
            raise TimeoutError(f"the work has not ended within {timeout} s")
        return self._failed

    def wait(self, timeout: float | None = None) -> None:
        """Waits for the end, up to ``timeout`` s, and raises what went wrong."""
        if (failed := self.exception(timeout)) is not None:
            raise failed

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self._ended.is_set()

    @property
    def success(self) -> bool:
        """Whether it has ended well."""
        return self.done and self._failed is None


class _Users:
    """Who uses the connection of a rig: the first connects it, and the last one lets go of it."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._names: set[str] = set()
        self._connected_here = False
        self._lock = threading.Lock()

    def join(self, name: str) -> None:
        with self._lock:
            if not self._names:
                self._connected_here = not self._rig.connected
            self._rig.connect()
            self._names.add(name)

    def leave(self, name: str) -> None:
        with self._lock:
            self._names.discard(name)
            if not self._names and self._connected_here:
                self._connected_here = False
                self._rig.close()


class _Device:
    parent = None

    def __init__(self, rig: Rig, name: str, users: _Users | None) -> None:
        self._rig = rig
        self._name = name
        self._users = users or _Users(rig)

    @property
    def name(self) -> str:
        """The name in documents."""
        return self._name

    @property
    def hints(self) -> Hints:
        """What is worth plotting."""
        return {"fields": [self._name]}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._name!r})"

    def _identity(self, index: int) -> str:
        return self._rig.names[index]

    def unstage(self) -> list[Any]:
        """Lets go of the rig, if these devices have connected it and no other is staged."""
        self._users.leave(self._name)
        return [self]


class StageDevice(_Device):
    """The stage: movable, to positions in mm from home; readable, locatable and stoppable."""

    def __init__(self, rig: Rig, name: str = "stage", users: _Users | None = None) -> None:
        super().__init__(rig, name, users)
        self._target_mm: float | None = None
        self._seen_mm = float("nan")
        self._moving: Work | None = None

    def stage(self) -> Work:
        """Connects to the rig if nobody has, and homes a stage whose position is unknown."""
        return self._begin(self._prepare, "staging")

    def set(self, position_mm: float) -> Work:
        """Moves to a position in mm from home; done when the stage is at rest there.

        Raises
        ------
        epirig.OptionError
            If it moves already; stop it first.
        """
        target_mm = float(position_mm)
        work = self._begin(lambda: self._rig.move_to(target_mm), f"move to {target_mm} mm")
        self._target_mm = target_mm
        return work

    def stop(self, success: bool = True) -> None:
        """Stops a motion, and returns when the stage is at rest. As planned (``success``), the motion has not failed."""
        if success and self._moving is not None:
            self._moving.end_well()
        if self._rig.connected:
            self._rig.stop()

    def locate(self) -> Location[float]:
        """Where it was sent (before that: where it is), and where it is, in mm."""
        position_mm = self._position_mm()
        return {"setpoint": position_mm if self._target_mm is None else self._target_mm, "readback": position_mm}

    def read(self) -> dict[str, Reading[float]]:
        """The reported position in mm from home; while it moves, the one before; NaN before homing."""
        return {self._name: {"value": self._position_mm(), "timestamp": time.time()}}

    def describe(self) -> dict[str, DataKey]:
        """What ``read`` gives."""
        source = f"epirig:{self._identity(0)}"
        return {self._name: {"source": source, "dtype": "number", "shape": [], "units": "mm", "precision": 4}}

    def _begin(self, work: Callable[[], object], what: str) -> Work:
        if self._is_busy():
            raise OptionError("the stage is moving; wait for the end of its motion, or stop it", 2, "usage")
        self._moving = Work(work, f"{what} of {self._name}")
        return self._moving

    def _is_busy(self) -> bool:
        return self._moving is not None and not self._moving.done

    def _prepare(self) -> None:
        self._users.join(self._name)
        if self._rig.position_mm is None:
            self._rig.home()

    def _position_mm(self) -> float:
        # The line to a stage that moves is busy.
        if not self._is_busy():
            position_mm = self._rig.position_mm
            self._seen_mm = float("nan") if position_mm is None else position_mm
        return self._seen_mm


class CameraDevice(_Device):
    """The camera: ``trigger`` takes a frame whose exposure begins after it, ``read`` gives the frame and its mean."""

    def __init__(self, rig: Rig, name: str = "camera", users: _Users | None = None) -> None:
        super().__init__(rig, name, users)
        self._frame: NDArray[Any] | None = None
        self._taken = 0.0

    @property
    def hints(self) -> Hints:
        """What is worth plotting: the mean."""
        return {"fields": [f"{self._name}_mean"]}

    def stage(self) -> Work:
        """Connects to the rig if nobody has."""
        self._frame = None
        return Work(lambda: self._users.join(self._name), f"staging of {self._name}")

    def trigger(self) -> Work:
        """Takes a frame."""
        return Work(self._take, f"frame of {self._name}")

    def read(self) -> dict[str, Reading[Any]]:
        """The latest frame, (rows, columns), and its mean in DN; without one, it is taken."""
        frame = self._latest()
        return {
            self._name: {"value": frame, "timestamp": self._taken},
            f"{self._name}_mean": {"value": float(np.mean(frame)), "timestamp": self._taken},
        }

    def describe(self) -> dict[str, DataKey]:
        """What ``read`` gives."""
        source, frame = f"epirig:{self._identity(1)}", self._latest()
        return {
            self._name: {
                "source": source,
                "dtype": "array",
                "shape": list(frame.shape),
                "dtype_numpy": frame.dtype.str,
                "units": "DN",
            },
            f"{self._name}_mean": {"source": source, "dtype": "number", "shape": [], "units": "DN"},
        }

    def _take(self) -> NDArray[Any]:
        frame = self._rig.grab()
        self._frame, self._taken = frame, time.time()
        return frame

    def _latest(self) -> NDArray[Any]:
        return self._take() if self._frame is None else self._frame


def devices(rig: Rig, *, stage: str = "stage", camera: str = "camera") -> tuple[StageDevice, CameraDevice]:
    """Stage and camera of a rig, with their names in documents."""
    users = _Users(rig)
    return StageDevice(rig, stage, users), CameraDevice(rig, camera, users)
