"""The simulated rig as fixtures of pytest: ``pytest_plugins = ["epirig.testing.fixtures"]`` in conftest.py."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import mkdtemp

import pytest

from .. import Rig, Sequence
from . import simulated_rig


@pytest.fixture
def epirig_rig() -> Iterator[Callable[..., Rig]]:
    """Makes simulated rigs, with the arguments of ``epirig.testing.simulated_rig``; they are closed after the test."""
    rigs: list[Rig] = []

    def make(**options: object) -> Rig:
        rigs.append(simulated_rig(**options))  # type: ignore[arg-type]
        return rigs[-1]

    yield make
    for rig in rigs:
        rig.close()


@pytest.fixture
def epirig_scan(epirig_rig: Callable[..., Rig], tmp_path: Path) -> Callable[..., Sequence]:
    """Takes a scan with a simulated rig, with the arguments of ``epirig.testing.simulated_rig``."""

    def scan(**options: object) -> Sequence:
        folder = Path(mkdtemp(dir=tmp_path)) / "scan"
        for _ in epirig_rig(**options).capture(folder):
            pass
        return Sequence(folder)

    return scan
