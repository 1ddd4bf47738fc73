"""A sequence: frames on disk, with all that was done to them."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._call import Progress
from ._results import Results, Surface
from ._verbs import SequenceVerbs


class Sequence(SequenceVerbs):
    """A folder of frames, as ``epirig import`` or a scan has written it.

    Raises
    ------
    epirig.EpirigError
        If there is no sequence in the folder, or it cannot be read.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder).absolute()
        """The folder."""
        facts: dict[str, Any] = json.loads(_native.sequence_facts(self.folder))
        self.record: dict[str, Any] = facts["record"]
        """The record ``sequence.json``: what the rig was, and what was planned."""
        self.ended: str = facts["ended"]
        """How the scan ended: ``complete``, ``aborted``, ``failed``, ``not-closed`` or ``unfinished``."""
        positions = facts["positions_mm"]
        self.positions_mm: NDArray[np.float64] | None = None if positions is None else np.array(positions)
        """Position of the stage at each frame, in mm; None if it is not known."""
        self._frames: int = facts["frames"]

    def __len__(self) -> int:
        """Number of frames."""
        return self._frames

    def __repr__(self) -> str:
        return f"Sequence({str(self.folder)!r})"

    def frames(self, *, rectified: bool = False, progress: Progress | None = None) -> NDArray[Any]:
        """The frames: an array of (frames, rows, columns).

        Parameters
        ----------
        rectified
            Corrected and rectified by the calibration, of float32 in DN. Without it as they were captured, of
            uint8 or uint16.
        progress
            Called with what is done, how many parts of it are done, and of how many.
        """
        frames: NDArray[Any] = _native.read_frames(self.folder, rectified, progress)
        return frames

    def tau(self, *, rectified: bool = False) -> NDArray[np.float64]:
        """Position of each frame on the baseline, from 0 to 1; of the calibration, if it is ``rectified``."""
        return np.array(_native.sequence_tau(self.folder, rectified))

    def results(self, folder: str | os.PathLike[str] | None = None) -> Results:
        """Results that were written before. Without a folder: those in ``results``."""
        return Results(self.folder / "results" if folder is None else folder)

    def measured_surface(self, folder: str | os.PathLike[str] | None = None) -> Surface:
        """The surface that was written before. Without a folder: that in ``results/surface``."""
        return Surface(self.folder / "results" / "surface" if folder is None else folder)
