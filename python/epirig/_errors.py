"""What goes wrong, with the words of the command line."""

from __future__ import annotations

import json
from typing import Any


class _Failure(BaseException):
    exit_code: int
    """The exit code of the command line: 1 files, disk or memory, 2 wrong use, 3 no device, 4 device fault,
    5 bad or damaged data, 6 calibration rejected, 7 interrupted and can be resumed, 8 match without any
    answer, 130 interrupted."""
    kind: str
    """What the exit code means: ``usage``, ``data``, ``device`` and so on."""
    report: Any
    """What was measured before the failure, or None."""

    def __init__(
        self, message: str, exit_code: int = 1, kind: str = "trouble", report: Any = None
    ) -> None:
        super().__init__(message)
        self.exit_code = exit_code
        self.kind = kind
        self.report = report

    @property
    def advice(self) -> str:
        """What to do about it: the part of the message after the first semicolon; empty without one."""
        return str(self).partition("; ")[2]


class EpirigError(_Failure, Exception):
    """Something went wrong. Without a more special class: files, disk or memory, or a stage that ``stop()`` has stopped."""


class OptionError(EpirigError, ValueError):
    """An option or argument that cannot be used; it must be changed."""


class DataError(EpirigError, ValueError):
    """Frames, results or other data that cannot be used, or that have no answer."""


class DeviceError(EpirigError):
    """A stage or camera that is missing or has failed. With ``exit_code`` 7 the scan can be resumed."""


class Interrupted(_Failure, KeyboardInterrupt):
    """Ended by Ctrl-C. With ``exit_code`` 7 the scan can be resumed."""


_CLASSES: dict[str, type[_Failure]] = {
    "usage": OptionError,
    "data": DataError,
    "rejected": DataError,
    "no-answer": DataError,
    "no-device": DeviceError,
    "device": DeviceError,
    "resumable": DeviceError,
}


def of_failure(
    message: str, exit_code: int, kind: str, *, report: str | None = None, by_ctrl_c: bool = False
) -> _Failure:
    """The exception of a failure, as the native part names it."""
    made = Interrupted if by_ctrl_c else _CLASSES.get(kind, EpirigError)
    return made(message, exit_code, kind, None if report is None else json.loads(report))
