"""The lines of docs/PEERS.md for epirig and its peers, on a scene that no code of epirig has made."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent.parent


def test_the_figures_of_the_page_are_those_of_its_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("numba", "cv2", "pyvale"):
        pytest.importorskip(module)
    # pyvale writes a log where it is.
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(ROOT / "benches" / "peers"), *sys.path])
    scenes: Any = importlib.import_module("scene")
    scene = scenes.render(scenes.SMALL)
    text = (ROOT / "docs" / "PEERS.md").read_text()
    section = text[text.index("## The same in Python") : text.index("## The scene\n")]
    blocks = re.findall(r"```python\n(.*?)```", section, flags=re.S)
    told = re.findall(r"^\| (epirig|OpenCV|pyvale).*?\| ([0-9.]+) \| ([0-9.]+)% \|", section, flags=re.M)
    assert len(blocks) == len(told) == 3
    for index, (block, (name, error_px, answered)) in enumerate(zip(blocks, told)):
        folder = tmp_path / str(index)
        folder.mkdir()
        names = {"frames": scene.frames, "folder": folder}
        exec(compile(block, name, "exec"), names)
        errors = np.abs(names["disparity"] - scene.disparity)[scene.visible]
        found = f"{np.nanmean(errors):.4f} px, {100 * np.isfinite(errors).mean():.1f} %"
        print(name, found)
        # Other versions and processors differ in the last digits.
        assert np.nanmean(errors) == pytest.approx(float(error_px), rel=0.1), f"{name}: {found}"
        assert 100 * np.isfinite(errors).mean() == pytest.approx(float(answered), abs=1), f"{name}: {found}"
