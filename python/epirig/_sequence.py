"""A sequence: frames on disk, with all that was done to them."""

from __future__ import annotations

import json
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._call import Progress
from ._errors import DataError
from ._results import Results, Surface
from ._verbs import SequenceVerbs, import_images


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

    @classmethod
    def from_array(
        cls,
        frames: ArrayLike,
        out: str | os.PathLike[str],
        *,
        positions_mm: ArrayLike | None = None,
        **options: Any,
    ) -> Sequence:
        """Writes frames in memory as a new sequence, which can be calibrated, rectified and measured.

        Frames that are rectified already need no sequence: ``epirig.match_array`` takes them.

        Parameters
        ----------
        frames
            Array of (frames, rows, columns), or a sequence of arrays of (rows, columns), of uint8 or uint16.
        out
            Folder of the new sequence.
        positions_mm
            Position of each frame, in mm. Without it, and without ``step_mm``: unknown.
        options
            Those of ``epirig.import_images``, such as ``step_mm``, ``focal_length_px`` or ``rig``.

        Raises
        ------
        epirig.DataError
            If the array has another shape or type.
        """
        stack = np.asarray(frames)
        if stack.ndim != 3 or stack.dtype.kind != "u" or stack.dtype.itemsize > 2:
            found = f"{stack.dtype} of shape {stack.shape}"
            raise DataError(f"frames are an array of (frames, rows, columns) of uint8 or uint16, not {found}", 5, "data")
        with TemporaryDirectory() as folder:
            images = Path(folder) / "frames"
            images.mkdir()
            for index, frame in enumerate(stack):
                rows, columns = frame.shape
                head = f"P5 {columns} {rows} {np.iinfo(frame.dtype).max}\n".encode()
                # Samples of two bytes have the larger one first.
                samples = frame.astype(frame.dtype.newbyteorder(">"))
                (images / f"{index:06}.pgm").write_bytes(head + samples.tobytes())
            if positions_mm is not None:
                options["positions"] = Path(folder) / "positions.txt"
                places = [f"{float(place)!r}\n" for place in np.asarray(positions_mm).ravel()]
                options["positions"].write_text("".join(places))
            return import_images([images], out=out, **options)

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
