"""Disparity, height and their uncertainty from the frames of a capture rig.

``match_array`` matches frames in memory; a ``Sequence`` is a folder of frames with all its results;
``import_images`` makes one of photographs, ``capture`` of a rig. Options, defaults and messages are those of the
command line, which the package has, too: ``epirig --help``.
"""

import atexit as _atexit
from importlib.metadata import version as _version

from . import _native
from ._errors import DataError, DeviceError, EpirigError, Interrupted, OptionError
from ._maps import VALIDITY, Maps
from ._results import Results, Surface
from ._rig import CapturedFrame, Rig
from ._sequence import Sequence
from ._verbs import (
    capture,
    characterise,
    compare,
    demo,
    doctor,
    import_images,
    list_sequences,
    match_array,
    measure,
    plan,
    repeat,
    resume,
    trend,
)

__version__ = _version("epirig")
# Threads that work still would be ended in the middle of it.
_atexit.register(_native.end_all_calls)

__all__ = [
    "VALIDITY",
    "CapturedFrame",
    "DataError",
    "DeviceError",
    "EpirigError",
    "Interrupted",
    "Maps",
    "OptionError",
    "Results",
    "Rig",
    "Sequence",
    "Surface",
    "capture",
    "characterise",
    "compare",
    "demo",
    "doctor",
    "import_images",
    "list_sequences",
    "match_array",
    "measure",
    "plan",
    "repeat",
    "resume",
    "trend",
]
