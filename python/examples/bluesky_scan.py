"""A scan as a plan of bluesky, and its frames matched: stage and camera of the simulated rig as devices."""

from __future__ import annotations

from typing import Any

import bluesky.plans as bp
import numpy as np
from bluesky import RunEngine

import epirig
from epirig.bluesky import devices

# With a real rig: epirig.Rig(rig="rig.toml").
rig = epirig.Rig(rig="sim", set=["camera.size=256x192"])
stage, camera = devices(rig)

frames: list[Any] = []
positions_mm: list[float] = []


def keep(name: str, document: Any) -> None:
    if name == "event":
        frames.append(document["data"]["camera"])
        positions_mm.append(document["data"]["stage"])


# The plan connects to the rig, homes the stage, and lets go of both.
RunEngine()(bp.scan([camera], stage, 65, 105, 21), keep)

maps = epirig.match_array(np.stack(frames), tau=positions_mm)
print(f"{len(frames)} frames from {positions_mm[0]:.1f} to {positions_mm[-1]:.1f} mm")
print(f"median disparity {np.nanmedian(maps.disparity):.3f} px, sigma {np.nanmedian(maps.sigma):.4f} px")
