"""The simulated rig for tests: with faults by script, and the truth beside the result.

>>> import epirig
>>> from epirig.testing import simulated_rig
>>> with simulated_rig(frames=9, faults=["camera-no-signal@1"]) as rig:
...     rig.home()
...     rig.move_to(12)  # that of frame 1
...     try:
...         rig.grab()
...     except epirig.DeviceError as error:
...         print("no signal" in str(error))
True

pytest users find it as fixtures: ``pytest_plugins = ["epirig.testing.fixtures"]``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .. import _native
from .._errors import DataError
from .._maps import Maps
from .._results import Results
from .._rig import Rig
from .._sequence import Sequence

__all__ = ["Stage", "Truth", "simulated_rig", "truth"]

Stage = Literal["sim", "native", "grbl", "zaber"]


def simulated_rig(
    *,
    faults: Iterable[str] = (),
    stage: Stage = "sim",
    frames: int = 21,
    step_mm: float = 2.0,
    columns: int = 256,
    rows: int = 192,
    noise_dn: float = 0.0,
    seed: int = 0,
    real_time: bool = False,
    wait_s: float = 1.0,
    settings: Iterable[str] = (),
) -> Rig:
    """A rig of which nothing is real: a stage, a camera, and a tile with hollows of 0.2 mm at 900 mm.

    Frames are small, so that tests are quick: to measure the hollows, take ``columns=768, rows=768, step_mm=7.5``.
    A rig that is connected again is a new one, and its faults happen again.

    Parameters
    ----------
    faults
        What goes wrong, and at which frame, counted from 0: ``["lost-steps@40/0.1mm", "camera-torn@12"]``. The
        book lists them ("The stage"). Each happens once, when the stage is first sent to that frame.
    stage
        The stage, with a travel of 200 mm (grbl: 59 mm, zaber: 150 mm): ``"sim"`` is one in memory. The others are driven by the driver of a real stage, over a line to
        its simulated device; only these can have faults of the line, such as ``"reset@40+0.2s"``.
    frames
        Number of frames of a scan.
    step_mm
        Distance from frame to frame, in mm. The first frame is at 10 mm.
    columns, rows
        Size of the frames.
    noise_dn
        Standard deviation of the noise of a pixel, in grey levels of 255.
    seed
        Seed of the camera and of a stage in memory: the same seed gives the same frames.
    real_time
        Whether moves and frames take as long as they would.
    wait_s
        How long a scan waits for a stage or camera that has gone, in s.
    settings
        More keys of the profile, as ``"stage.backlash=10 um"``.
    """
    script = ",".join([faults] if isinstance(faults, str) else faults)
    keys = [
        f"camera.size={columns}x{rows}",
        "plan.settle=20 ms",
        f"sim.noise={noise_dn} DN",
        f"sim.seed={seed}",
        f"sim.real_time={'true' if real_time else 'false'}",
        f"limits.wait={wait_s} s",
        *([f"sim.faults={script}"] if script else []),
        *([settings] if isinstance(settings, str) else settings),
    ]
    port = None if stage == "sim" else "sim"
    return Rig(rig="sim", driver=stage, port=port, frames=frames, step_mm=step_mm, set=keys)


@dataclass(frozen=True, eq=False, repr=False)
class Truth:
    """What the simulator knows of a scan; maps of (rows, columns) over the pixels of the reference frame."""

    disparity: NDArray[np.float32]
    """True disparity in px over the whole baseline; NaN beside the object."""
    height_mm: NDArray[np.float32]
    """True height towards the camera over the nearest level of the scene, in mm; NaN beside the object."""
    reference: int
    """Index of the reference frame."""
    positions_mm: NDArray[np.float64]
    """Where the carriage truly stood at each frame, in mm from home, with the errors of its screw
    (``sim.step_error``). Backlash, noise, and steps that were lost are not known here."""
    tau: NDArray[np.float64]
    """The same on the baseline, from 0 to 1."""

    def errors(self, found: Results | Maps) -> NDArray[np.float32]:
        """Measured less true disparity, in px: (rows, columns); NaN without an answer, or beside the object.

        Raises
        ------
        epirig.DataError
            If it was measured in another reference frame, or in frames of another size.
        """
        reference = found.record["reference"] if isinstance(found, Results) else found.reference
        if (reference, found.disparity.shape) != (self.reference, self.disparity.shape):
            raise DataError(
                f"this is the truth of frame {self.reference}, {self.disparity.shape}, and that was measured in frame "
                f"{reference}, {found.disparity.shape}; ask for truth(sequence, {reference}), after the calibration if "
                "there is one",
                5,
                "data",
            )
        return np.asarray(found.disparity - self.disparity)


def truth(sequence: Sequence, reference: int | None = None) -> Truth:
    """The truth of a scan of the simulated rig.

    A camera that is turned or distorts must be calibrated first; its truth is that of the rectified frames.

    Parameters
    ----------
    sequence
        The scan.
    reference
        Index of the frame to whose pixels the maps belong. Without it: the middle of the baseline, as in a match.

    Raises
    ------
    epirig.EpirigError
        If the scan was not simulated or lacks frames, or its camera must be calibrated first.
    """
    disparity, height_mm, used, positions_mm, tau = _native.sequence_truth(sequence.folder, reference)
    return Truth(disparity, height_mm, used, np.array(positions_mm), np.array(tau))
