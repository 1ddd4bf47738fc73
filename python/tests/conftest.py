"""Scenes and sequences that the tests share."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import epirig

pytest_plugins = ["epirig.testing.fixtures"]


@pytest.fixture(autouse=True)
def ctrl_c_is_heard() -> None:
    """A shell starts what runs in the background with Ctrl-C ignored, and other programs leave handlers of their own."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def frames() -> NDArray[np.uint8]:
    """A scene that moves by 6 px along the rows; (frames, rows, columns)."""
    t, y, x = np.ogrid[0:15, 0:48, 0:96]
    place = x - 6.0 * t / 14
    light: NDArray[np.float64] = 120 + 60 * np.sin(0.9 * place + y) + 50 * np.sin(0.37 * place - 2 * y)
    return light.astype(np.uint8)


@pytest.fixture(scope="session")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> epirig.Sequence:
    """A scan of the simulated rig."""
    folder = tmp_path_factory.mktemp("scan") / "seq"
    small = ["camera.size=256x192", "plan.settle=20 ms"]
    return epirig.capture(out=folder, rig="sim", set=small, frames=21, step_mm=7.5)


@pytest.fixture(scope="session")
def written(sequence: epirig.Sequence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A place for results."""
    return tmp_path_factory.mktemp("results")
